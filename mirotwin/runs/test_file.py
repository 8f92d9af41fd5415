"""Runs one scenario file to its verdict: its steps, its expectations, and the checks of every run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from msgspec.structs import replace

from miro_exact.bad_input import BadInput, encodable
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_robot.image import Image
from miro_sim.scenario.board_scenario import AnyText, BoardText, load_any
from miro_sim.world.machine import NotObservable
from mirotwin.desk.guard import DeskOptions
from mirotwin.runs.failure_place import located
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import image_for
from mirotwin.verify.cases.artifacts import (
    CASE,
    FIRMWARE,
    case_lines,
    clear,
    leave,
    nothing_left,
    report_line,
    stream_files,
)
from mirotwin.verify.cases.case import SUFFIX as CASE_SUFFIX
from mirotwin.verify.cases.case import is_case
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.steps.reading import steps_in

SCENARIO = "scenario.toml"
"""The whole scenario with all that was set, in the folder of a file that failed."""


def run_test(
    path: str,
    firmware: Image | str | None = None,
    seed: int = 0,
    settings: Sequence[str] = (),
    artifacts: Path | None = None,
    again: Callable[[bool], str] = lambda saves: "",
    desk: DeskOptions | None = None,
) -> Result:
    """Runs a file to its verdict; an error is a result, too.

    `firmware`: an image, or its path; default: the one that a board's scenario names, or the robot's own. `artifacts`:
    parent of the folder for files of `save` steps and, after a failure, for the case; needed for a file with `save`
    steps. `again(saves)`: returns the command that repeats the verdict; `saves`: the file has `save` steps. `desk`: the
    port of the robots that are tested, if not their twin.
    """
    folder = None if artifacts is None else folder_of(artifacts, path)
    if folder is not None:
        with suppress(OSError, BadInput):  # who leaves something there says why nothing can be left
            clear(folder, SCENARIO)
    try:
        return _run(path, firmware, seed, settings, folder, again, desk)
    except NotObservable as error:
        return Result(
            path=path, verdict="not observable", verdict_lines=[("not observable", f"{error}")], seed=seed
        )
    except (DomainError, PluginError, OSError) as error:
        return cannot_be_run(path, BadInput(path, "", f"cannot be run: {error}"), seed, error)
    except BadInput as error:
        return cannot_be_run(path, error, seed)


def cannot_be_run(path: str, bad: BadInput, seed: int = 0, error: Exception | None = None) -> Result:
    return Result(
        path=path, verdict="error", verdict_lines=[("error", f"{bad}")], seed=seed, error=error or bad
    )


def _run(
    path: str,
    firmware: Image | str | None,
    seed: int,
    settings: Sequence[str],
    folder: Path | None,
    again: Callable[[bool], str],
    desk: DeskOptions | None,
) -> Result:
    text = load_any(path, settings)
    expected, steps = expectations_in(text), steps_in(text)
    image = firmware if isinstance(firmware, Image) else image_for(text, firmware)
    if desk is not None and desk.port:
        if isinstance(text, BoardText):
            raise BadInput(path, "--port", "is for robots, and this scenario is for a board", "leave it out")
        from mirotwin.runs.at_port import play_at_port  # loads pyserial

        return replace(play_at_port(text, steps, image, desk, folder), again=again(False))
    saving = [step for step in steps if step.VERB == "save"]
    if saving and folder is None:
        raise BadInput(
            path, f"step {saving[0].number}", "there is no folder to save into", "give --artifacts DIR"
        )
    spec = replace(RunSpec.of(text, image, seed), expected=expected, steps=steps)
    run = Run.traced(spec)
    case = None
    if run.player is not None:
        run.player.play()
        case = None if folder is None else run.case_of_step()
    run.drive(move=run.player.finish if run.player else None)
    run.finish()
    result = replace(located(run, run.result()), left_out=text.notes, again=again(bool(saving)))
    return result if folder is None else _with_artifacts(run, case, result, folder, text)


def _with_artifacts(run: Run, case: str | None, result: Result, folder: Path, text: AnyText) -> Result:
    """The states of the `save` steps, and the case if it failed, are in the folder now."""
    failed = bool(result.lines)
    try:
        run.keep_saved(folder)
        if failed:
            page = [report_line(str(folder))] if result.has_page else []
            lines = (result.path, *result.lines, *result.notes, *page, result.again)
            case = case or (run.case() if run.failures else None)
            files = stream_files(case, run.stream(), run.spec.image)
            leave(folder, "\n".join((*lines, "")), {SCENARIO: encodable(text.text).encode(), **files})
            commands = case_lines(str(folder), FIRMWARE not in files) if CASE in files else ()
            return replace(result, folder=str(folder), commands=commands)
    except (OSError, BadInput) as error:  # the verdict stands, whatever becomes of its files
        with suppress(OSError, BadInput):
            clear(folder, SCENARIO)
        saves = run.player is not None and run.player.saved
        verdict = "error" if saves and not failed else result.verdict
        return replace(
            result,
            verdict=verdict,
            verdict_lines=[*result.verdict_lines, ("passed", nothing_left(folder, error))],
        )
    return result


def folder_of(artifacts: Path, path: str) -> Path:
    """The file's own folder: by its path, which no other file has."""
    parts = [part for part in Path(path).parts if part not in (".", "..", os.sep)]
    return artifacts / "-".join([*parts[:-1], stem_of(path)])


def stem_of(path: str) -> str:
    """The name of a file without the suffix of its kind."""
    return Path(path).name.removesuffix(".stream").removesuffix(".toml").removesuffix(".scenario")


SUFFIX = ".scenario.toml"
KINDS = f"*{SUFFIX} or *{CASE_SUFFIX}"
SKIPPED = ("node_modules", "__pycache__")


def collect(paths: Sequence[str]) -> list[str]:
    """The files, each once: those that are named, and all of these kinds below each folder, sorted by path.

    Of streams below a folder those are tests that expect something. A folder that is a link is not looked into, unless
    it is named.

    Raises BadInput for a path that is not there, and for a file of another kind.
    """
    files: dict[str, None] = {}
    for path in paths:
        if os.path.isdir(path):
            files |= dict.fromkeys(_below(path))
            continue
        if not os.path.exists(path):
            raise BadInput(path, "", "there is no such file or folder", f"name a folder, or a {KINDS}")
        if not path.endswith((SUFFIX, CASE_SUFFIX)):
            raise BadInput(path, "", f"is no {KINDS}", "rename it; `mirotwin run` takes any scenario")
        files[path] = None
    return list(files)


def _below(folder: str) -> Iterator[str]:
    for above, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in SKIPPED)
        for name in sorted(names):
            path = Path(above, name)
            if not path.is_file() and not path.is_symlink():  # no pipes and devices
                continue
            if name.endswith(SUFFIX) or (name.endswith(CASE_SUFFIX) and is_case(path)):
                yield str(path)
