"""Scenario files: finding one, reading it, and saying in one line what is wrong with it.

What belongs here: TOML text to `Scenario`, and the built-in scenarios. What does not: which keys there are
(`keys`), and the words of an error (`errors`). Nothing but `ScenarioError` leaves these
functions, whatever the text.
"""

import math
import tomllib
from difflib import get_close_matches
from importlib import resources
from typing import Any

import msgspec

from miro_protocol.toml_text import KEY_PARTS, TEXT_KIB, long_key_line, too_long
from miro_sim.inputs import InputError, read_input
from miro_sim.scenario.errors import ScenarioError, value_error
from miro_sim.scenario.keys import Scenario
from miro_sim.scenario.parts import full_message, part_of
from miro_sim.scenario.places import check_places
from miro_sim.scenario.profiles import ProfileError, with_profiles


class ScenarioText(msgspec.Struct, frozen=True):
    """A scenario together with the text it was read from, which is what a recording keeps."""

    origin: str
    text: str
    scenario: Scenario


def builtin_names() -> list[str]:
    """Names of the scenarios that come with the package, sorted."""
    folder = resources.files("miro_sim.scenario") / "builtin"
    return sorted(entry.name[: -len(".toml")] for entry in folder.iterdir() if entry.name.endswith(".toml"))


def builtin_text(name: str) -> str:
    """The file of a built-in scenario. Raises ScenarioError for a name that is not one."""
    names = builtin_names()
    if name not in names:
        close = get_close_matches(name, names, n=1)
        hint = f"did you mean {close[0]}? " if close else ""
        remedy = f"{hint}built-in scenarios: {', '.join(names)}; a file needs a path that ends in .toml"
        raise ScenarioError(name, "", "no such scenario", remedy)
    return (resources.files("miro_sim.scenario") / "builtin" / f"{name}.toml").read_text(encoding="utf-8")


def load(source: str) -> ScenarioText:
    """The scenario that `source` names: a file if it ends in .toml or has a path separator, else a
    built-in.
    """
    if not (source.endswith(".toml") or "/" in source or "\\" in source):
        text = builtin_text(source)
        return ScenarioText(source, text, parse(text, source))
    try:
        raw = read_input(source, TEXT_KIB << 10)
    except FileNotFoundError:
        raise ScenarioError(
            source, "", "no such file", "`mirotwin scenarios` lists the built-in ones"
        ) from None
    except InputError as error:
        raise ScenarioError(source, "", error.what, error.remedy) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ScenarioError(source, "", f"cannot be read: {reason}") from None
    text = decode(raw, source)
    return ScenarioText(source, text, parse(text, source))


def decode(raw: bytes, origin: str) -> str:
    """The text of a scenario file. Raises ScenarioError with the line that is not UTF-8."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise ScenarioError(origin, f"line {line}", "not UTF-8 text", "save the file as UTF-8") from None


def parse(text: str, origin: str) -> Scenario:
    """TOML text to a Scenario. Raises ScenarioError (and nothing else) naming `origin` and the place.

    Decides the engine, if nothing has yet: where a reference leads is computed by a hot module.
    """
    _check_size(text, origin)
    try:
        raw = _loads(text, origin)
    except RecursionError:
        raise _too_deep(origin) from None
    return of_table(raw, origin)


def of_table(raw: dict[str, Any], origin: str) -> Scenario:
    """A Scenario from the tables that TOML text gave, which may be filled in. Raises ScenarioError as `parse` does."""
    try:
        return _converted(raw, origin)
    except RecursionError:
        raise _too_deep(origin) from None


def _too_deep(origin: str) -> ScenarioError:
    return ScenarioError(origin, "", "nested too deeply", "a scenario has tables in at most 5 levels")


def _check_size(text: str, origin: str) -> None:
    """Refuses what would take `tomllib` minutes."""
    if too_long(text):
        what = f"holds more than {TEXT_KIB} KiB"
        raise ScenarioError(origin, "", what, "name the file that was meant")
    line = long_key_line(text)
    if line is not None:
        what = f"a key of more than {KEY_PARTS} parts"
        raise ScenarioError(origin, f"line {line}", what, "remove it; no key of a scenario has more than 6")


def _loads(text: str, origin: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(origin, text, str(error)) from None
    except ValueError:  # an integer with more digits than Python converts
        raise ScenarioError(origin, "", "an integer of thousands of digits") from None


def _converted(raw: dict[str, Any], origin: str) -> Scenario:
    _check_finite(raw, "", origin)
    _fill_in_profiles(raw, origin)
    try:
        scenario = msgspec.convert(raw, Scenario, dec_hook=part_of)
    except msgspec.ValidationError as error:
        raise value_error(origin, raw, full_message(error)) from None
    check_places(scenario, origin)
    return scenario


def _fill_in_profiles(raw: dict[str, Any], origin: str) -> None:
    """Replaces the radio tables by themselves with their profiles; what has another shape is left alone."""
    networks = raw.get("network")
    for index, network in enumerate(networks if isinstance(networks, list) else []):
        if isinstance(network, dict) and isinstance(network.get("radio"), dict):
            try:
                network["radio"] = with_profiles(network["radio"])
            except ProfileError as error:
                place = f"network[{index}].radio.profile"
                raise ScenarioError(origin, place, error.what, error.remedy) from None


def _syntax_error(origin: str, text: str, message: str) -> ScenarioError:
    what, _, place = message.partition(" (at ")
    place = place.rstrip(")")
    if place == "end of document":
        place = f"line {text.count(chr(10)) + 1}"
    return ScenarioError(origin, place, f"not TOML: {what}")


def _check_finite(value: Any, path: str, origin: str) -> None:
    """Refuses NaN and infinities, which TOML has and no key takes."""
    if isinstance(value, dict):
        for key, item in value.items():
            _check_finite(item, f"{path}.{key}" if path else key, origin)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _check_finite(item, f"{path}[{index}]", origin)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ScenarioError(origin, path, f"{value} is not a number that can be used", "give a finite number")
