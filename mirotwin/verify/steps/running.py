"""One scenario file run to its verdict: its steps, what it expects, and what every run has to fulfil."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_robot.image import Image
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.shell.outputs import whole_file
from mirotwin.shell.program import show_traceback
from mirotwin.shell.verdicts import VERDICTS, Verdict
from mirotwin.verify.cases.artifacts import clear, leave, nothing_left, report_line
from mirotwin.verify.cases.case import SUFFIX as CASE_SUFFIX
from mirotwin.verify.cases.case import Trace, case_of_checks, case_text, is_case
from mirotwin.verify.cases.rerun import case_of_expect
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.expectations import expectation_lines, verdict_of_run
from mirotwin.verify.steps.keys import ConditionStep, WaitStep
from mirotwin.verify.steps.player import Player, check_symbols
from mirotwin.verify.steps.reading import everything, steps_of

SCENARIO = "scenario.toml"
"""The whole scenario with all that was set, in the folder of a file that failed."""


class Outcome(msgspec.Struct, frozen=True):
    """The result of a file. `lines`: each failure as one line, none where it passed; `notes`: what else to say.

    `error`: it could not be run. `done` of `steps`; `tick`: where the run ended. `left`: the folder with its case.
    `left_out`: what settings left out of the scenario, a line each. `unseen`: steps and expectations that
    no port shows. `again`: the command that gives the verdict again.
    """

    path: str
    verdict: Verdict
    lines: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    done: int = 0
    steps: int = 0
    tick: int = 0
    seed: int = 0
    digest: str = ""
    firmware_sha256: str = ""
    left: str = ""
    left_out: tuple[str, ...] = ()
    unseen: int = 0
    again: str = ""


def run_test(
    path: str,
    image: Image,
    seed: int = 0,
    settings: Sequence[str] = (),
    artifacts: Path | None = None,
    again: Callable[[bool], str] = lambda saves: "",
) -> Outcome:
    """Runs a file to its verdict; whatever cannot be run is an outcome, too.

    `artifacts`: below it, in a folder of its own, the file leaves what `save` steps keep and, if it fails, its case; a
    file that saves needs one. `again`: makes the command that gives the verdict again, told whether the file saves.
    """
    return outcome_of(path, artifacts, lambda folder: _run(path, image, seed, settings, folder, again), seed)


def outcome_of(
    path: str, artifacts: Path | None, run: Callable[[Path | None], Outcome], seed: int = 0
) -> Outcome:
    """What `run` makes of the file and of its folder below `artifacts`, which holds nothing of an earlier run."""
    folder = None if artifacts is None else folder_of(artifacts, path)
    if folder is not None:
        with suppress(OSError, BadInput):  # who leaves something there says why nothing can be left
            clear(folder, SCENARIO)
    try:
        return run(folder)
    except (DomainError, PluginError, OSError) as error:
        show_traceback(error)
        what = f"cannot be run: {error}"
        return Outcome(path, "error", (f"{BadInput(path, '', what)}",), seed=seed)
    except BadInput as error:
        show_traceback(error)
        return Outcome(path, "error", (f"{error}",), seed=seed)


def _run(
    path: str,
    image: Image,
    seed: int,
    settings: Sequence[str],
    folder: Path | None,
    again: Callable[[bool], str],
) -> Outcome:
    text = load(path, settings, everything)
    steps = steps_of(text.scenario, path)
    check_symbols(steps, image, path)
    saving = [step for step in steps if step.VERB == "save"]
    if saving and folder is None:
        raise BadInput(
            path, f"step {saving[0].number}", "there is no folder to save into", "give --artifacts DIR"
        )
    world = World(text.scenario, seed, image)
    trace = None if folder is None else Trace(world)
    checks = Checks(world, expectations_of(text.scenario, path))
    player = Player(world, steps, path)
    player.play()
    case = None if trace is None else case_of_step(player, trace)
    player.finish()
    checks.finish()
    lines, notes = said_of(player, checks)
    command, verdict, left = again(bool(saving)), verdict_of_run(checks, player), False
    if folder is not None and trace is not None:
        try:
            keep_saved(player, folder)
            if lines:
                report = "".join(
                    f"{line}\n" for line in (path, *lines, *notes, report_line(str(folder)), command)
                )
                case = case or (case_of_checks(world, trace, checks) if checks.failures else None)
                leave(folder, report, case, case_text(world, trace, {}, ""), image, {SCENARIO: text.text})
                left = True
        except (OSError, BadInput) as error:  # the verdict stands, whatever becomes of its files
            notes += (nothing_left(folder, error),)
            verdict = "error" if saving and not lines else verdict
            with suppress(OSError, BadInput):
                clear(folder, SCENARIO)
    return Outcome(
        path=path,
        verdict=verdict,
        lines=lines,
        notes=notes,
        done=player.done,
        steps=len(steps),
        tick=world.tick,
        seed=seed,
        digest=world.digest,
        firmware_sha256=image.sha256 or "",
        left=str(folder) if left else "",
        left_out=text.notes,
        again=command,
    )


def folder_of(artifacts: Path, path: str) -> Path:
    """The file's own folder: by its path, which no other file has."""
    parts = [part for part in Path(path).parts if part not in (".", "..", os.sep)]
    return artifacts / "-".join([*parts[:-1], stem_of(path)])


def said_of(player: Player, checks: Checks) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What is wrong, and what else to say, one line each: faults, the step, the checks in the order of their begin."""
    lines = [
        f"firmware fault: net{robot.network}/robot{robot.slot}: {fault}"
        for robot in player.world.robots
        for fault in robot.board.faults[:1]
    ]
    if player.failure is not None:
        lines.append(f"step failed: {player.failure}")
    found = [one for group in (checks, *player.checks) for one in expectation_lines(group)]
    wrong = [line for verdict, line in found if VERDICTS[verdict].junit == "failure"]
    return (*lines, *wrong), tuple(line for _, line in found if line not in wrong)


def stem_of(path: str) -> str:
    """The name of a file without what its kind is called."""
    return Path(path).name.removesuffix(".stream").removesuffix(".toml").removesuffix(".scenario")


def keep_saved(player: Player, folder: Path) -> None:
    """Writes what `save` steps kept. Raises OutputError."""
    for name, content in player.saved.items():
        folder.mkdir(parents=True, exist_ok=True)
        with whole_file(folder / name, "--artifacts") as part:
            part.write_bytes(content)


def case_of_step(player: Player, trace: Trace) -> str | None:
    """The case of the step that has just failed; None where no check can judge it."""
    failure = player.failure
    if failure is None or failure.tick <= failure.begun_tick:
        return None
    step = player.steps[player.done]
    if not isinstance(step, ConditionStep) or (isinstance(step, WaitStep) and not failure.timed_out):
        return None
    name = "happens" if isinstance(step, WaitStep) else "never_happens"
    until_tick = max(failure.tick, player.world.tick)
    expect = expect_of(name, step.condition, failure.begun_tick, until_tick)
    return None if expect is None else case_of_expect(player.world, trace, expect)


SUFFIX = ".scenario.toml"
KINDS = f"*{SUFFIX} or *{CASE_SUFFIX}"
SKIPPED = ("node_modules", "__pycache__")


def collect(paths: Sequence[str]) -> list[str]:
    """The files, each once: those that are named, and all of these kinds below each folder, sorted by path.

    Of streams below a folder those are tests that expect something. A folder that is a link is not looked into, unless
    it is named.

    Raises BadInput for a path that is not there, and for a file of another kind.
    """
    found: dict[str, None] = {}
    for path in paths:
        if os.path.isdir(path):
            found |= dict.fromkeys(_below(path))
            continue
        if not os.path.exists(path):
            raise BadInput(path, "", "there is no such file or folder", f"name a folder, or a {KINDS}")
        if not path.endswith((SUFFIX, CASE_SUFFIX)):
            raise BadInput(path, "", f"is no {KINDS}", "rename it; `mirotwin run` takes any scenario")
        found[path] = None
    return list(found)


def _below(folder: str) -> Iterator[str]:
    for above, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in SKIPPED)
        for name in sorted(names):
            path = Path(above, name)
            if not path.is_file() and not path.is_symlink():  # no pipes and devices
                continue
            if name.endswith(SUFFIX) or (name.endswith(CASE_SUFFIX) and is_case(path)):
                yield str(path)
