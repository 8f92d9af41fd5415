"""A scenario that is another one with a few keys changed: `scenario = "silent"` at the top of a file.

    scenario = "silent"                    a built-in one, or a .toml file in this folder or below
    duration_s = 1.0                       any key of a scenario: stands instead of the other one's, a table as a whole
    set = { network.robot.slot = 1 }       single keys of tables, as `--set` on the command line

The words are those of a stream file's header. The result is a whole scenario, which is what a recording keeps: it
depends on no other file.
"""

from collections.abc import Callable
from typing import Any

from miro_exact.inputs import path_beside
from miro_protocol.toml_text import check_numbers
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.settings import Setting, in_text, make

Table = dict[str, Any]
SCENARIO, SET = "scenario", "set"
NETWORK = "network"


def with_base(raw: Table, origin: str, tables_of: Callable[[str], Table]) -> tuple[Table, list[Setting]]:
    """The tables of a whole scenario, and the settings of the file's `set` that were made in them.

    `tables_of` gives the tables of the scenario with a name or path. `origin` "": the tables stand in no file, and may
    name none. Raises ScenarioError.
    """
    if SCENARIO not in raw:
        return raw, []
    name = raw[SCENARIO]
    if not isinstance(name, str) or not name:
        problem = f"expected a name or a path, got {name!r}"
        raise ScenarioError(origin, SCENARIO, problem, 'write scenario = "silent"')
    own = {key: value for key, value in raw.items() if key not in (SCENARIO, SET)}
    settings = raw.get(SET, {})
    if not isinstance(settings, dict):
        raise ScenarioError(origin, SET, "expected a table of keys", "write set = { KEY = VALUE }")
    _check_no_part_of_network(own.get(NETWORK), origin, name)
    if is_path(name) and not origin:
        problem = "stands in a file that depends on no other one"
        raise ScenarioError(origin, SCENARIO, problem, "name a built-in scenario, or record the run again")
    with ScenarioError.at(origin, SCENARIO):
        path = beside(origin, name)
    try:
        base = tables_of(path)
    except ScenarioError as error:
        place = ": ".join(part for part in (f"{error.path}", f"{error.place}") if part)
        raise ScenarioError(origin, SCENARIO, f"{place}: {error.what}", error.remedy) from None
    if SCENARIO in base:
        problem = f"{name} is itself another scenario with keys changed"
        raise ScenarioError(origin, SCENARIO, problem, f"name {base[SCENARIO]!r}, and repeat its keys")
    with ScenarioError.at(origin):
        check_numbers(settings, SET)  # before they are written as text
    complete = {**base, **own}
    return complete, make(complete, in_text(settings), origin, SET)


def _check_no_part_of_network(given: Any, origin: str, name: str) -> None:
    """Refuses headers such as [network.robot.controller], which are meant to change single keys of the other's."""
    entries = given if isinstance(given, list) else [given]
    part = isinstance(given, dict) or any(
        isinstance(entry, dict) and isinstance(entry.get("robot"), dict) for entry in entries
    )
    if part:
        problem = f"a header such as [network.robot.controller] changes no single key of {name}"
        remedy = f"at the top of the file write set = {{ {_key_in(given)} }} instead"
        raise ScenarioError(origin, NETWORK, problem, remedy)


def _key_in(given: Any) -> str:
    """The first single key that a part of a network sets, as `set` takes it; else any."""
    path = NETWORK
    while isinstance(given, (dict, list)) and given:
        if isinstance(given, dict):
            key, given = next(iter(given.items()))
            path += f".{key}"
        else:
            given = given[0]
    if isinstance(given, (bool, int, float, str)):
        return in_text({path: given})[0].replace("=", " = ", 1)
    return "network.robot.controller.q1_per_s = 0.3"


def is_path(name: str) -> bool:
    """True if a scenario's name is that of a file: without a separator or suffix it is a built-in one."""
    return name.endswith(".toml") or "/" in name or "\\" in name


def beside(origin: str, name: str) -> str:
    """The scenario that a file names, as it is called from here. Raises InputError for one outside of its folder."""
    return path_beside(origin, name) if is_path(name) else name
