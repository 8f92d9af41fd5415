"""Scenario files: finding one, reading it, and saying in one line what is wrong with it.

Nothing but `ScenarioError` leaves these functions, whatever the text.
"""

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import did_you_mean, one_line
from miro_exact.inputs import InputError, read_input
from miro_exact.inputs import decode as any_text
from miro_protocol.toml_text import TEXT_KIB, check_numbers, tables, without_none
from miro_sim.scenario.base import is_path, with_base
from miro_sim.scenario.errors import ScenarioError, value_error
from miro_sim.scenario.keys import Scenario, scenario_of
from miro_sim.scenario.paths import put_paths
from miro_sim.scenario.plugins import cause_of, full_message
from miro_sim.scenario.profiles import with_profiles
from miro_sim.scenario.settings import Setting, blamed, drop_other_kind, make
from miro_sim.scenario.variants import with_variant

_BUILTIN = Path(__file__).parent / "builtin"
_DAMAGED = "\ufffd"  # what stands for bytes that no encoding has
LONGEST_S = 86_400.0
"""The longest duration that a scenario may have: a day."""


class ReadText(msgspec.Struct, frozen=True):
    """The text of a scenario, which a recording keeps: as it was read, or as the `settings` left it.

    The text of one that names another (`base`) or a board is that of the whole. `notes`: what the settings left out, a
    line each. `source`: the text as it was read; `tables`: what became of it, None where that is the same. `made`: the
    settings of the file and then `settings`.
    """

    origin: str
    source: str = ""
    settings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    tables: dict[str, Any] | None = None
    made: tuple[Setting, ...] = ()

    @property
    def text(self) -> str:
        return self.source if self.tables is None else written(self.tables, self.origin, self.settings)

    def blamed(self, error: ScenarioError) -> ScenarioError:
        """An error of another reader of the scenario, naming the setting that it concerns."""
        return blamed(error, self.made, self.tables or {})


class ScenarioText(ReadText, frozen=True, kw_only=True):
    """A scenario of robots together with its text."""

    scenario: Scenario


def builtin_names() -> list[str]:
    """Names of the scenarios that come with the package, sorted, numbers in them by their value."""
    return sorted((entry.stem for entry in _BUILTIN.glob("*.toml")), key=_by_number)


def _by_number(name: str) -> list[tuple[int, str]]:
    """The name's words and numbers; fig9 comes before fig10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"([0-9]+)", name)]


def builtin_text(name: str) -> str:
    """The file of a built-in scenario. Raises ScenarioError for a name that is not one."""
    names = builtin_names()
    if name not in names:
        if Path(name).suffix and not os.path.exists(name):
            raise _no_such_file(name)
        remedy = f"built-in scenarios: {', '.join(names)}; a file needs a path that ends in .toml"
        raise ScenarioError(name, "", "no such scenario", did_you_mean(name, names, remedy))
    return (_BUILTIN / f"{name}.toml").read_text(encoding="utf-8")


def load(source: str, settings: Sequence[str] = ()) -> ScenarioText:
    """The scenario that `source` names: a file if it ends in .toml or has a path separator, else a
    built-in. `settings` as `parse` takes them.
    """
    return of_text(source_text(source), source, settings)


def of_text(text: str, origin: str, settings: Sequence[str] = ()) -> ScenarioText:
    """Like `load`, for a text that `origin` names."""
    raw = tables_of(text, origin)
    whole, own = with_base(raw, origin, _base_tables)
    with_points = put_paths(whole, origin)
    made = _checked(whole, origin, settings, own)
    same = whole is raw and not settings and not with_points
    return msgspec.structs.replace(made, source=text, tables=None if same else whole)


def _base_tables(source: str) -> dict[str, Any]:
    raw = tables_of(source_text(source), source)
    put_paths(raw, source)
    return raw


def source_text(source: str) -> str:
    """The text of the scenario that `source` names, which may be wrong. Raises ScenarioError."""
    if not is_path(source):
        return builtin_text(source)
    try:
        raw = read_input(source, TEXT_KIB << 10)
    except FileNotFoundError:
        raise _no_such_file(source) from None
    except InputError as error:
        raise ScenarioError(source, "", error.what, error.remedy) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ScenarioError(source, "", f"cannot be read: {reason}") from None
    return decode(raw, source)


def _no_such_file(path: str) -> ScenarioError:
    return ScenarioError(path, "", "no such file", "`mirotwin scenarios` lists the built-in scenarios")


def decode(raw: bytes, origin: str) -> str:
    """The text of a scenario file. Raises ScenarioError with the line that is no text in any of its encodings."""
    text = any_text(raw)
    if _DAMAGED in text:
        line = text.count("\n", 0, text.index(_DAMAGED)) + 1
        raise ScenarioError(origin, f"line {line}", "not UTF-8 text", "save the file as UTF-8")
    return text


def parse(text: str, origin: str, settings: Sequence[str] = ()) -> Scenario:
    """TOML text to a Scenario, after the `settings` (`KEY=VALUE`, see `settings`) were made in it.

    Raises ScenarioError (and nothing else) naming `origin` and the place. A text that stands in no file (`origin` "")
    may name no other one.
    Decides the engine, if nothing has yet: where a reference leads is computed by a hot module.
    """
    return of_text(text, origin, settings).scenario


def changed(scenario: Scenario, origin: str, settings: Sequence[str]) -> ScenarioText:
    """A scenario that stands in no file, with these settings. Raises ScenarioError."""
    raw = without_none(msgspec.to_builtins(scenario))
    return (
        _checked(raw, origin, settings) if settings else ScenarioText(origin, scenario=scenario, tables=raw)
    )


def tables_of(text: str, origin: str) -> dict[str, Any]:
    """The tables of a scenario's text. Raises ScenarioError."""
    with ScenarioError.at(origin):
        return tables(text)


def of_table(raw: dict[str, Any], origin: str) -> Scenario:
    """A Scenario from the tables that TOML text gave, which may be filled in. Raises ScenarioError as `parse` does."""
    return _checked(raw, origin).scenario


def _checked(
    raw: dict[str, Any], origin: str, settings: Sequence[str] = (), own: Sequence[Setting] = ()
) -> ScenarioText:
    """The scenario of these tables; makes the settings in them. `own`: those that its file has made.

    A setting that chooses another kind of something leaves the old kind's keys out; a note for each says which.
    """
    made = [*own, *make(raw, settings, origin)]
    # A file that a setting names is refused: a campaign's workers would read it at other times.
    put_paths(raw, origin, in_file=False)
    dropped: dict[str, list[str]] = {}
    while True:
        try:
            scenario = _converted(raw, origin)
            notes = tuple(
                f"{path} leaves out {', '.join(dict.fromkeys(keys))}" for path, keys in dropped.items()
            )
            return ScenarioText(origin, "", tuple(settings), notes, raw, tuple(made), scenario=scenario)
        except ScenarioError as error:
            foreign = drop_other_kind(error, made)
            if foreign is None:
                raise blamed(error, made, raw) from error.__cause__
            dropped.setdefault(foreign[0], []).append(foreign[1])
        except RecursionError:
            raise ScenarioError(origin, "", "nested too deeply", "tables have at most 5 levels") from None


def _converted(raw: dict[str, Any], origin: str) -> Scenario:
    """The scenario of complete tables. Raises ScenarioError."""
    from miro_sim.scenario.build import check_robots  # needs hot modules: not before the engine was chosen

    if "board" in raw and "network" in raw:
        problem = "is for a scenario of a board, and this one is for robots"
        raise ScenarioError(origin, "board", problem, "remove it")
    if "board" in raw:
        problem = "the scenario is for a board, and this command takes robots"
        raise ScenarioError(origin, "board", problem, "`mirotwin run` and `mirotwin test` take it")
    with ScenarioError.at(origin, "variant"):
        complete = with_variant(raw) if "variant" in raw else raw
    complete = _with_profiles(complete, origin)
    with ScenarioError.at(origin):
        check_numbers(complete)
    try:
        scenario = scenario_of(complete)
    except msgspec.ValidationError as error:
        raise value_error(origin, complete, full_message(error)) from cause_of(error)
    check_robots(scenario, origin)
    return scenario


def _with_profiles(raw: dict[str, Any], origin: str) -> dict[str, Any]:
    """The tables with the keys of profiles in the radio tables; a value of another shape stays."""
    networks = raw.get("network")
    if not isinstance(networks, list):
        return raw
    complete = []
    for index, network in enumerate(networks):
        if isinstance(network, dict) and isinstance(network.get("radio"), dict):
            with ScenarioError.at(origin, f"network[{index}].radio.profile"):
                network = {**network, "radio": with_profiles(network["radio"])}
        complete.append(network)
    return {**raw, "network": complete}


def live_scenario(source: str, settings: Sequence[str] = ()) -> ScenarioText:
    """The scenario that `source` names, with `settings` and then those of a live session made in it.

    Its hosts send nothing, because a program at a port does; it lasts a day at most. References that would leave the
    pitch stop where the scenario's own duration ends. Nothing steers by them; they are the robots' starts, and what the
    summary compares with. Raises ScenarioError as `load` does, also for a reference of one's own that leaves the pitch
    within a day, and for a scenario with steps.
    """
    return lasting(for_session(source, settings))


def for_session(source: str, settings: Sequence[str] = ()) -> ScenarioText:
    """The scenario of a live session before it is made to last: what it expects is right for its own duration."""
    if source in builtin_names():
        settings = ("expect={}", *settings)  # which its own controller is to fulfil, and nothing steers here
    return load(source, settings)


def lasting(own: ScenarioText) -> ScenarioText:
    """The scenario of `for_session` with a day to run and silent hosts."""
    if own.scenario.step:
        problem = "a live session does no steps"
        raise ScenarioError(own.origin, "step", problem, "run them by `mirotwin test`, or remove them")
    return load(own.origin, (*own.settings, *live_settings(own.scenario)))


def live_settings(scenario: Scenario) -> list[str]:
    """The settings that make a scenario last a day, with hosts that send nothing."""
    settings = [f"duration_s={LONGEST_S!r}"]
    for index, network in enumerate(scenario.networks):
        settings.append(f'network.{index}.host="silent"')
        for place, robot in enumerate(network.robot):
            if getattr(robot.reference, "drive_s", 0.0) is None:  # it would move all the time
                settings.append(f"network.{index}.robot.{place}.reference.drive_s={scenario.duration_s!r}")
    return settings


def written(raw: dict[str, Any], origin: str, settings: Sequence[str]) -> str:
    """A scenario file of these tables; its head says what it was made of."""
    import tomli_w  # only scenarios with settings need it

    head = [f"# {origin} with these keys set:", *(f"#   {setting}" for setting in settings)]
    if not settings:
        head = [f"# {origin} with what the scenario says that it names"]
    return "\n".join([*map(one_line, head), "", tomli_w.dumps(raw)])
