"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Annotated, Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.inputs import WORLD_BYTES, read_input
from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.world import World
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.subject import SubjectOptions, open_run
from mirotwin.runs.bare_case import load_case_firmware, rerun_bare_case
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.runs.job import Job
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.shell.command import Argument, command_of
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, debugged_image, load_images
from mirotwin.shell.options import AT, RESUME
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.times import Time
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.cases.case import is_bare_case
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.expectations import CHECK


class DebugSubject(SubjectOptions, frozen=True, kw_only=True):
    """What is debugged, from where on, and where its C files are."""

    subject: Annotated[str, Argument("[SUBJECT]", str)] = ""
    at: Annotated[Time | None, AT.saying("Stand there first: 1.5s, 20ms or 48000t.")] = None
    resume: Annotated[str | None, RESUME.saying("Scenario: begin with a saved world of it.")] = None
    check: Annotated[
        str | None, CHECK.saying("Case of a bare processor: FILE.py:FUNCTION, where its check is in a file.")
    ] = None
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()


def launched(given: Mapping[str, Any]) -> DebugSubject:
    """The options of an editor's launch configuration, as `{"subject": "fig6", "slot": 2}`. Raises BadInput.

    `linesFrom` is `--lines-from` there.
    """
    fields = [name for name in DebugSubject.__struct_fields__ if name not in ("bare", "subject", "check")]
    options = ["set" if name == "settings" else name.replace("_", "-") for name in fields]
    keys = {re.sub("-(.)", lambda found: found[1].upper(), option): option for option in options}
    words: list[str] = []
    for key, option in keys.items():
        values = given[key] if isinstance(given.get(key), list) else [given.get(key)]
        words += [word for value in values if value is not None for word in (f"--{option}", f"{value}")]
    command: Any = command_of(DebugSubject)(lambda options: options)  # type: ignore[arg-type, return-value]
    try:
        found: DebugSubject = command.main([*words, "--", given.get("subject") or ""], standalone_mode=False)
    except click.UsageError as error:
        raise BadInput("", "launch", error.format_message(), f"its keys are {', '.join(keys)}") from None
    return found


def open_subject(options: DebugSubject, everyone: bool = False) -> tuple[Debugger, list[str], str]:
    """A debugger at the start, at `--at`, or at the failed check of a case. Raises BadInput.

    With it what there is to know before anything is asked, and why it stands where it does.
    """
    subject = options.subject
    if not subject:
        raise BadInput("", "subject", "is missing", "name a scenario, an image, a recording or a case")
    if os.path.isdir(subject):
        subject = file_in(subject, (*RECORDINGS, *CASES))
        options = msgspec.structs.replace(options, subject=subject)
    run, verdict = _opened(options)
    if options.resume is not None:
        _resume(run, options.resume)
    images = load_images(options.lines_from, run.image)
    symbols = Symbols(*debugged_image(run.image, images, options.sources))
    image, files = symbols.image, {line.file for line in symbols.line_begins.values()}
    timeline = Timeline(run)
    debugger, said, why = Debugger(timeline, symbols, everyone), list[str](), "begin"
    if not image.symbols.names:
        said.append(f"no symbols: no .map or .cdb beside {image.path.name}; places are addresses")
    elif files and not any(map(symbols.sources.path, files)):
        said.append("no C files: --sources names their folder")
    with timeline.shown(f"opening {subject}"):
        if run.job is not None and run.job.case.verdict:
            verdict = _judged(timeline, run.world, run.job)
        if verdict is not None:
            why = "case"
            said += verdict.texts
            if verdict.failures:
                _stand_at(timeline, verdict.failures[0], options.slot)
        if options.at is not None:
            why = debugger.go_to(options.at.ticks(run.tick_hz))
    return debugger, said, why


def _opened(options: DebugSubject) -> tuple[InspectedRun, Result | None]:
    """The run, and the verdict on a case of a bare processor."""
    path = options.subject
    if is_bare_case(path):
        image = load_case_firmware(path, options.firmware)
        again, verdict = rerun_bare_case(path, image, options.check)
        end_tick = again.end_tick if again.failure is None else max(again.end_tick, again.failure.tick)
        board = BoardSpec(crystal_hz=again.line.crystal_hz, bound_stack=False)
        scenario = BoardScenario(board=board, bit_ticks=again.line.bit_ticks)
        return InspectedRun(World(scenario, 0, image, again.script), end_tick=end_tick), verdict
    if options.check is not None:
        raise BadInput(path, "--check", "is for a case of a bare processor", "leave it out")
    return open_run(options), None


def _judged(timeline: Timeline, world: World, job: Job) -> Result:
    """What the check of a case says this time."""
    job.check_case()
    run = Run(job.spec, world)
    end_tick = job.case.end_tick or world.periods * CONTROL_PERIOD_TICKS
    timeline.go_to(end_tick, timeline.interrupted)
    run.finish()
    return job.result_of_case(run)


def _stand_at(timeline: Timeline, failure: Failure, slot: int | None) -> None:
    place = (failure.network, failure.slot if slot is None else slot)
    for at, core in enumerate(timeline.cores):
        if core.robot is not None and (core.robot.network, core.robot.slot) == place:
            timeline.focus = at
    timeline.go_to(failure.tick)


def _resume(run: InspectedRun, path: str) -> None:
    saved = read_input(path, WORLD_BYTES)
    try:
        run.world.load(saved)
    except ValueError as error:
        remedy = "give the scenario, settings, seed and firmware it was saved with"
        raise BadInput(path, "--resume", str(error), remedy) from None
