"""`mirotwin replay` of a case: whether the check that failed fails again."""

from __future__ import annotations

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import SPACE_BYTES, Image
from mirotwin.rerun.job import Job, rerun_job
from mirotwin.shell.console import show
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.program import DONE, complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.cases.replay_line import debug_line, foreign_path
from mirotwin.verify.cases.verdict import CaseVerdict, verdict_of
from mirotwin.verify.checks.expect import expectations_of


def replay_case(job: Job, image: Image, file: str, quiet: bool) -> int:
    """Runs it; the exit code is that of its check: 1, or 3 for a firmware fault; 0 if other firmware cures it."""
    name = job.case.verdict.partition(":")[0]
    expected = expectations_of(job.scenario, file)
    if not any(check.name == name for checks in expected.values() for check in checks):
        what = f"the verdict is of the check {name!r}, which nothing expects"
        raise BadInput(file, "header", what, "put it into [expect], or take the verdict away")
    end_tick = job.case.end_tick or None
    periods = None if end_tick is None else -(-end_tick // CONTROL_PERIOD_TICKS)
    with ProgressBar("replaying", periods, quiet) as bar:
        again = rerun_job(job, image, file, end_tick, lambda tick: bar.to(tick // CONTROL_PERIOD_TICKS))
    judged = all(one.name != name or one.verdict != "not judged" for one in again.checks.verdicts())
    verdict = verdict_of(job.case.verdict, again.failures, job.case.changed, judged)
    _say(verdict)
    if again.failures and not quiet:
        show(debug_line(file, foreign_path(image)))
    return verdict.code


def replay_bare_case(path: str, firmware: str | None, check: str | None) -> int:
    """The same for a case of a bare processor. `check`: FILE.py:FUNCTION, for a case whose check is in a file."""
    if firmware is None:
        remedy = "give --firmware IMAGE.ihx"
        raise BadInput(path, "", "is for a bare processor, which has no firmware of its own", remedy)
    from mirotwin.verify.bare.case import replay_bare  # loads the bare processor

    return _say(replay_bare(path, load_firmware(firmware, SPACE_BYTES), check))


def _say(verdict: CaseVerdict) -> int:
    for line in verdict.lines:
        (show if verdict.code == DONE else complain)(line)
    return verdict.code
