"""The options of a test: scenario, firmware, seed and expectations, from its marker and from the session's options.

    @pytest.mark.mirotwin(scenario="fig6", settings=["duration_s=2"], seed=7, firmware="mine.ihx",
                          expect={"settles_within_s": 2.0}, boot=False)
    @pytest.mark.mirotwin(board="car.board.toml", firmware="car.hex")      a board, from power-on

A key of the marker holds for its test, one of the innermost marker before others; `settings` and `expect` of all
markers add up. Session options hold for tests without a key of their own; a seed from the command line holds for all
tests, because the printed command repeats a test by it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_exact.domain import MAX_SEED
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_file import builtin_boards
from miro_sim.scenario.board_scenario import AnyText, load_any
from miro_sim.scenario.board_scenario import is_board as is_board_name
from miro_sim.scenario.file import LONGEST_S, ScenarioText
from mirotwin.runs.spec import RunSpec, silent_scenario
from mirotwin.shell.firmware_image import image_for
from mirotwin.verify.checks.expect import expectations_of

if TYPE_CHECKING:
    import pytest

MARKER = "@pytest.mark.mirotwin"


class RigOptions(msgspec.Struct, frozen=True):
    """Options of a test's run. `boot`: the test begins after the firmware's start, not at power-on."""

    spec: RunSpec
    boot: bool


def _together(marks: Iterable[pytest.Mark]) -> dict[str, Any]:
    """The keys of markers, the innermost one first, put together."""
    keys: dict[str, Any] = {"settings": [], "expect": {}}
    for mark in marks:
        if mark.args:
            remedy = f"write scenario={mark.args[0]!r}, or another of {', '.join(KEYS)}"
            raise BadInput("", MARKER, f"{mark.args[0]!r} has no name", remedy)
        for key, value in mark.kwargs.items():
            _check_key(key, value)
            if key == "settings":
                keys[key] = [*value, *keys[key]]
            elif key == "expect":
                keys[key] = value | keys[key]
            else:
                keys.setdefault(key, value)
    return keys


_TYPES: dict[str, tuple[tuple[type, ...], str]] = {
    "scenario": ((str, Path, dict), "a built-in scenario's name, a path, or a table of settings"),
    "board": ((str, Path), "the path of a board file, or a built-in board's name"),
    "settings": ((list, tuple), 'a list of "KEY=VALUE"'),
    "firmware": ((str, Path), "the path of an .ihx file"),
    "seed": ((int,), "a whole number"),
    "expect": ((dict,), "a table of checks"),
    "boot": ((bool,), "True or False"),
}
KEYS = tuple(_TYPES)


def _check_key(key: str, value: Any) -> None:
    if key not in KEYS:
        remedy = did_you_mean(key, KEYS, f"there are {', '.join(KEYS)}")
        raise BadInput("", MARKER, f"there is no key {key!r}", remedy)
    types, allowed = _TYPES[key]
    if not isinstance(value, types) or (key == "seed" and isinstance(value, bool)):
        raise BadInput("", MARKER, f"{key}={value!r}", f"give {allowed}")
    if isinstance(value, list | tuple) and not all(isinstance(item, str) and "=" in item for item in value):
        raise BadInput("", MARKER, f"settings={value!r}", f"give {allowed}")


def rig_options(
    marks: Iterable[pytest.Mark], folder: Path, firmware: str | Path | None, seed: int
) -> RigOptions:
    """The options from a test's markers, innermost first, and from the session.

    `folder`: of the test, to which the markers' paths are relative; `firmware`: the session's, None for the robot's
    own. Raises BadInput.
    """
    if not 0 <= seed <= MAX_SEED:
        raise BadInput("", "seed", f"{seed} is out of range", f"give 0 to {MAX_SEED}")
    mark = _together(marks)
    if "board" in mark and "scenario" in mark:
        raise BadInput(
            "", MARKER, "has both board and scenario", "name the scenario alone: it names its board"
        )
    text = _text(mark.get("board", mark.get("scenario")), mark["settings"], folder, "board" in mark)
    scenario = text.scenario
    if scenario.step:
        steps = amount(len(scenario.step), "step")
        reason = f"scenario {scenario.name} has {steps}, which a test in Python does not do"
        raise BadInput("", MARKER, reason, "pytest collects *.scenario.toml files by themselves")
    image = image_for(text, _near(mark["firmware"], folder) if "firmware" in mark else firmware)
    scenario = msgspec.structs.replace(scenario, expect={**scenario.expect, **mark["expect"]})
    is_silent = not isinstance(scenario, BoardScenario) and all(
        network.host == "silent" for network in scenario.networks
    )
    boot = mark.get("boot", is_silent)
    expected = expectations_of(scenario, scenario.name)
    return RigOptions(RunSpec(scenario=scenario, image=image, seed=seed, expected=expected), boot)


def _text(
    source: str | Path | dict[str, Any] | None, settings: Sequence[str], folder: Path, is_board: bool
) -> AnyText:
    if source is None or isinstance(source, dict):
        tables = [f"{key}={_toml(value)}" for key, value in (source or {}).items()]
        return ScenarioText("", scenario=silent_scenario((*tables, *settings)))
    name = str(source)
    is_path = isinstance(source, Path) or name.endswith(".toml") or "/" in name
    own = (f"duration_s={LONGEST_S:g}",) if is_board else ()  # a test ends where it ends
    if is_board and not is_board_name(name):
        remedy = f"name a file .board.toml, or one of {', '.join(builtin_boards())}"
        raise BadInput("", MARKER, f"board={name!r} is no board", remedy)
    return load_any(str(_near(name, folder)) if is_path else name, (*own, *settings))


def _near(path: str | Path, folder: Path) -> Path:
    """Beside the test if it is there, else as given."""
    return folder / path if (folder / path).exists() else Path(path)


def _toml(value: Any) -> str:
    """A value as a setting has it: tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return msgspec.json.encode(value).decode()
