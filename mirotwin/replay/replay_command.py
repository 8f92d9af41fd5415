"""`mirotwin replay`: what was sent, sent again, and whether the robot answers as it did."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import click
import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.periods import Period
from mirotwin.desk.guard import DeskOptions
from mirotwin.recording.compare import CompareRule, differences
from mirotwin.recording.difference import Difference
from mirotwin.recording.runner import report_faults
from mirotwin.replay.annotated_image import annotated_of
from mirotwin.replay.compare_options import CompareOptions
from mirotwin.replay.differences import (
    SHOWN,
    differences_as_json,
    print_differences,
    print_firmwares,
    print_frames,
    print_json,
    print_response,
)
from mirotwin.replay.firmwares import FirmwareDifference, first_instruction
from mirotwin.replay.lockstep import LOOK_TICKS
from mirotwin.rerun.job import Job, load_job, rerun_job
from mirotwin.shell.command import command_of
from mirotwin.shell.console import show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.options import ALL, FORCE, OUT, QUIET, SEED, SET, Engine, StackFrom, plain_parameters
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE, exit_code
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.cases.case import is_bare_case
from mirotwin.verify.cases.replay_line import CaseOptions, debug_line, foreign_path
from mirotwin.verify.cases.rerun import CaseVerdict, Rerun
from mirotwin.verify.checks.expect import says_anything
from mirotwin.verify.expectations import as_settings, expectations_text, report_failures


def replay_case(job: Job, quiet: bool) -> int:
    """Runs it; the exit code is that of its check: 1, or 3 for a firmware fault; 0 if other firmware cures it."""
    job.expectations_of_case()
    end_tick = job.case.end_tick or None
    with ProgressBar("replaying", end_tick, quiet) as bar:
        again = rerun_job(job, end_tick, bar.to)
    return _told(job.verdict_of_case(again.checks), debug_line(job.file, foreign_path(job.runs_on)), quiet)


def replay_bare_case(path: str, firmware: str | None, check: str | None, quiet: bool) -> int:
    """The same for a case of a bare processor. `check`: FILE.py:FUNCTION, for a case whose check is in a file."""
    from mirotwin.verify.bare.case import load_case_firmware, rerun_bare_case  # loads the bare processor

    image = load_case_firmware(path, firmware)
    _, verdict = rerun_bare_case(path, image, check)
    return _told(verdict, debug_line(path, firmware, check=check), quiet)


def _told(verdict: CaseVerdict, again: str, quiet: bool) -> int:
    """Says the verdict, and `again`, the command that stands at what failed; the exit code."""
    for line in verdict.lines:
        (show if verdict.code == DONE else complain)(line)
    if verdict.failure is not None and not quiet:
        show(again)
    return verdict.code


_OF_A_RECORDING = ("kind", "within_ms", "within_counts", "within_counts_per_sample", "from_time")
_OF_THE_WORLD = (*_OF_A_RECORDING, "seed", "settings", "expected")
AT_PORT = DeskOptions.HEADING


class ReplayOptions(CaseOptions, frozen=True, kw_only=True):
    stack_from: StackFrom = None
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()
    seed: Annotated[int | None, SEED.saying("Master seed instead of the recorded one.")] = None
    settings: Annotated[
        tuple[str, ...],
        SET.saying(
            "A key to set in the recorded scenario (or the default one, for a text stream), as for `run`."
        ),
    ] = ()
    compare: CompareOptions = CompareOptions()
    desk: DeskOptions = DeskOptions()
    out: Annotated[
        Path | None, OUT.saying("Folder of the recording. Default: runs/FILE-port.", heading=AT_PORT)
    ] = None
    force: Annotated[bool, FORCE.saying("Replace a recording in the folder.", heading=AT_PORT)] = False
    engine: Engine = None
    everything: Annotated[
        bool,
        ALL.saying(
            f"List all frames, not only the first {SHOWN}, and all differences, not only the first of each channel."
        ),
    ] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no lists of frames or differences.")] = False


@command_of(ReplayOptions)
def replay(options: ReplayOptions) -> int:
    """Sends the bytes of FILE again and compares what the robot does.

    FILE is a run.mcap, a text stream, or the folder of a run or of a failed test.

    Exit code 4 when it differs from the recording, also where a firmware fault comes of it: 4 goes before 3. The first
    difference is said on stderr, and the first of each channel in a table. Where another --firmware makes it differ,
    the first instruction that both execute otherwise is looked for.

    A recording that was broken off, or a part of one, is compared as far as it goes, with a note.
    A text stream runs over an ideal link in the default
    scenario, and there is nothing to compare. A capture (pcapng) is made one by `mirotwin export`; of bytes without
    times write one, a line `TICK > HEX BYTES` a transmission.

    A case (a stream with `verdict` in its header) runs to its end, and the exit code is that of the check that failed:
    1, or 3 for a firmware fault; 0 if other firmware or settings cure it, 4 if it does not fail again without them.
    A case of `mirotwin fuzz --bare` needs --firmware, and --check FILE.py:FUNCTION if its check is in a file.

    Where --expect is given, that decides: a difference is only told, and the exit code is 1 if a check fails, else 0.
    What the recorded scenario expects is judged too, but a difference goes before it.

    With --port the bytes go to a real robot, at their times. What it answers is recorded, and compared with what its
    twin answers to the same bytes at the same times (--compare answers). A recording made at a port is compared so,
    too. Nothing that moves a robot is sent without --allow-motion.

    The list shows the host's frames as sent, before the radio, and the robots' answers as the PC heard them.
    """
    if not options.desk.port and (given := options.given("out", "force")):
        raise click.UsageError(f"{given[0]} needs --port.")
    file, compare = file_in(options.file, (*RECORDINGS, *CASES)), options.compare
    if is_bare_case(file):
        _refuse(file, "is not for a case of a bare processor", options.given(*_OF_THE_WORLD, "port"))
        return replay_bare_case(file, options.firmware, options.check, options.quiet)
    _refuse(file, "is for a case of a bare processor", options.given("check"))
    settings = (*options.settings, *as_settings(options.expected))
    if options.stack_from is not None and options.firmware is None:
        raise click.UsageError("--stack-from needs --firmware; a recorded image has its own.")
    job = load_job(file, options.firmware, settings, options.seed, options.stack_from)
    if not job.recorded and not options.desk.port:
        _refuse(file, "a text stream holds nothing to compare with", options.given(*_OF_A_RECORDING))
    images = load_images(options.lines_from, job.image)
    checked_sources(options.sources)
    desk = options.desk
    decides = any(".expect." in f".{one}" for one in settings)
    if decides and (desk.port or job.origin):
        what = "is not for a robot at a port, of which only answers are known"
        raise BadInput(file, "--expect", what, "leave it out: the answers are compared with the twin's")
    if desk.port:
        compare.of_answers(file)  # refuses before anything is sent
        from mirotwin.replay.replay_port import record_at_port  # loads pyserial

        file = str(record_at_port(job, desk, options.out, options.force, options.quiet))
        job = load_job(file, None)
    if job.origin:
        from mirotwin.replay.replay_port import compare_with_twin

        rule = compare.of_answers(file)
        return compare_with_twin(job, rule, options.everything, options.quiet, compare.as_json)
    if compare.kind == "answers":
        what = "is for robots at a port, and this was recorded at none"
        raise BadInput(file, "--compare answers", what, "give --port, or another comparison")
    if job.case.verdict:
        _refuse(file, "is not for a case, which ends where it failed", options.given("to_time", "as_json"))
        return replay_case(job, options.quiet)
    judged = says_anything(job.scenario)
    if job.recorded:
        compare.check_reaches(job.file, job.recorded)
    periods = _periods(job, compare.rule)
    again = _rerun(job, compare.rule, periods, options.quiet or compare.as_json)
    world, checks, replayed = again.world, again.checks, again.periods
    rule = msgspec.structs.replace(compare.rule, digests=job.state == world.state.tables())
    found = differences(job.recorded, replayed, rule)
    apart = None
    if found and job.image is not None and job.image.code != job.runs_on.code:
        one, other = annotated_of(job.image, images, ()), annotated_of(job.runs_on, (), options.sources)
        with plain_parameters(job.file, "replayed"):
            apart = first_instruction(job.world_of, one, other, found[0].tick + LOOK_TICKS)

    if not options.quiet and not compare.as_json:
        print_frames(job, replayed, options.everything, compare.rule.to_tick)
        if job.recorded and found:
            print_differences(found, options.everything)
    if not job.recorded and not compare.as_json:
        print_response(replayed)
    failed = report_failures(checks)
    if judged and not options.quiet and not compare.as_json:
        show(expectations_text(checks.verdicts()))
    faults = report_faults(world, again.tick)
    differs = _verdict(job, compare, periods, replayed, found, apart)
    if found and not options.quiet and not compare.as_json:
        show(debug_line(file, options.firmware, found[0].tick))
    code = (faults or failed) if decides else (differs or faults or failed)
    if compare.as_json:
        firmwares = {"recorded": job.image.sha256 if job.image else None, "replayed": job.runs_on.sha256}
        document = {
            "file": file,
            "seed": job.seed,
            "firmware": firmwares,
            "periods": {"recorded": len(job.recorded), "replayed": len(replayed)},
            **compare.rule_as_json(),
            **differences_as_json(found, options.everything),
            "instruction": None if apart is None else apart.as_json(),
            "exit_code": code,
        }
        print_json(document)
    return code


def _refuse(file: str, what: str, given: Sequence[str]) -> None:
    """Raises BadInput for the first of the options that were given and mean nothing here."""
    if given:
        raise BadInput(file, given[0], what, "leave it out")


def _periods(job: Job, rule: CompareRule) -> int | None:
    """How many of the recorded control periods are replayed; None: nothing was recorded."""
    if not job.recorded:
        return None
    first = job.recorded[0].index
    there = first + len(job.recorded)
    if rule.to_tick is None:
        return there - first
    return min(there, -(-rule.to_tick // CONTROL_PERIOD_TICKS)) - first


def _rerun(job: Job, rule: CompareRule, periods: int | None, quiet: bool) -> Rerun:
    """The first `periods` of it, as far as the scenario goes; a stream to where it ends, as `test` runs it.

    Its checks end there, and its world with the control period, so that all frames are listed.
    """
    if periods is None:
        ends = (tick for tick in (rule.to_tick, job.case.end_tick) if tick)
        until_tick = min(ends, default=job.scenario.periods * CONTROL_PERIOD_TICKS)
    else:
        until_tick = min(job.recorded[0].index + periods, job.scenario.periods) * CONTROL_PERIOD_TICKS
    with ProgressBar("replaying", until_tick, quiet) as bar:
        again = rerun_job(job, until_tick, bar.to, cut=rule.to_tick is not None)
    if again.world.in_period and not again.world.stopped:
        again.world.run_to(again.world.period_end)
    return again


def _verdict(
    job: Job,
    compare: CompareOptions,
    periods: int | None,
    replayed: Sequence[Period],
    found: Sequence[Difference],
    apart: FirmwareDifference | None,
) -> int:
    if not job.recorded:
        return DONE
    if found:
        complain(f"the replay differs in control period {found[0].period}, {found[0]}")
        if apart is not None:
            print_firmwares(apart)
        return exit_code("differs")
    if periods is not None and len(replayed) < periods:
        complain(f"the replay ended after {len(replayed)} of {periods} recorded control periods")
        return exit_code("differs")
    if not compare.as_json:
        how = "" if compare.rule.kind == "bits" else f" ({compare.described()})"
        count = compare.rule.compared(replayed)
        show(f"the robots' response equals the recorded one in all {amount(count, 'control period')}{how}")
    return DONE
