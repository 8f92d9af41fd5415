"""`mirotwin replay`: sends the recorded bytes again and compares the robot's reaction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image
from mirotwin.desk.guard import DeskOptions
from mirotwin.recording.capture.options import CaptureOptions
from mirotwin.replay.difference import ComparedRun, RunDifference, compare_runs
from mirotwin.replay.lockstep.annotated_image import annotated_of
from mirotwin.replay.options import CompareOptions, check_reaches, extent, refuse_given, rule_as_json
from mirotwin.replay.text import SHOWN, difference_lines, difference_tables, frame_tables, response_table
from mirotwin.report.page.link import LinkLog
from mirotwin.runs.job import Job, load_job
from mirotwin.runs.result import Result, expectations_text
from mirotwin.runs.run import Run
from mirotwin.shell.command import command_line, command_of, operand
from mirotwin.shell.console import show
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, checked_sources, load_images
from mirotwin.shell.json_text import print_json
from mirotwin.shell.options import ALL, FORCE, OUT, QUIET, SEED, SET, Engine, StackFrom
from mirotwin.shell.outputs import RECORDING, RECORDINGS, OutputFolder, file_in
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE, exit_code
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.cases.replay_line import CaseOptions, debug_line, foreign_path
from mirotwin.verify.checks.expect import says_anything
from mirotwin.verify.expectations import as_settings, in_files

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen

_OF_A_RECORDING = ("kind", "within_ms", "within_counts", "within_counts_per_sample", "from_time")


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
    capture: CaptureOptions = CaptureOptions()
    out: Annotated[
        Path | None,
        OUT.saying(
            "Folder for a recording of what the robots do. Default with --port: runs/FILE-port, else none."
        ),
    ] = None
    force: Annotated[bool, FORCE.saying("Replace a recording in the folder.")] = False
    engine: Engine = None
    everything: Annotated[
        bool,
        ALL.saying(
            f"List all frames, not only the first {SHOWN}, and all differences, not only the first of each channel."
        ),
    ] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no lists of frames or differences.")] = False

    @property
    def expects(self) -> bool:
        """True if checks decide, not differences."""
        return bool(self.expected) or any(".expect." in f".{key}" for key in self.settings)

    @property
    def shows(self) -> bool:
        """True if tables are printed."""
        return not self.quiet and not self.compare.as_json


@command_of(ReplayOptions)
def replay(options: ReplayOptions) -> int:
    """Sends the bytes of FILE again and compares the robot's reaction.

    FILE is a run.mcap, a text stream, a capture of a serial line, or the folder of a run or of a failed test.

    Exit code 4 when it differs from the recording; if a firmware fault comes of it too, the code is 4. The first
    difference is printed on stderr, and the first of each channel in a table. If the runs differ, both are repeated to
    find the first tick and field in which their states differ, and with another --firmware the first instruction.

    An interrupted recording, or a part of one, is compared to its end, with a note. A text stream runs over an ideal
    link in the default scenario, and there is nothing to compare. So does a capture of any form that `mirotwin decode`
    reads; one without times needs --assume-contiguous.

    A case (a stream with `verdict` in its header) runs to its end, and the exit code is that of the check that failed:
    1, or 3 for a firmware fault. 0: fixed by your change of firmware or settings. 4: it no longer fails, unchanged.
    A case of `mirotwin fuzz --bare` needs --firmware, and --expect FILE.py:CLASS if its check is in a file.

    With --expect those checks decide: a difference is only reported, and the exit code is 1 if a check fails, else 0.
    The recorded scenario's own checks are judged too; if there is also a difference, the code is 4.

    With --port the bytes go to a real robot, at their times. Its answers are recorded, and compared with its twin's
    answers to the same bytes at the same times (--compare answers). A recording made at a port is compared in the same
    way. Nothing that moves a robot is sent without --allow-motion.

    The list shows the host's frames as sent, before the radio, the result of each at the robots (fresh, stale, damaged,
    lost, ignored), the stops by their failsafe, and their answers as received by the PC. If there are too many, frames
    that are not fresh have precedence; --all lists everything. With --out the run is recorded: `mirotwin report` makes
    its page.
    """
    if options.force and options.out is None and not options.desk.port:
        raise click.UsageError("--force needs --out or --port.")
    file = file_in(options.file, (*RECORDINGS, *CASES))
    options.plugins.bring()
    job, images = _loaded(file, options)
    if options.desk.port:
        job = _sent_to_port(job, options)
    elif job.origin or job.case.verdict or job.alone:
        reason = "is for a stream, a capture or a recording of a twin"
        refuse_given(file, reason, options.given("out", "force"))
    if job.origin:
        return _compare_with_twin(job, options)
    if options.compare.kind == "answers":
        reason = "is for robots at a port, and this was recorded at none"
        raise BadInput(file, "--compare answers", reason, "give --port, or another comparison")
    if job.case.verdict or (job.alone and not job.recorded):
        return _replay_case(job, options)
    return _compare_with_recorded(job, images, options)


def _replay_case(job: Job, options: ReplayOptions) -> int:
    """The exit code is that of its check: 1, or 3 for a firmware fault; 0 if other firmware cures it."""
    refuse_given(
        job.spec.origin, "is not for a case, which ends where it failed", options.given("to_time", "as_json")
    )
    with ProgressBar("replaying", job.end_tick, options.quiet) as bar:
        result = job.judge_case(bar.to)
    own_files = tuple(in_files(options.expected).values())
    line = debug_line(
        job.spec.origin, foreign_path(job.spec.image), expected=own_files, plugins=options.plugins
    )
    return _report_case(result, line, options.quiet)


def _report_case(result: Result, line: str, quiet: bool) -> int:
    """`line`: the command that opens the debugger at the failure."""
    for text in result.texts:
        (show if result.code == DONE else complain)(text)
    if result.failures and not quiet:
        show(line)
    return result.code


def _loaded(file: str, options: ReplayOptions) -> tuple[Job, list[Image]]:
    """The job to replay, and the images of --lines-from. Raises BadInput for options that do not apply to it."""
    if options.stack_from is not None and options.firmware is None:
        raise click.UsageError("--stack-from needs --firmware; a recorded image has its own.")
    keys = (*options.settings, *as_settings(options.expected))
    job = load_job(file, options.firmware, keys, options.seed, options.stack_from, options.capture)
    complain(*job.notes)
    if job.alone and options.desk.port:
        raise BadInput(file, "--port", "is for robots, and this is for a board", "leave it out")
    if not job.recorded and not options.desk.port:
        refuse_given(file, "a text stream holds nothing to compare with", options.given(*_OF_A_RECORDING))
    images = load_images(options.lines_from, job.image)
    checked_sources(options.sources)
    if options.expects and (options.desk.port or job.origin):
        reason = "is not for a robot at a port, of which only answers are known"
        raise BadInput(file, "--expect", reason, "leave it out: the answers are compared with the twin's")
    return job, images


def _compare_with_recorded(job: Job, images: Sequence[Image], options: ReplayOptions) -> int:
    """Replays a recording and compares; a stream has nothing to compare with."""
    compare, scenario = options.compare, job.spec.scenario
    rule = replace(compare.rule(scenario.clock), period_ticks=scenario.period_ticks)
    if job.alone:
        compare.refuse_of_robots(job.spec.origin)
    to_tick = rule.to_tick
    if job.recorded:
        check_reaches(rule, job.spec.origin, job.recorded)
    recorded = [period for period in job.recorded if to_tick is None or period.tick < to_tick]
    folder = None if options.out is None else OutputFolder(options.out, options.force, (RECORDING,))
    air: list[LinkLog] = []
    listens = options.shows and not job.alone
    again = _rerun(
        job, to_tick, not options.shows, (lambda world: air.append(LinkLog(world))) if listens else None
    )
    difference = compare_runs(
        ComparedRun(recorded, [job.as_recorded] if job.image and job.as_recorded else []),
        ComparedRun(again.periods, [job.spec]),
        replace(rule, digests=job.state == again.world.state.tables()),
        (
            partial(annotated_of, images=images, sources=()),
            partial(annotated_of, images=(), sources=options.sources),
        ),
    )
    result = again.result()
    ended = len(again.periods) < len(recorded)
    if options.shows:
        if not job.alone:
            show(*frame_tables(job, again.periods, options.everything, to_tick, air[0].marks()))
        show(*difference_tables(difference, options.everything))
    if not job.recorded and not compare.as_json:
        show(response_table(again.periods))
    complain(*result.texts)
    if options.shows and says_anything(job.spec.scenario):
        show(expectations_text(result.expectations))
    complain(*difference_lines(difference, "the replay differs"), *difference.notes)
    if folder is not None:
        again.write(folder)
        if not compare.as_json:
            show(
                f"{folder.path / RECORDING}: `{command_line('report', operand(f'{folder.path}'))}` makes its page"
            )
    if difference.differences and options.shows:
        first_tick = difference.differences[0].tick
        show(debug_line(job.spec.origin, options.firmware, first_tick, plugins=options.plugins))
    elif ended and not difference.differences:
        complain(f"the replay ended after {len(again.periods)} of {len(recorded)} recorded control periods")
    elif recorded and not difference.differences and not compare.as_json:
        whose = (
            "the board does the same as recorded"
            if job.alone
            else "the robots' response equals the recorded one"
        )
        show(f"{whose} in {extent(rule, again.periods)}")
    differs = (difference.differences or ended) and not options.expects
    code = exit_code(result.verdict, *(["differs"] if differs else []))
    if compare.as_json:
        firmware = {"recorded": job.image and job.image.sha256, "replayed": job.spec.image.sha256}
        periods = {"recorded": len(job.recorded), "replayed": len(again.periods)}
        head = {"file": job.spec.origin, "seed": job.spec.seed, "firmware": firmware, "periods": periods}
        print_json(
            {**head, **rule_as_json(rule), **difference.as_json(options.everything), "exit_code": code}
        )
    return code


def _rerun(job: Job, to_tick: int | None, quiet: bool, watch: Callable[[World], object] | None) -> Run:
    """Runs everything, or the control periods that begin before `to_tick`; a stream up to that tick.

    Its checks end there, and its world with the control period, so that all frames are listed.
    """
    end_tick = job.end_tick
    if to_tick is not None and job.recorded:
        period_ticks = job.spec.scenario.period_ticks
        end_tick = min(end_tick, -(-to_tick // period_ticks) * period_ticks)
    elif to_tick is not None:
        end_tick = min(to_tick, job.case.end_tick or to_tick)
    with ProgressBar("replaying", end_tick, quiet) as bar:
        again = job.run(end_tick, bar.to, to_tick is not None, watch or (lambda world: None))
    if again.world.in_period and not again.world.stopped:
        again.world.run_to(again.world.period_end)
    return again


def _sent_to_port(job: Job, options: ReplayOptions) -> Job:
    """Sends all that the job's hosts send to the robots at the port; the job of its recording. Raises BadInput."""
    from mirotwin.runs.at_port import send, sendable  # loads pyserial

    file = job.spec.origin
    options.compare.of_answers(file)  # refuses before anything is sent
    sent = sendable(job, options.desk, complain)
    name = Path(file).name
    stem = Path(file).absolute().parent.name if name.startswith("run.") else name.partition(".")[0]
    default = Path("runs") / f"{stem or 'stream'}-port"
    folder = OutputFolder(options.out or default, options.force, (RECORDING,), ours=options.out is None)
    with ProgressBar("sending", sent[-1].end_tick - sent[0].tick, options.quiet) as bar:
        send(sent, job, options.desk, folder, complain, bar.to)
    job = load_job(f"{folder.path / RECORDING}")
    complain(*job.notes)
    return job


def _compare_with_twin(job: Job, options: ReplayOptions) -> int:
    """Runs the twin with the bytes sent at the port, and compares the answers."""
    from mirotwin.runs.at_port import beside_twin

    compare, rule = options.compare, options.compare.of_answers(job.spec.origin)
    total_ticks = len(job.recorded) * CONTROL_PERIOD_TICKS
    with ProgressBar("running the twin", total_ticks, options.quiet or compare.as_json) as bar:
        answers = beside_twin(job, rule, bar.to)
    notes = [f"robot {slot} of the twin is not at the port: not compared" for slot in answers.silent]
    if answers.not_judged:
        notes.append(f"{answers.not_judged} values are not judged: they depend on times too near to a limit")
    difference = RunDifference(("robot", "twin"), answers.differences, notes=notes)
    count = sum(map(len, answers.robots.values()))
    code = exit_code("differs" if difference.differences else "passed" if count else "not observable")
    if options.shows:
        show(*difference_tables(difference, options.everything))
    complain(*difference.notes, *difference_lines(difference, "the robot differs from its twin"))
    if not count:
        complain("no robot was asked, or none answered: nothing could be compared")
    elif not difference.differences and not compare.as_json:
        known = f"times are known to {answers.unsure_ms:.1f} ms"
        show(f"the robot answers as its twin does, {amount(count, 'time')}; {known}")
    if compare.as_json:
        head = {
            "file": job.spec.origin,
            "seed": job.spec.seed,
            "source": job.origin,
            "silent": answers.silent,
        }
        head["not_judged"] = answers.not_judged
        print_json({**head, **difference.as_json(options.everything), "exit_code": code})
    return code
