"""Converts a scenario's `[[step]]` tables to steps; reports an error in one line.

[[step]]
send = "team"                          the verb, for some with its object
left_m_s = 0.2                         its keys
note = "drives off"                    for people
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn, TypeVar

import msgspec

from miro_exact.plugins import use_one_of
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import AnyText
from miro_sim.scenario.errors import ScenarioError, choices_of, remedy_for_key, value_error
from miro_sim.scenario.keys import Scenario
from miro_sim.world.conditions import CONDITIONS, Condition, Followed, Kind, WheelSpeeds
from mirotwin.verify.checks.expect import checks_of_table
from mirotwin.verify.checks.interface import in_ms, ms_ticks
from mirotwin.verify.steps.keys import LOOKING, PLAIN, SENDS, VERBS, CheckStep, SaveStep, SilenceStep, Step

S = TypeVar("S", bound=msgspec.Struct)
STATES: dict[str, type[Condition]] = {
    name: kind
    for name, kind in CONDITIONS.items()
    if kind is WheelSpeeds or (issubclass(kind, Followed) and kind.LASTS)
}
"""The conditions that can be held."""
_NO_KEYS = ("number", "checks", "verb", "condition")
_TIMES = {"within_ms": "wait_for and expect", "from_now": "wait_for and expect", "for_ms": "never and hold"}


def steps_of(scenario: Scenario | BoardScenario, origin: str) -> list[Step]:
    """The steps of a scenario, of which each can be done in its run. Raises ScenarioError with the place."""
    steps = [_Table(scenario, origin, index, table).step() for index, table in enumerate(scenario.step)]
    check_order(steps, scenario, origin)
    return steps


def steps_in(text: AnyText) -> list[Step]:
    """The steps of a scenario that was read; an error names the setting that it concerns."""
    try:
        return steps_of(text.scenario, text.origin)
    except ScenarioError as error:
        raise text.blamed(error) from error.__cause__


def check_order(steps: Sequence[Step], scenario: Scenario | BoardScenario, origin: str) -> None:
    """Raises ScenarioError for an impossible sequence of steps: the first step for which the run is too short even if
    waits took no time, and a file that is saved twice.
    """
    end, begins, clock = scenario.end_tick, 0, scenario.clock
    saved: dict[str, int] = {}
    for step in steps:
        place = f"step {step.number}"
        lasts_ticks = ms_ticks(step.lasts_ms, clock)
        last = begins + max(lasts_ticks, ms_ticks(getattr(step, "within_ms", None) or 0.0, clock))
        if begins >= end or last > end:
            goes = f" and goes on to {in_ms(last, clock)}" if last > begins else ""
            begun, ends = in_ms(begins, clock), in_ms(end, clock)
            reason = f"begins after {begun} or later{goes}, but the run ends after {ends}"
            raise ScenarioError(origin, place, reason, "give a longer duration_s, or shorter times")
        begins += lasts_ticks
        if isinstance(step, SaveStep):
            if step.save in saved:
                reason = f"step {saved[step.save]} saves {step.save}, too"
                raise ScenarioError(origin, f"{place}.save", reason, "give each its own name")
            saved[step.save] = step.number


class _Table:
    """A table being read."""

    def __init__(
        self, scenario: Scenario | BoardScenario, origin: str, index: int, table: Mapping[str, Any]
    ) -> None:
        self.scenario = scenario
        self.origin = origin
        self.index = index
        self.table = dict(table)

    def step(self) -> Step:
        verbs = [key for key in VERBS if key in self.table]
        if not verbs:
            known = f"give it one of {', '.join(VERBS)}"
            close = [remedy_for_key(key, list(VERBS)) for key in self.table]
            meant = [remedy for remedy in close if remedy.startswith(("did you", "use "))]
            self.refuse("", "does nothing", meant[0] if meant else known)
        if len(verbs) > 1:
            self.refuse(
                "", f"has both {verbs[0]} and {verbs[1]}", "one action or one wait a step: make two of it"
            )
        step = self._step(verbs[0])
        self.check_subject(step, verbs[0])
        if isinstance(self.scenario, BoardScenario):
            problem = self._place_alone() or step.problem_alone(self.scenario)
        else:
            problem = self._problem_of_robots(step, self.scenario)
        reason, _, remedy = problem.partition("; ")
        if reason:
            key, _, rest = reason.partition(": ")
            self.refuse(key if rest else "", rest or reason, remedy)
        return step

    def check_subject(self, step: Step, verb: str) -> None:
        """Refuses a step for robots on a single board, and vice versa."""
        alone = isinstance(self.scenario, BoardScenario)
        if ("board" if alone else "robot") not in step.subjects:
            value = self.table[verb]
            problem = f"{verb} = {value!r}" if isinstance(value, str) and verb != "press" else verb
            self.refuse(
                verb, f"{problem} is for {'robots' if alone else 'a board with parts'}", self.others(verb)
            )

    def others(self, verb: str) -> str:
        """The verbs possible in its place."""
        kind: Kind = "board" if isinstance(self.scenario, BoardScenario) else "robot"
        choices: Mapping[str, Any] = SENDS if verb == "send" else CONDITIONS if verb in LOOKING else PLAIN
        return use_one_of([name for name, struct in choices.items() if kind in struct.SUBJECTS])

    def _place_alone(self) -> str:
        for key in ("network", "slot"):
            if key in self.table:
                return f"{key}: a board is alone on its line; leave it out"
        return ""

    def _problem_of_robots(self, step: Step, scenario: Scenario) -> str:
        networks = scenario.networks
        if step.network >= len(networks):
            known = use_one_of(map(str, range(len(networks))))
            self.refuse("network", f"there is no network {step.network}", known)
        return step.problem(networks[step.network])

    def _step(self, verb: str) -> Step:
        struct = PLAIN.get(verb) or LOOKING.get(verb) or self.choice(verb, SENDS)
        own = [key for key in struct.__struct_encode_fields__ if key not in _NO_KEYS]
        given: dict[str, Any] = {"number": self.index + 1}
        kinds = STATES if verb == "hold" else CONDITIONS
        kind, inner = None, list[str]()  # of the condition: its struct, its keys
        if struct is SilenceStep:
            inner = ["network"]
            given["condition"] = {"event": "heard"}
        elif verb in LOOKING:
            kind = self.choice(verb, kinds)
            inner = list(kind.__struct_encode_fields__)
            given |= {"verb": verb, "condition": {"event": self.table[verb]}}
        elif verb == "send":
            given["send"] = self.table["send"]
        self.refuse_unknown(verb, [*inner, *own])
        given |= {key: value for key, value in self.table.items() if key in own}
        if inner:
            given["condition"] |= {key: value for key, value in self.table.items() if key in inner}
        step = self.made(given, struct, kind or struct)
        return self.with_checks(step) if isinstance(step, CheckStep) else step

    # Keys

    def choice(self, verb: str, choices: Mapping[str, type[S]]) -> type[S]:
        """The choice that the verb's value names."""
        value = self.table[verb]
        if isinstance(value, str) and value in choices:
            return choices[value]
        event = value.get("event") if isinstance(value, dict) else None  # as `[expect]` has a condition
        if isinstance(event, str) and event in choices:
            self.refuse(verb, "expected a name", f'write {verb} = "{event}", and its other keys beside it')
        reason = f"{value!r} is not one of the choices"
        self.refuse(verb, reason, use_one_of(choices))

    def refuse_unknown(self, verb: str, known: Sequence[str]) -> None:
        for key in self.table:
            if key != verb and key not in known:
                remedy = remedy_for_key(key, list(known))
                if key in _TIMES and not remedy.startswith("use "):
                    missing = "for_ms" in known and "for_ms" not in self.table
                    remedy = "use for_ms, in milliseconds" if missing else f"it belongs to {_TIMES[key]}"
                self.refuse(key, "unknown key", remedy)

    def made(self, given: Mapping[str, Any], struct: type[S], kind: type[msgspec.Struct]) -> S:
        """The step. Errors of msgspec in it, or in its condition of this `kind`, get the scenario's words."""
        try:
            return msgspec.convert(dict(given), struct)
        except msgspec.ValidationError as error:
            reason, _, path = f"{error}".partition(" - at `$")
            path = path.rstrip("`").removeprefix(".condition")
            raw = {"step": [dict(table) for table in self.scenario.step]}
            converted = value_error(self.origin, raw, f"{reason} - at `$.step[{self.index}]{path}`")
            place = re.sub(r"^step\[\d+\]\.?", "", f"{converted.place}")
            self.refuse(
                place,
                converted.what,
                converted.remedy or choices_of(struct, place) or choices_of(kind, place),
            )

    def with_checks(self, step: CheckStep) -> CheckStep:
        """The checks of a step's table, in the words of `[expect]`."""
        place = f"step {self.index + 1}.check"
        made = checks_of_table(self.scenario, self.origin, place, step.check)
        return msgspec.structs.replace(
            step, checks=tuple(check for check in made.values() if check is not None)
        )

    # What is wrong

    def refuse(self, key: str, reason: str, remedy: str = "") -> NoReturn:
        place = f"step {self.index + 1}"
        raise ScenarioError(self.origin, f"{place}.{key}" if key else place, reason, remedy)
