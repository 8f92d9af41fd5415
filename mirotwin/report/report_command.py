"""`mirotwin report`: a run, a case, a failed test or two runs as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click
import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import read_input, replace_file
from miro_robot.image import Image
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import check_single
from mirotwin.recording.capture.options import CaptureOptions
from mirotwin.recording.compare import CompareRule, differences
from mirotwin.report.page.board_page import board_page
from mirotwin.report.page.bokeh_page import require_bokeh
from mirotwin.report.page.document import check_size, place_of_page, write_page
from mirotwin.report.page.frames import Extras, extras_of
from mirotwin.report.page.pair_page import Side, pair_page
from mirotwin.report.page.port_page import port_page
from mirotwin.report.page.run_page import Material, run_page
from mirotwin.report.page.watched_run import WatchedRun, run_again
from mirotwin.runs.board_summary import AnySummary, BoardSummary
from mirotwin.runs.job import Job, load_job
from mirotwin.runs.summary import Summary
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.debug_files import SourceFolders, checked_sources, source_folders
from mirotwin.shell.options import FIRMWARE, FORCE, FROM, NAME, OUT, QUIET, TO, Engine
from mirotwin.shell.outputs import RECORDING, RECORDINGS, file_in
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain
from mirotwin.shell.times import Time, window
from mirotwin.verify.cases.artifacts import CASES, PAGE, REPORT
from mirotwin.verify.cases.replay_line import replay_line
from mirotwin.verify.steps.reading import steps_of

SUMMARIES = ("summary.json", "summary.part.json")
PARQUET = b"PAR1"
SMALLER = "leave the camera's frames out with --no-frames, or look at a part with --from and --to"


class ReportOptions(Options, frozen=True, kw_only=True):
    COMMAND = "report"
    subject: Annotated[str, Argument("RUN|CASE|TEST-FAILURE", NAME)]
    other: Annotated[str | None, Argument("[OTHER-RUN]", NAME)] = None
    out: Annotated[
        Path | None, OUT.saying("The page to write. Default: report.html, which replaces an earlier page.")
    ] = None
    from_time: Annotated[Time | None, FROM] = None
    to_time: Annotated[Time | None, TO.saying("End there. Default: the end of the run.")] = None
    no_frames: Annotated[bool, Option(help="Leave out the camera's frames that a run has recorded.")] = False
    firmware: Annotated[
        str | None,
        FIRMWARE.saying(
            "Case, recording: image to run instead of its own; what it does otherwise is on the page."
        ),
    ] = None
    sources: SourceFolders = ()
    plugins: PluginFiles = PluginFiles()
    capture: CaptureOptions = CaptureOptions()
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET] = False
    engine: Engine = None

    def shown(self, job: Job) -> range:
        """Numbers of the control periods that are wanted."""
        scenario = job.spec.scenario
        from_tick, to_tick = window(self.from_time, self.to_time, scenario.clock)
        last = 1 << 62 if to_tick is None else -(-to_tick // scenario.period_ticks)
        return range(from_tick // scenario.period_ticks, last)


@command_of(ReportOptions)
def report(options: ReportOptions) -> int:
    """Writes one HTML file that needs no network: look at it in any browser, send it, keep it with a build.

    With RUN and OTHER-RUN, one page shows both, drawn over each other, and their first difference.

    RUN is a folder of `mirotwin run`, or a recording (run.mcap, run.part.mcap); CASE a case (FILE.stream) as `test`,
    `fuzz` and `conform` leave it; TEST-FAILURE the folder that a failed test of pytest or `mirotwin test` leaves.
    `mirotwin campaign page` makes the page of a campaign.

    The run is repeated for its page with the recorded bytes. The repetition gives the firmware's profile and coverage,
    the fate of each frame and the verdicts of the checks; differences from the recording are reported.
    """
    subject, other = options.subject, options.other
    if other is not None and (given := options.given("firmware", "sources", "no_frames")):
        raise click.UsageError(f"{given[0]} is for the page of one run.")
    place = place_of_page(options.out, options.force, subject, other, options.firmware)
    for file in filter(None, (subject, other)):
        if is_campaign(file):
            remedy = f"`mirotwin campaign page {file}` makes its page"
            raise BadInput(file, "", "holds the results of a campaign", remedy)
    checked_sources(options.sources)
    options.plugins.bring()
    made = (
        page_of(options) if other is None else pair_page(*(_side(options, file) for file in (subject, other)))
    )
    check_size(made, subject, SMALLER)
    return write_page(place, made, options.quiet)


def is_campaign(subject: str) -> bool:
    """True if it is a Parquet file, by its first bytes."""
    if not Path(subject).is_file():
        return False
    with open(subject, "rb") as file:
        return file.read(len(PARQUET)) == PARQUET


def page_of(wanted: ReportOptions, name: str = "") -> bytes:
    """The page, of the failed test `name`, else of a folder's name; of robots at a port, it shows them beside their
    twin. Raises BadInput, and OSError as `open` does.
    """
    file = _file_of(wanted.subject)
    job = load_job(file, wanted.firmware, capture=wanted.capture)
    if isinstance(job.spec.scenario, BoardScenario):
        check_single(job.spec.scenario, str(file), "a page")
    window(wanted.from_time, wanted.to_time, job.spec.scenario.clock)
    complain(*job.notes)
    if job.origin:
        return port_page(job, wanted.quiet)
    material = _of_recording(wanted, job) if job.recorded else _of_case(wanted, job, name)
    return board_page(material, *_ticks_of(wanted, material)) if job.alone else run_page(material)


def _side(wanted: ReportOptions, subject: str) -> Side:
    """One of two runs: from a recording, or made from a case or a stream file. Raises BadInput."""
    job = load_job(_file_of(subject), capture=wanted.capture)
    file = Path(job.spec.origin)
    if job.alone or job.origin:
        origin = "a board" if job.alone else "what was recorded at a port"
        raise BadInput(
            f"{file}", "", f"is of {origin}: two runs of robots have one page", "give one file for its page"
        )
    complain(*job.notes)
    shown = wanted.shown(job)
    periods = job.recorded or run_again(job, job.case.end_tick or None, wanted.quiet).periods
    periods = [period for period in periods if period.index in shown]
    if not periods:
        place = f"--from {wanted.from_time}"
        raise BadInput(f"{file}", place, f"the run ends at tick {job.end_tick}", "look earlier")
    name = file.absolute().parent.name if file.name in (*RECORDINGS, *CASES) else file.name
    return Side(name, job, periods)


def _ticks_of(wanted: ReportOptions, material: Material) -> tuple[int, int]:
    """The ticks of a board's run that are wanted and there. Raises BadInput."""
    from_tick, to_tick = window(wanted.from_time, wanted.to_time, material.job.spec.scenario.clock)
    from_tick = max(from_tick, material.periods[0].tick if material.periods else 0)
    end_tick = material.again.result.tick
    if from_tick >= end_tick:
        place, reason = f"--from {from_tick}t", f"the run ends at tick {end_tick}"
        raise BadInput(material.job.spec.origin, place, reason, "look earlier")
    return from_tick, min(end_tick, to_tick or end_tick)


def leave_page(folder: Path, name: str = "") -> None:
    """Writes the page of the files that the test `name` left in `folder`. Raises BadInput, also without Bokeh."""
    require_bokeh()
    replace_file(folder / PAGE, page_of(ReportOptions(subject=str(folder), quiet=True), name))


def _file_of(subject: str) -> str:
    """The file of a subject: for a folder, the recording or the case in it."""
    file = file_in(subject, (*RECORDINGS, *CASES))
    if not Path(file).is_dir():
        return file
    reason = f"holds neither {RECORDING} nor {CASES[0]}"
    raise BadInput(subject, "", reason, "give a run's folder, or that of one failed test")


def _of_recording(wanted: ReportOptions, job: Job) -> Material:
    file, image, shown = job.spec.origin, job.spec.image, wanted.shown(job)
    scenario = job.spec.scenario
    recorded = [period for period in job.recorded if period.index in shown]
    if not recorded:
        first, last = job.recorded[0].tick, (job.recorded[-1].index + 1) * scenario.period_ticks
        place = f"--from {window(wanted.from_time, wanted.to_time, scenario.clock)[0]}t"
        raise BadInput(file, place, f"the recording goes from tick {first} to {last}", "look within it")
    end_tick = (recorded[-1].index + 1) * scenario.period_ticks
    summary = _summary(Path(file), job.recorded[-1].digest, BoardSummary if job.alone else Summary)
    again = run_again(_by_steps(job, summary), end_tick, wanted.quiet)
    extras = extras_of(file, recorded[0].tick, end_tick, not wanted.no_frames)
    notes, replayed_run = [], "This page's own run of it"
    if extras.broken_off:
        count = amount(len(recorded), "control period")
        notes.append(f"This run was broken off: the page shows what it recorded, {count}.")
    if job.image is None or job.image.code != image.code:
        recorded = [period for period in again.periods if period.index in shown]
        extras = Extras(broken_off=extras.broken_off)  # frames and samples are of the recorded robot
        notes.append(_played_with(image, "recording", job.image))
        replayed_run = f"Another firmware ({image.path.name})"
    # the state of a controller is not computed again, so that digests of states say nothing here
    rule = CompareRule(to_tick=end_tick, clock=scenario.clock, period_ticks=scenario.period_ticks)
    changes = differences(job.recorded[: len(again.periods)], again.periods, rule)
    return Material(
        kind="run",
        job=job,
        again=again,
        periods=recorded,
        sources=source_folders(image, wanted.sources),
        command=_command(wanted, job),
        notes=notes,
        extras=extras,
        replayed=replayed_run,
        differences=[replace(change, clock=scenario.clock) for change in changes],
        steps=None if summary is None else summary.steps,
    )


def _of_case(wanted: ReportOptions, job: Job, name: str) -> Material:
    shown = wanted.shown(job)
    _, to_tick = window(wanted.from_time, wanted.to_time, job.spec.scenario.clock)
    ends = [tick for tick in (job.case.end_tick, to_tick) if tick]
    again = run_again(job, min(ends, default=None), wanted.quiet)
    report = Path(job.spec.origin).with_name(REPORT)
    text = read_input(report).decode("utf-8", "replace") if report.is_file() else ""
    return Material(
        kind="failed test" if text else "case" if job.case.verdict else job.captured_as or "stream file",
        job=job,
        again=again,
        periods=[period for period in again.periods if period.index in shown],
        sources=source_folders(job.spec.image, wanted.sources),
        command=_command(wanted, job),
        notes=[
            *([_played_with(job.spec.image, "case")] if job.case.changed else []),
            *_verdict_note(job, again),
        ],
        name=(name or Path(job.spec.origin).absolute().parent.name) if text else "",
        report=text,
        verdict="failed" if text and not again.result.failures else "",
    )


def _by_steps(job: Job, summary: AnySummary | None) -> Job:
    """The job of a board's run that was driven by its steps alone: by them again, so that the page has their times."""
    spec, driven = job.spec, summary is not None and summary.steps is not None and summary.live is None
    if not job.alone or not driven or spec.resumed or job.image is None or job.image.code != spec.image.code:
        return job
    return replace(job, spec=replace(spec, script=None, steps=steps_of(spec.scenario, spec.origin)))


def _command(wanted: ReportOptions, job: Job) -> str:
    return replay_line(Path(job.spec.origin).name, Path(wanted.firmware).name if wanted.firmware else None)


def _played_with(image: Image, kind: str, recorded: Image | None = None) -> str:
    """A note that the page shows another firmware than the recorded one."""
    own = f" ({recorded.sha256[:12]})" if recorded is not None and recorded.sha256 else ""
    return (
        f"Played with another firmware, {image.path.name} ({(image.sha256 or '')[:12]}), than the {kind}'s{own}."
        f" Pitch, figures and checks show what it did with the bytes of the {kind}."
    )


def _verdict_note(job: Job, again: WatchedRun) -> list[str]:
    """A note where the run no longer gives the case's verdict."""
    verdict = job.case.verdict
    if not verdict or verdict in map(str, again.result.failures):
        return []
    now = f"; now: {again.result.failures[0]}" if again.result.failures else " does not fail any more"
    return [f"What was recorded{now}. Recorded: {verdict}"]


def _summary(recording: Path, digest: str, kind: type[Summary] | type[BoardSummary]) -> AnySummary | None:
    """The summary beside the recording, if it is of the run with this digest and can be read; else None."""
    for name in SUMMARIES:
        path = recording.with_name(name)
        if path.is_file():
            try:
                summary = msgspec.json.decode(read_input(path), type=kind)
            except (msgspec.DecodeError, BadInput):
                continue
            if summary.digest == digest:
                return summary
    return None
