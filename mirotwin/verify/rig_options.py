"""What a test wants: its scenario, firmware, seed and expectations, from its marker and from the session's options.

    @pytest.mark.mirotwin(scenario="fig6", settings=["duration_s=2"], seed=7, firmware="mine.ihx",
                          expect={"settles_within_s": 2.0}, boot=False)

A key of the marker holds for its test, one of the innermost marker before others; `settings` and `expect` of all
markers add up. Options hold for the tests that do not say; a seed from the command line holds for all, because that is
how the printed line repeats a test.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_exact.domain import MAX_SEED
from miro_robot.image import Image
from miro_sim.scenario.file import load, parse
from miro_sim.scenario.keys import Scenario
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.interface import Check

MARKER = "@pytest.mark.mirotwin"


class RigOptions(msgspec.Struct, frozen=True):
    """What a test's world is made of. `boot`: it begins when the firmware is up, not at power-on."""

    scenario: Scenario
    image: Image
    seed: int
    expected: Mapping[tuple[int, int], Sequence[Check]]
    boot: bool


class MarkerOptions(msgspec.Struct, frozen=True, kw_only=True):
    """The keys of a test's markers, put together; None where none says anything."""

    scenario: str | Path | dict[str, Any] | None = None
    settings: tuple[str, ...] = ()
    firmware: str | Path | None = None
    seed: int | None = None
    expect: dict[str, Any] = {}
    boot: bool | None = None


def marker_options(marks: Sequence[tuple[tuple[Any, ...], Mapping[str, Any]]]) -> MarkerOptions:
    """From the arguments of markers, the innermost one first. Raises BadInput for keys and values that cannot be."""
    found: dict[str, Any] = {}
    settings: list[str] = []
    expect: dict[str, Any] = {}
    for positional, keys in marks:
        if positional:
            what = f"{positional[0]!r} has no name"
            raise BadInput(
                "", MARKER, what, f"write scenario={positional[0]!r}, or another of {', '.join(KEYS)}"
            )
        for key, value in keys.items():
            _check_key(key, value)
            if key == "settings":
                settings[:0] = value
            elif key == "expect":
                expect = {**value, **expect}
            else:
                found.setdefault(key, value)
    return MarkerOptions(**found, settings=tuple(settings), expect=expect)


_TYPES: dict[str, tuple[tuple[type, ...], str]] = {
    "scenario": ((str, Path, dict), "a built-in scenario's name, a path, or a table of settings"),
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
    types, what = _TYPES[key]
    if not isinstance(value, types) or (key == "seed" and isinstance(value, bool)):
        raise BadInput("", MARKER, f"{key}={value!r}", f"give {what}")
    if isinstance(value, list | tuple) and not all(isinstance(one, str) and "=" in one for one in value):
        raise BadInput("", MARKER, f"settings={value!r}", f"give {what}")


def rig_options(mark: MarkerOptions, folder: Path, firmware: str | Path | None, seed: int) -> RigOptions:
    """What a marker and the session ask for. `folder`: that of the test, from which the marker's paths go; `firmware`:
    the session's, None for the robot's own. Raises BadInput.
    """
    if not 0 <= seed <= MAX_SEED:
        raise BadInput("", "seed", f"{seed} is out of range", f"give 0 to {MAX_SEED}")
    scenario = _scenario(mark, folder)
    if scenario.step:
        what = f"scenario {scenario.name} has {amount(len(scenario.step), 'step')}, which a test in Python does not do"
        raise BadInput("", MARKER, what, "pytest collects *.scenario.toml files by themselves")
    if mark.firmware is not None:
        firmware = _near(mark.firmware, folder)
    image = load_firmware(firmware)
    if mark.expect:
        scenario = msgspec.structs.replace(scenario, expect={**scenario.expect, **mark.expect})
    boot = mark.boot if mark.boot is not None else all(one.host == "silent" for one in scenario.networks)
    return RigOptions(scenario, image, seed, expectations_of(scenario, scenario.name), boot)


def _scenario(mark: MarkerOptions, folder: Path) -> Scenario:
    source = mark.scenario
    if source is None or isinstance(source, dict):
        settings = [f"{key}={_toml(value)}" for key, value in (source or {}).items()]
        return silent_scenario((*settings, *mark.settings))
    text = str(source)
    is_path = isinstance(source, Path) or text.endswith(".toml") or "/" in text
    return load(str(_near(text, folder)) if is_path else text, mark.settings).scenario


def _near(path: str | Path, folder: Path) -> Path:
    """Beside the test if it is there, else as given."""
    return folder / path if (folder / path).exists() else Path(path)


@lru_cache(64)
def silent_scenario(settings: tuple[str, ...]) -> Scenario:
    """The scenario of a test that names none, with these settings: read once for all that want the same."""
    text = (Path(__file__).parents[1] / "testing" / "silent.toml").read_text(encoding="utf-8")
    return parse(text, "silent", settings)


def _toml(value: Any) -> str:
    """A value as a setting has it: tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return msgspec.json.encode(value).decode()
