"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.inputs import read_input
from miro_robot.firmware import source_folder
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.coverage_files import SourceFolders, checked_sources, with_debug_files
from mirotwin.firmware.subject import IMAGE_SUFFIXES, SubjectOptions, open_run
from mirotwin.replay.firmwares import LinesFrom, load_images
from mirotwin.rerun.inspected_run import BareRun, RobotRun
from mirotwin.rerun.job import Job, load_job
from mirotwin.shell.command import Argument
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import AT, RESUME, choose_engine
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.times import Time, TimeType
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks


class DebugSubject(SubjectOptions, frozen=True, kw_only=True):
    """What is debugged, from where on, and where its C files are."""

    subject: Annotated[str, Argument("[SUBJECT]", str)] = ""
    at: Annotated[Time | None, AT.saying("Stand there first: 1.5s, 20ms or 48000t.")] = None
    resume: Annotated[str | None, RESUME.saying("Scenario: begin with a saved world of it.")] = None
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()


class Session(NamedTuple):
    """`said`: what there is to know before anything is asked; `why`: why it stands where it does."""

    timeline: Timeline
    symbols: Symbols
    said: list[str]
    why: str


def launched(options: DebugSubject, given: dict[str, Any]) -> DebugSubject:
    """The options with what an editor's launch configuration says: their names, `at` as text. Raises BadInput."""
    known = {_key(name): name for name in DebugSubject.__struct_fields__ if name != "bare"}
    found = {known[key]: value for key, value in given.items() if key in known and value is not None}
    try:
        if "at" in found:
            found["at"] = TimeType().convert(found["at"], None, None)
        types = {one.name: one.type for one in msgspec.structs.fields(DebugSubject)}
        found = {
            name: value if name == "at" else msgspec.convert(value, types[name])
            for name, value in found.items()
        }
    except click.UsageError as error:
        raise BadInput("", "launch", error.message) from None
    except msgspec.ValidationError as error:
        raise BadInput("", "launch", str(error), f"its keys are {', '.join(known)}") from None
    return msgspec.structs.replace(options, **found)


def _key(name: str) -> str:
    """`lines_from` as configurations write it: `linesFrom`; `settings` is `set`."""
    first, *others = ("set" if name == "settings" else name).split("_")
    return first + "".join(one.capitalize() for one in others)


def open_subject(options: DebugSubject) -> Session:
    """Raises BadInput."""
    if not options.subject:
        raise BadInput("", "subject", "is missing", "name a scenario, an image, a recording or a case")
    subject = (
        file_in(options.subject, (*RECORDINGS, *CASES)) if os.path.isdir(options.subject) else options.subject
    )
    options = msgspec.structs.replace(options, subject=subject)
    case = _case(options)
    run = open_run(options) if case is None else _run_of(*case, options)
    assert isinstance(run, RobotRun | BareRun)
    if options.resume is not None:
        _resume(run, options.resume)
    known = next(iter(load_images(options.lines_from, run.image)), None) or with_debug_files(run.image)
    folder = source_folder()
    own = [folder] if folder is not None and load_firmware(named=False).sha256 == run.image.sha256 else []
    symbols = Symbols(known, [*map(Path, checked_sources(options.sources)), *own])
    said = [] if symbols.image.symbols.names else [_nameless(known.path)]
    timeline = Timeline(run)
    why = "begin"
    if case is not None:
        verdict, failure = _judge(case[0], timeline, subject)
        said, why = [*said, verdict], "case"
        if failure is not None:
            slot = failure.slot if options.slot is None else options.slot
            timeline.focus = timeline.find_core(failure.network, slot)
            timeline.go_to(failure.tick)
    if options.at is not None:
        why = "goto"
        timeline.go_to(options.at.ticks(run.tick_hz))
    return Session(timeline, symbols, said, why)


def _nameless(path: Path) -> str:
    return f"no symbols: no .map or .cdb beside {path.name}; places are addresses"


def _case(options: DebugSubject) -> tuple[Job, Any] | None:
    """The job and the image of a case; None for what is not one."""
    path = options.subject or ""
    if not os.path.isfile(path) or path.lower().endswith((*IMAGE_SUFFIXES, ".toml")):
        return None
    with open(path, "rb") as file:
        if file.read(1) != b"#":
            return None
    choose_engine(options.engine)
    job, image = load_job(path, options.firmware, options.engine, options.settings)
    return (job, image) if job.case.verdict else None


def _run_of(job: Job, image: Any, options: DebugSubject) -> RobotRun:
    world = job.world(image)
    network, slot = options.network or 0, options.slot
    if slot is None:
        return RobotRun(world, network)
    slots = [robot.slot for robot in world.networks[network].robots]
    return RobotRun(world, network, slots.index(slot))


def _judge(job: Job, timeline: Timeline, path: str) -> tuple[str, Failure | None]:
    """What the check of a case says this time, and its failure."""
    assert isinstance(timeline.run, RobotRun)
    world = timeline.run.world
    checks = Checks(world, expectations_of(job.scenario, path))
    timeline.find({}, job.case.end_tick or world.periods * CONTROL_PERIOD_TICKS)
    checks.finish()
    again = [one for one in checks.failures if str(one) == job.case.verdict]
    failures = again or checks.failures
    if not failures:
        return f"does not fail; recorded: {job.case.verdict}", None
    how = "fails as recorded" if again else "fails, but not as recorded"
    return f"{how}: {failures[0]}", failures[0]


def _resume(run: RobotRun | BareRun, path: str) -> None:
    if not isinstance(run, RobotRun):
        raise BadInput(path, "--resume", "is a world, and SUBJECT is none", "leave it out")
    try:
        run.world.load(read_input(path))
    except ValueError as error:
        raise BadInput(
            path, "--resume", str(error), "give the scenario, settings, seed and firmware it was saved with"
        ) from None
