"""The subject of a debug session: SUBJECT and the options of its run, opened as a timeline with symbols."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import WORLD_BYTES, read_input
from miro_robot.firmware import image_path
from miro_sim.scenario.board_scenario import BoardText, is_board, load_any
from mirotwin.debug.board_values import names_on
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.firmware.subject import SubjectOptions, open_run
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.runs.job import Job
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Argument, command_of
from mirotwin.shell.debug_files import LinesFrom, SourceFolders, debugged_image, load_images
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.options import AT, RESUME, plain_parameters
from mirotwin.shell.outputs import RECORDINGS, file_in
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.steps.reading import steps_in


class DebugSubject(SubjectOptions, frozen=True, kw_only=True):
    """The subject, the start of the session, and the folder of its C files."""

    subject: Annotated[str, Argument("[SUBJECT]", str)] = ""
    at: Annotated[Time | None, AT.saying("Stand there first: 1.5s, 20ms or 48000t.")] = None
    resume: Annotated[str | None, RESUME.saying("Scenario: begin with a saved world of it.")] = None
    lines_from: LinesFrom = ()
    sources: SourceFolders = ()


_SAME_TIME_S = 2.0
"""Files of one checkout are written within it, in any order."""
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


def open_subject(
    options: DebugSubject, everyone: bool = False, interrupted: Callable[[], bool] = lambda: False
) -> tuple[Debugger, list[str], str]:
    """A debugger at the start, at `--at`, or at the failed check of a case. Raises BadInput.

    `interrupted` is called between two pieces of a run; true ends it where it is. Also returns notes to print first,
    and the reason why it stands at this place.
    """
    subject = options.subject
    if not subject:
        raise BadInput("", "subject", "is missing", "name a scenario, an image, a recording or a case")
    if os.path.isdir(subject):
        subject = _file_below(subject)
        options = msgspec.structs.replace(options, subject=subject)
    verdict = None
    run, failed, step_tick = _open_steps(options) or (open_run(options), [], -1)
    if options.resume is not None:
        _resume(run, options.resume)
    images = load_images(options.lines_from, run.image)
    symbols = Symbols(*debugged_image(run.image, images, options.sources), names_on(run.device.board))
    image, files = symbols.image, {line.file for line in symbols.line_begins.values()}
    timeline = Timeline(run)
    debugger, notes, why = Debugger(timeline, symbols, everyone), failed, "begin"
    if newer := _newer_sources(symbols):
        notes.append(f"newer than {image.path.name}: {', '.join(newer)}; lines may not fit, build it again")
    if not image.symbols.names:
        notes.append(f"no symbols: no .map, .cdb or .M51 beside {image.path.name}; places are addresses")
    elif files and not any(map(symbols.sources.path, files)):
        notes.append("no C files: --sources names their folder")
    with timeline.shown(f"opening {subject}", interrupted):
        if run.job is not None and not run.job.recorded and (run.job.case.verdict or run.job.alone):
            verdict = _judged(timeline, run, run.job)
        if verdict is not None:
            why = "case"
            notes += verdict.texts
            if verdict.failures:
                _stand_at(timeline, verdict.failures[0], options.slot)
        if step_tick >= 0 and (verdict is None or not verdict.failures):
            why = "case"
            timeline.go_to(step_tick)
        if options.at is not None:
            why = debugger.go_to(options.at.ticks(run.tick_hz))
    return debugger, notes, why


def _file_below(folder: str) -> str:
    """The file to debug in a folder: a recording, a case, or the only case in a folder below it."""
    path = file_in(folder, (*RECORDINGS, *CASES))
    if path != folder:
        return path
    streams = sorted(str(each) for each in Path(folder).glob("*.stream"))
    streams += sorted(str(each) for name in CASES for each in Path(folder).glob(f"*/{name}"))
    if len(streams) > 1:
        raise BadInput(folder, "", f"holds {len(streams)} cases", f"name one: {', '.join(streams[:4])}, ..")
    return streams[0] if streams else folder


def _open_steps(options: DebugSubject) -> tuple[InspectedRun, list[str], int] | None:
    """The case of a scenario with a failed step, the failure, and its tick; the tick is -1 if all steps passed.

    None for any other subject. For robots a case is returned also if all steps pass: nothing else can repeat the steps'
    input.
    """
    if not options.subject.endswith(".toml") or is_board(options.subject) or options.resume is not None:
        return None
    options.plugins.bring()
    text = load_any(options.subject, (*options.plugins.settings(options.settings), *options.settings))
    if not text.scenario.step or options.expected:
        return None
    image = image_for(text, options.firmware)
    spec = RunSpec.of(text, image, options.seed or 0)
    run = Run.traced(msgspec.structs.replace(spec, expected=expectations_in(text), steps=steps_in(text)))
    assert run.player is not None
    with plain_parameters(options.subject), ProgressBar("doing its steps", None):
        run.player.play()
        case = run.case_of_step()
        run.drive(move=run.player.finish)
        run.finish()
    result = run.result()
    failed = result.lines
    if not failed and isinstance(text, BoardText):
        return None  # a script of them is run
    case = case or (run.case() if run.failures else run.stream())
    with TemporaryDirectory() as folder:
        path = os.path.join(folder, CASES[0])
        with open(path, "w", encoding="utf-8") as file:
            file.write(case)
        given = msgspec.structs.replace(
            options, subject=path, firmware=str(image.path), seed=None, settings=()
        )
        return open_run(given), [*failed], result.step_tick


def _newer_sources(symbols: Symbols) -> list[str]:
    """C files that were written after the image. The robot's own are installed together."""
    image = symbols.image.path
    if not image.is_file() or image.resolve() == image_path().resolve():
        return []
    files = {line.file for line in symbols.line_begins.values()}
    paths = [path for file in files if (path := symbols.sources.path(file)) is not None]
    built_s = image.stat().st_mtime + _SAME_TIME_S
    return sorted(path.name for path in paths if path.stat().st_mtime > built_s)


def _judged(timeline: Timeline, run: InspectedRun, job: Job) -> Result:
    """The result of the case's check in this run."""
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
