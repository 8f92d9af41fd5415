"""What `mirotwin report` is given: a run, a case or a failed test, and all that its page is made from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import tomli_w

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.inputs import read_input
from miro_robot.image import Image
from mirotwin.recording.compare import CompareRule, differences
from mirotwin.report.page.bokeh_page import require_bokeh
from mirotwin.report.page.frames import Extras, extras_of
from mirotwin.report.page.port_page import port_page
from mirotwin.report.page.reproduction import Reproduction, reproduce
from mirotwin.report.page.run_page import Material, PageHeader, Replayed, run_page
from mirotwin.report.summary import Summary
from mirotwin.rerun.job import Job, load_job, replaying
from mirotwin.shell.debug_files import source_folders
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.outputs import RECORDING, RECORDINGS, file_in
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.cases.artifacts import CASES, REPORT
from mirotwin.verify.cases.case import is_bare_case, tables_of
from mirotwin.verify.cases.replay_line import replay_line
from mirotwin.verify.checks.expect import expectations_of

SUMMARIES = ("summary.json", "summary.part.json")
PARQUET = b"PAR1"


class PageSubject(msgspec.Struct, frozen=True):
    """What the page is about. `to_tick` None: to the end."""

    subject: str
    from_tick: int
    to_tick: int | None
    frames: bool
    firmware: str | None
    sources: Sequence[str]
    quiet: bool

    @property
    def shown(self) -> range:
        """Numbers of the control periods that are wanted."""
        last = 1 << 62 if self.to_tick is None else -(-self.to_tick // CONTROL_PERIOD_TICKS)
        return range(self.from_tick // CONTROL_PERIOD_TICKS, last)


def is_campaign(subject: str) -> bool:
    """Whether it is a Parquet file, by its first bytes."""
    if not Path(subject).is_file():
        return False
    with open(subject, "rb") as file:
        return file.read(len(PARQUET)) == PARQUET


def page_of(wanted: PageSubject) -> bytes:
    """The page; of robots at a port, it shows them beside their twin. Raises BadInput, and OSError as `open` does."""
    if wanted.to_tick is not None and wanted.to_tick <= wanted.from_tick:
        place = f"--from {wanted.from_tick}t --to {wanted.to_tick}t"
        raise BadInput("", place, "the window is empty", "--to must be later")
    file = _file_of(wanted.subject)
    if is_bare_case(file):
        what = "is a case of a bare processor, which has no robot to show"
        raise BadInput(file, "", what, "`mirotwin replay` says what it comes to")
    job = load_job(file, wanted.firmware)
    if job.origin:
        return port_page(job, wanted.quiet)
    return run_page(_of_recording(wanted, job) if job.recorded else _of_case(wanted, job))


def page_of_failure(folder: str) -> bytes:
    """The page of what a failure left in `folder`. Raises BadInput, also where the library of pages is missing."""
    require_bokeh()
    return page_of(PageSubject(folder, 0, None, True, None, (), True))


def _file_of(subject: str) -> str:
    """The file that is meant: of a folder, the recording or the case in it."""
    file = file_in(subject, (*RECORDINGS, *CASES))
    if not Path(file).is_dir():
        return file
    what = f"holds neither {RECORDING} nor {CASES[0]}"
    raise BadInput(subject, "", what, "give a run's folder, or that of one failed test")


def _reproduced(wanted: PageSubject, job: Job, until_tick: int | None) -> Reproduction:
    with plain_parameters(job.file, "replayed"):
        world = job.world_of()
    total = until_tick or job.scenario.end_tick
    with ProgressBar("running it again", total, wanted.quiet) as bar, replaying(job.file, world):
        return reproduce(world, until_tick, expectations_of(job.scenario, job.file), bar.to)


def _of_recording(wanted: PageSubject, job: Job) -> Material:
    file, image = job.file, job.runs_on
    recorded = [period for period in job.recorded if period.index in wanted.shown]
    if not recorded:
        first, last = job.recorded[0].tick, (job.recorded[-1].index + 1) * CONTROL_PERIOD_TICKS
        place = f"--from {wanted.from_tick}t"
        raise BadInput(file, place, f"the recording goes from tick {first} to {last}", "look within it")
    end_tick = (recorded[-1].index + 1) * CONTROL_PERIOD_TICKS
    again = _reproduced(wanted, job, end_tick)
    other = job.image is None or job.image.code != image.code
    extras = extras_of(file, recorded[0].tick, end_tick, wanted.frames)
    summary = _summary(Path(file), job.recorded[-1].digest)
    notes = []
    if extras.broken_off:
        notes.append(
            f"This run was broken off: the page shows {amount(len(recorded), 'control period')} that it recorded."
        )
    if other:
        recorded = [period for period in again.periods if period.index in wanted.shown]
        extras = Extras(broken_off=extras.broken_off)  # frames and samples are of the recorded robot
        notes.append(_played_with(image, "recording", job.image))
    what = f"Another firmware ({image.path.name})" if other else "This page's own run of it"
    # the state of a controller is not computed again, so that digests of states say nothing here
    found = differences(job.recorded[: len(again.periods)], again.periods, CompareRule(to_tick=end_tick))
    return Material(
        about=_about("run", wanted, job, notes),
        scenario=job.scenario,
        scenario_text=tomli_w.dumps(tables_of(job.scenario)),
        periods=recorded,
        again=again,
        sources=source_folders(image, wanted.sources),
        extras=extras,
        replayed=Replayed(what, found),
        steps=None if summary is None else summary.steps,
        broken_off=extras.broken_off,
    )


def _of_case(wanted: PageSubject, job: Job) -> Material:
    file, image = job.file, job.runs_on
    ends = [tick for tick in (job.case.end_tick, wanted.to_tick) if tick]
    again = _reproduced(wanted, job, min(ends, default=None))
    report = Path(file).with_name(REPORT)
    text = read_input(report).decode("utf-8", "replace") if report.is_file() else ""
    notes = [*([_played_with(image, "case")] if job.case.changed else []), *_said(job, again)]
    about = _about("failed test" if text else "case", wanted, job, notes)
    return Material(
        about=msgspec.structs.replace(
            about,
            report=text,
            name=Path(file).absolute().parent.name if text else "",
            verdict="failed" if text and not again.failures else "",
        ),
        scenario=job.scenario,
        scenario_text=tomli_w.dumps(tables_of(job.scenario)),
        periods=again.periods,
        again=again,
        sources=source_folders(image, wanted.sources),
        shown=wanted.shown,
    )


def _played_with(image: Image, kind: str, recorded: Image | None = None) -> str:
    """That the page is of another firmware than what was recorded."""
    own = f" ({recorded.sha256[:12]})" if recorded is not None and recorded.sha256 else ""
    return (
        f"Played with another firmware, {image.path.name} ({(image.sha256 or '')[:12]}), than the {kind}'s{own}."
        f" Pitch, figures and checks show what it did with the bytes of the {kind}."
    )


def _said(job: Job, again: Reproduction) -> list[str]:
    """What became of a case's verdict."""
    verdict = job.case.verdict
    if not verdict or verdict in map(str, again.failures):
        return []
    now = f"; now: {again.failures[0]}" if again.failures else " does not fail any more"
    return [f"What was recorded{now}. Recorded: {verdict}"]


def _about(kind: str, wanted: PageSubject, job: Job, notes: Sequence[str]) -> PageHeader:
    name = Path(job.file).name
    return PageHeader(
        kind=kind,
        file=name,
        seed=job.seed,
        firmware=job.runs_on.path.name,
        firmware_sha256=job.runs_on.sha256 or "",
        notes=notes,
        again=(replay_line(name, Path(wanted.firmware).name if wanted.firmware else None),),
    )


def _summary(recording: Path, digest: str) -> Summary | None:
    """That of the same run, which stands beside its recording; None where there is none that can be read."""
    for name in SUMMARIES:
        path = recording.with_name(name)
        if path.is_file():
            try:
                found = msgspec.json.decode(read_input(path), type=Summary)
            except (msgspec.DecodeError, BadInput):
                continue
            if found.digest == digest:
                return found
    return None
