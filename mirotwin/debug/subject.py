"""What is debugged: SUBJECT and the options that say how it runs, opened as a timeline with its symbols."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Annotated, Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import WORLD_BYTES, read_input
from mirotwin.debug.board_values import names_on
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.subject import SubjectOptions, open_run
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
from mirotwin.verify.checks.interface import Failure


class DebugSubject(SubjectOptions, frozen=True, kw_only=True):
    """What is debugged, from where on, and where its C files are."""

    subject: Annotated[str, Argument("[SUBJECT]", str)] = ""
    at: Annotated[Time | None, AT.saying("Stand there first: 1.5s, 20ms or 48000t.")] = None
    resume: Annotated[str | None, RESUME.saying("Scenario: begin with a saved world of it.")] = None
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()


_NAMES = {"settings": "set"}
"""Options that are called otherwise than their fields."""


def launched(given: Mapping[str, Any]) -> DebugSubject:
    """The options of an editor's launch configuration, as `{"subject": "fig6", "slot": 2}`. Raises BadInput.

    `linesFrom` is `--lines-from` there.
    """
    left_out = ("bare", "subject", "expected", "plugins")
    fields = [name for name in DebugSubject.__struct_fields__ if name not in left_out]
    options = ["part", *(_NAMES.get(name, name.replace("_", "-")) for name in fields)]
    keys = {re.sub("-(.)", lambda match: match[1].upper(), option): option for option in options}
    words: list[str] = []
    for key, option in keys.items():
        values = given[key] if isinstance(given.get(key), list) else [given.get(key)]
        words += [word for value in values if value is not None for word in (f"--{option}", f"{value}")]
    command: Any = command_of(DebugSubject)(lambda options: options)  # type: ignore[arg-type, return-value]
    try:
        subject: DebugSubject = command.main(
            [*words, "--", given.get("subject") or ""], standalone_mode=False
        )
    except click.UsageError as error:
        raise BadInput("", "launch", error.format_message(), f"its keys are {', '.join(keys)}") from None
    return subject


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
    run, verdict = open_run(options), None
    if options.resume is not None:
        _resume(run, options.resume)
    images = load_images(options.lines_from, run.image)
    symbols = Symbols(*debugged_image(run.image, images, options.sources), names_on(run.device.board))
    image, files = symbols.image, {line.file for line in symbols.line_begins.values()}
    timeline = Timeline(run)
    debugger, notes, why = Debugger(timeline, symbols, everyone), list[str](), "begin"
    if not image.symbols.names:
        notes.append(f"no symbols: no .map, .cdb or .M51 beside {image.path.name}; places are addresses")
    elif files and not any(map(symbols.sources.path, files)):
        notes.append("no C files: --sources names their folder")
    with timeline.shown(f"opening {subject}"):
        if run.job is not None and not run.job.recorded and (run.job.case.verdict or run.job.alone):
            verdict = _judged(timeline, run, run.job)
        if verdict is not None:
            why = "case"
            notes += verdict.texts
            if verdict.failures:
                _stand_at(timeline, verdict.failures[0], options.slot)
        if options.at is not None:
            why = debugger.go_to(options.at.ticks(run.tick_hz))
    return debugger, notes, why


def _judged(timeline: Timeline, run: InspectedRun, job: Job) -> Result:
    """What the check of a case says this time."""
    if job.alone:  # its checks look at moments of their own, at which the timeline does not stop
        result = job.judge_case()
        ends = (run.end_tick or 0, *(failure.tick for failure in result.failures))
        run.end_tick = max(ends)
        return result
    job.check_case()
    again = Run(job.spec, run.world)
    timeline.go_to(job.case.end_tick or run.world.scenario.end_tick, timeline.interrupted)
    again.finish()
    return job.result_of_case(again)


def _stand_at(timeline: Timeline, failure: Failure, slot: int | None) -> None:
    place = (failure.network, failure.slot if slot is None else slot)
    for index, core in enumerate(timeline.cores):
        if core.robot is not None and (core.robot.network, core.robot.slot) == place:
            timeline.focus = index
    timeline.go_to(failure.tick)


def _resume(run: InspectedRun, path: str) -> None:
    saved = read_input(path, WORLD_BYTES)
    try:
        run.world.load(saved)
    except ValueError as error:
        remedy = "give the scenario, settings, seed and firmware it was saved with"
        raise BadInput(path, "--resume", str(error), remedy) from None
