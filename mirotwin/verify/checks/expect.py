"""Converts a scenario's `[expect]` tables to checks for each robot.

[expect]                                 for all robots
inside_pitch = true                      a check with its defaults
tracks_within_cm = 3.0                   .. with its main parameter
settles_within_s = { within_s = 2.0, position_cm = 2.0 }       .. with any of them

[network.robot.expect]                   for one robot: instead of the key of the same name above
inside_pitch = false                     not for this one
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, cast, get_args

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.plugins import PluginError, Registry, use_one_of
from miro_exact.raised import raised
from miro_sim.periods import RobotId
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import AnyText
from miro_sim.scenario.errors import Refused, ScenarioError, remedy_for_key, value_error
from miro_sim.scenario.keys import Scenario
from miro_sim.world.conditions import CONDITIONS, OnBoard, Recorded
from mirotwin.verify.checks import OWN
from mirotwin.verify.checks.interface import Check, problem_of_class

ALWAYS_ON = ("no_fault", "lm629_protocol", "main_loop_alive", "stack_clear", "acts_at_all")
ALONE_ALWAYS_ON = "no_fault"
"""The check that is always on for a board alone."""

CHECKS: Registry[object] = Registry(
    word="check",
    key="check",
    base="mirotwin.verify.checks.interface:Check",
    own=OWN,
)
"""By name; none is imported before it is named."""

EXAMPLE_VALUES = {"condition": '{ event = "fault" }', "until_tick": "24000000"}
"""The text of a message for a parameter without a default."""
WHERE_CHECKS_ARE = (
    "`mirotwin plugins checks` lists them, --expect FILE.py:CLASS takes one of your own,"
    " `mirotwin examples checks` writes one to pip install"
)


def struct_of(name: str) -> type[Check]:
    """The parameters of the check `name`. Raises PluginError."""
    return cast(type[Check], CHECKS.find(name))


def expectations_of(scenario: Scenario | BoardScenario, origin: str) -> dict[RobotId, list[Check]]:
    """The checks of each robot, always-on ones first. Raises ScenarioError with the path of the wrong key."""
    for_all = checks_of_table(scenario, origin, "expect", scenario.expect)
    if isinstance(scenario, BoardScenario):
        wanted = {ALONE_ALWAYS_ON: struct_of(ALONE_ALWAYS_ON)(), **for_all}
        return {(0, 0): [check for check in wanted.values() if check is not None]}
    checks: dict[RobotId, list[Check]] = {}
    for index, network in enumerate(scenario.networks):
        for position, robot in enumerate(network.robot):
            path = f"network[{index}].robot[{position}].expect"
            own = checks_of_table(scenario, origin, path, robot.expect)
            wanted = {**{name: struct_of(name)() for name in ALWAYS_ON}, **for_all, **own}
            checks[index, robot.slot] = [check for check in wanted.values() if check is not None]
    return checks


def expectations_in(text: AnyText) -> dict[RobotId, list[Check]]:
    """The expectations of a scenario that was read; an error names the setting that it concerns."""
    try:
        return expectations_of(text.scenario, text.origin)
    except ScenarioError as error:
        raise text.blamed(error) from error.__cause__


def named_in(scenario: Scenario | BoardScenario) -> set[str]:
    """Checks that a scenario or one of its steps names: a run that has no occasion for one of them has not passed."""
    if isinstance(scenario, BoardScenario):
        return set(scenario.expect)
    robots = [robot for network in scenario.networks for robot in network.robot]
    steps = [step.get("check") for step in scenario.step]
    tables = [scenario.expect, *(robot.expect for robot in robots), *steps]
    return {name for table in tables if isinstance(table, dict) for name in table}


def says_anything(scenario: Scenario | BoardScenario) -> bool:
    """True if a scenario has expectations besides the always-on checks."""
    if isinstance(scenario, BoardScenario):
        return bool(scenario.expect)
    return bool(
        scenario.expect or any(robot.expect for network in scenario.networks for robot in network.robot)
    )


def checks_of_table(
    scenario: Scenario | BoardScenario, origin: str, path: str, table: Mapping[str, Any]
) -> dict[str, Check | None]:
    """The checks of one table at `path`; None for one that is not expected. Raises ScenarioError."""
    checks: dict[str, Check | None] = {}
    for name, value in table.items():
        place = f"{path}.{name}"
        try:
            check = _check(_struct(name), name, value, scenario.end_tick)
            if check is not None:
                _check_subject(check, scenario)
            checks[name] = check
        except msgspec.ValidationError as error:
            raise _wrong(scenario, origin, place, name, value, f"{error}") from None
        except BadInput as error:
            path_in_file = f"{place}.{error.place}" if error.place else place
            raise ScenarioError(origin, path_in_file, error.what, error.remedy) from error.__cause__
    return checks


def _check_subject(check: Check, scenario: Scenario | BoardScenario) -> None:
    """Raises BadInput for pins and values that the board does not have, or that no check follows at robots."""
    if isinstance(scenario, BoardScenario):
        reason, _, remedy = check.problem_alone(scenario).partition("; ")
        if reason:
            raise Refused(reason, remedy)
    condition = getattr(check, "condition", None)
    if not isinstance(scenario, BoardScenario) and isinstance(condition, OnBoard):
        recorded = [name for name, struct in CONDITIONS.items() if issubclass(struct, get_args(Recorded))]
        raise BadInput("", "condition", f"no check follows {condition.what} at robots", use_one_of(recorded))


def _struct(name: str) -> type[Check]:
    try:
        struct = struct_of(name)
    except PluginError as error:
        if "is not one of the choices" not in error.what:
            raise
        near = remedy_for_key(name, CHECKS.names())
        remedy = f"{near}{'' if near.endswith('?') else ';'} {WHERE_CHECKS_ARE}"
        raise PluginError("there is no such check", remedy) from None
    if problem := problem_of_class(struct):
        raise PluginError(problem, "repair the check")
    return struct


def _check(struct: type[Check], name: str, value: Any, end_tick: int) -> Check | None:
    if value is False:
        if name in ALWAYS_ON:
            raise Refused("this check is always on", "remove the key")
        return None
    bare = not isinstance(value, dict) and value is not True
    if (bare or value is True) and not struct.MAIN and _required(struct):
        raise Refused(*_takes_a_table(struct, name))
    if bare and not struct.MAIN:
        raise Refused(f"expected true or false, got {value!r}", f"write {name} = true")
    is_main = bare or (struct.MAIN_IS_TABLE and isinstance(value, dict) and struct.MAIN not in value)
    given = {} if value is True else {struct.MAIN: value} if is_main else value
    keys = list(struct.__struct_encode_fields__)
    for key in given:
        if key not in keys:
            raise BadInput("", key, "unknown key", remedy_for_key(key, keys))
    try:
        check = msgspec.convert({**given, "check": name}, struct)
    except msgspec.ValidationError:
        raise
    except (Exception, SystemExit) as error:  # from the check's own look at its parameters
        raise Refused(f"cannot check its parameters: {raised(error)}") from error
    try:
        problem = check.problem(end_tick)
    except (Exception, SystemExit) as error:
        raise Refused(f"`problem` raised {raised(error)}", "repair the check") from error
    if problem:
        raise Refused(problem, "give an earlier time, or a longer duration_s")
    return check


@cache  # an input of the fuzzer is judged as quickly as this
def _required(struct: type[Check]) -> list[str]:
    """The parameters that have no default."""
    return [field.encode_name for field in msgspec.structs.fields(struct) if field.required]


def _takes_a_table(struct: type[Check], name: str) -> tuple[str, str]:
    """Reason and remedy: the table with all required keys, and its possible keys."""
    keys = ", ".join(f"{key} = {EXAMPLE_VALUES.get(key, '..')}" for key in _required(struct))
    remedy = f"write {name} = {{ {keys} }}"
    info = cast(msgspec.inspect.StructType, msgspec.inspect.type_info(struct))
    for field in info.fields:
        if field.required and isinstance(field.type, msgspec.inspect.UnionType):
            kinds = [option for option in field.type.types if isinstance(option, msgspec.inspect.StructType)]
            remedy += f"; {kinds[0].tag_field}: {', '.join(str(option.tag) for option in kinds)}"
    return f"{name} takes a table", remedy


def _wrong(
    scenario: Scenario | BoardScenario, origin: str, place: str, name: str, value: Any, message: str
) -> ScenarioError:
    """The error of msgspec, at the path of the scenario."""
    reason, _, inner = message.partition(" - at `$")
    if reason.startswith("Object missing required field"):
        key = reason.split("`")[1]
        example = name if key == struct_of(name).MAIN else key
        return ScenarioError(origin, place, f"{key} is missing", f"give it: {example} = ..")
    below = inner.rstrip("`") if isinstance(value, dict) else ""
    return value_error(origin, msgspec.to_builtins(scenario), f"{reason} - at `$.{place}{below}`")
