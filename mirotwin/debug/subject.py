"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Annotated, Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.inputs import read_input
from miro_robot.image import Image
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.coverage_files import SourceFolders, checked_sources
from mirotwin.firmware.subject import IMAGE_SUFFIXES, SubjectOptions, open_run
from mirotwin.replay.firmwares import LinesFrom, debugged_image, load_images
from mirotwin.rerun.inspected_run import BareRun, RobotRun
from mirotwin.rerun.job import Job, load_job
from mirotwin.shell.command import Argument, command_of
from mirotwin.shell.options import AT, RESUME, choose_engine
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.times import Time
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


class Session(msgspec.Struct):
    """`said`: what there is to know before anything is asked; `why`: why it stands where it does."""

    debugger: Debugger
    said: list[str]
    why: str


def launched(given: Mapping[str, Any]) -> DebugSubject:
    """The options of an editor's launch configuration, as `{"subject": "fig6", "slot": 2}`. Raises BadInput."""
    words: list[str] = []
    names = {_key(name): name for name in DebugSubject.__struct_fields__ if name not in ("bare", "subject")}
    for key in names.keys() & {key for key, value in given.items() if value is not None}:
        option = f"--{'set' if key == 'set' else names[key].replace('_', '-')}"
        values = given[key] if isinstance(given[key], list) else [given[key]]
        words += [word for value in values for word in (option, f"{value}")]
    command: Any = command_of(DebugSubject)(lambda options: options)  # type: ignore[arg-type, return-value]
    try:
        found: DebugSubject = command.main([*words, "--", given.get("subject") or ""], standalone_mode=False)
    except click.UsageError as error:
        raise BadInput("", "launch", error.format_message(), f"its keys are {', '.join(names)}") from None
    return found


def _key(name: str) -> str:
    """`lines_from` as configurations write it: `linesFrom`; `settings` is `set`."""
    first, *others = ("set" if name == "settings" else name).split("_")
    return first + "".join(one.capitalize() for one in others)


def open_subject(options: DebugSubject, everyone: bool = False) -> Session:
    """Stands at the start, at `--at`, or at the failed check of a case. Raises BadInput."""
    subject = options.subject
    if not subject:
        raise BadInput("", "subject", "is missing", "name a scenario, an image, a recording or a case")
    if os.path.isdir(subject):
        subject = file_in(subject, (*RECORDINGS, *CASES))
        options = msgspec.structs.replace(options, subject=subject)
    case = _case(options)
    run = open_run(options) if case is None else _run_of(*case, options)
    assert isinstance(run, RobotRun | BareRun)
    if options.resume is not None:
        _resume(run, options.resume)
    image, folders = debugged_image(
        run.image, load_images(options.lines_from, run.image), checked_sources(options.sources)
    )
    symbols = Symbols(image, folders)
    timeline = Timeline(run)
    session = Session(Debugger(timeline, symbols, everyone), [], "begin")
    if not image.symbols.names:
        session.said.append(f"no symbols: no .map or .cdb beside {image.path.name}; places are addresses")
    if case is not None:
        session.why = "case"
        verdict, failure = _judge(case[0], timeline, subject)
        session.said.append(verdict)
        if failure is not None:
            _stand_at(timeline, failure, options.slot)
    if options.at is not None:
        session.why = "goto"
        timeline.go_to(options.at.ticks(run.tick_hz))
    return session


def _case(options: DebugSubject) -> tuple[Job, Image] | None:
    """The job and the image of a case; None for what is not one."""
    path = options.subject
    if not os.path.isfile(path) or path.lower().endswith((*IMAGE_SUFFIXES, ".toml")):
        return None
    with open(path, "rb") as file:
        if file.read(1) != b"#":
            return None
    choose_engine(options.engine)
    job, image = load_job(path, options.firmware, options.engine, options.settings)
    return (job, image) if job.case.verdict else None


def _run_of(job: Job, image: Image, options: DebugSubject) -> RobotRun:
    run = RobotRun(job.world(image), options.network or 0)
    if options.slot is None:
        return run
    slots = [robot.slot for robot in run.world.networks[run.network].robots]
    return RobotRun(run.world, run.network, slots.index(options.slot))


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


def _stand_at(timeline: Timeline, failure: Failure, slot: int | None) -> None:
    place = (failure.network, failure.slot if slot is None else slot)
    places = [(robot.network, robot.slot) for robot in timeline.robots]
    timeline.focus = places.index(place) if place in places else timeline.focus
    timeline.go_to(failure.tick)


def _resume(run: RobotRun | BareRun, path: str) -> None:
    if not isinstance(run, RobotRun):
        raise BadInput(path, "--resume", "is a world, and SUBJECT is none", "leave it out")
    try:
        run.world.load(read_input(path))
    except ValueError as error:
        remedy = "give the scenario, settings, seed and firmware it was saved with"
        raise BadInput(path, "--resume", str(error), remedy) from None
