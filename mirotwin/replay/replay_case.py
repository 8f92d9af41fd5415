"""`mirotwin replay` of a case: whether the check that failed fails again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image
from miro_sim.radio.downlink import TransmissionError
from mirotwin.rerun.job import Job
from mirotwin.shell.console import show
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.program import DIVERGENCE, DONE, EXPECTATION_FAILED, FIRMWARE_FAULT, complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.checks.expect import Place, expectations_of
from mirotwin.verify.checks.interface import Check, Failure
from mirotwin.verify.checks.watching import Checks


def replay_case(job: Job, image: Image, file: str, quiet: bool) -> int:
    """Runs it; the exit code is that of its check: 1, or 3 for a firmware fault; 0 if other firmware cures it."""
    with plain_parameters(file, "replayed"):
        world = job.world(image)
    expected = expectations_of(job.scenario, file)
    checks = Checks(world, expected)
    end_tick = job.case.end_tick or world.periods * CONTROL_PERIOD_TICKS
    _check(job, file, expected)
    with ProgressBar("replaying", -(-end_tick // CONTROL_PERIOD_TICKS), quiet) as bar:
        try:
            with plain_parameters(file, "replayed"):
                while not world.stopped and world.tick < end_tick:  # a case may end after its scenario does
                    world.run_to(min(end_tick, (world.index + 1) * CONTROL_PERIOD_TICKS))
                    bar.to(world.index)
        except TransmissionError as error:
            raise BadInput(file, "", f"cannot be replayed beyond tick {world.tick}: {error}") from None
    checks.finish()
    return _judged(job, checks)


def _check(job: Job, file: str, expected: Mapping[Place, Sequence[Check]]) -> None:
    """Raises BadInput for a case that cannot say whether its check fails again."""
    name = _name(job)
    if not any(check.name == name for checks in expected.values() for check in checks):
        what = f"the verdict is of the check {name!r}, which nothing expects"
        raise BadInput(file, "header", what, "put it into [expect], or take the verdict away")


def _name(job: Job) -> str:
    return job.case.verdict.partition(":")[0]


def _judged(job: Job, checks: Checks) -> int:
    verdict = job.case.verdict
    if checks.failures:
        again = [one for one in checks.failures if str(one) == verdict]
        first = again[0] if again else checks.failures[0]
        complain(f"fails as recorded: {first}" if again else f"still fails, but not as recorded: {first}")
        if not again:
            complain(f"recorded: {verdict}")
        return _code(first)
    wanted = _name(job)
    if any(one.name == wanted and one.verdict == "not judged" for one in checks.verdicts()):
        complain(f"expectation not judged: the run had no occasion for it; recorded: {verdict}")
        return EXPECTATION_FAILED
    if job.case.changed:
        show(f"cured: {wanted} passes; recorded: {verdict}")
        return DONE
    complain(f"not reproduced: {wanted} passes; recorded: {verdict}")
    return DIVERGENCE


def _code(failure: Failure) -> int:
    return FIRMWARE_FAULT if failure.fault else EXPECTATION_FAILED
