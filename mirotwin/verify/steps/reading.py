"""A scenario's `[[step]]` tables to steps, and in one line what is wrong with one of them.

[[step]]
send = "team"                          the verb, and for some what of it
left_m_s = 0.2                         its keys
note = "drives off"                    for people
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NoReturn, TypeVar

import msgspec

from miro_sim.scenario.errors import ScenarioError, choices_of, remedy_for_key, use_one_of, value_error
from miro_sim.scenario.keys import Scenario
from miro_sim.world.conditions import CONDITIONS, Heard, WheelSpeeds
from mirotwin.verify.checks.expect import checks_of_table, expectations_of
from mirotwin.verify.checks.interface import in_ms
from mirotwin.verify.steps.keys import (
    PLAIN,
    SENDS,
    VERBS,
    CheckStep,
    HoldStep,
    NeverStep,
    PauseMs,
    SaveStep,
    Step,
    WaitStep,
    WithinMs,
)

S = TypeVar("S", bound=msgspec.Struct)
_NO_KEYS = ("number", "checks")
_TIMES = {"within_ms": "wait_for and expect", "from_now": "wait_for and expect", "for_ms": "never and hold"}
_TIMES_OF = {
    "wait_for": ("within_ms", "from_now"),
    "expect": ("within_ms", "from_now"),
    "never": ("for_ms",),
    "hold": ("for_ms",),
}


def steps_of(scenario: Scenario, origin: str) -> list[Step]:
    """The steps of a scenario, of which each can be done in its run. Raises ScenarioError with the place."""
    steps = [_Table(scenario, origin, index, table).step() for index, table in enumerate(scenario.step)]
    check_order(steps, scenario, origin)
    return steps


def everything(scenario: Scenario, origin: str) -> None:
    """What a scenario says to checks and in steps: raises ScenarioError for what cannot be meant."""
    expectations_of(scenario, origin)
    steps_of(scenario, origin)


def problem(step: Step, scenario: Scenario) -> str:
    """Why this step cannot be done in this scenario, as `key: what; remedy`, or the empty string."""
    networks = scenario.networks
    if step.network >= len(networks):
        return f"network: there is no network {step.network}; {use_one_of(map(str, range(len(networks))))}"
    return step.problem(networks[step.network])


def check_order(steps: Sequence[Step], scenario: Scenario, origin: str) -> None:
    """Raises ScenarioError for what the steps together make impossible.

    That is the first step for which the run is too short, if all waits took no time at all, and a file that is saved
    twice.
    """
    end, begins = scenario.end_tick, 0
    saved: dict[str, int] = {}
    for step in steps:
        place = f"step {step.number}"
        last = begins + step.needs_ticks()
        if begins >= end or last > end:
            goes = f" and goes on to {in_ms(last)}" if last > begins else ""
            what = f"begins after {in_ms(begins)} or later{goes}, but the run ends after {in_ms(end)}"
            raise ScenarioError(origin, place, what, "give a longer duration_s, or shorter times")
        begins += step.lasts_ticks()
        if isinstance(step, SaveStep):
            if step.save in saved:
                what = f"step {saved[step.save]} saves {step.save}, too"
                raise ScenarioError(origin, f"{place}.save", what, "give each its own name")
            saved[step.save] = step.number


class _Table:
    """One table to be read."""

    def __init__(self, scenario: Scenario, origin: str, index: int, table: Mapping[str, Any]) -> None:
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
        what, _, remedy = problem(step, self.scenario).partition("; ")
        if what:
            key, _, rest = what.partition(": ")
            self.refuse(key if rest else "", rest or what, remedy)
        return step

    def _step(self, verb: str) -> Step:
        if verb in PLAIN:
            struct = PLAIN[verb]
            self.refuse_unknown([key for key in struct.__struct_encode_fields__ if key not in _NO_KEYS])
            plain = self.made(struct, {**self.table, "number": self.index + 1})
            return self.with_checks(plain) if isinstance(plain, CheckStep) else plain
        note: str = self.taken("note", str, "")
        common: dict[str, Any] = {"number": self.index + 1, "note": note}
        if verb == "send":
            return self.rest(self.choice(verb, SENDS), verb, common, **common)
        if verb == "silence_for_ms":
            for_ms = self.taken(verb, PauseMs)
            return NeverStep(condition=self.rest(Heard, verb, hidden=("byte",)), for_ms=for_ms, **common)
        kind = self.choice(verb, {"wheels": WheelSpeeds} if verb == "hold" else CONDITIONS)
        if verb in ("never", "hold"):
            self.need_for_ms()
            for_ms = self.taken("for_ms", PauseMs)
            what = self.rest(kind, verb)
            if isinstance(what, WheelSpeeds) and verb == "hold":
                return HoldStep(condition=what, for_ms=for_ms, **common)
            return NeverStep(condition=what, for_ms=for_ms, **common)
        within_ms = self.taken("within_ms", WithinMs, None)
        from_now = self.taken("from_now", bool, False)
        what = self.rest(kind, verb)
        return WaitStep(verb=verb, condition=what, within_ms=within_ms, from_now=from_now, **common)  # type: ignore[arg-type]

    # Keys

    def taken(self, key: str, type_: Any, default: Any = ...) -> Any:
        """The value of a key that is no key of the condition or frame, taken out of the table."""
        if default is not ... and key not in self.table:
            return default
        try:
            return msgspec.convert(self.table.pop(key), type_)
        except msgspec.ValidationError as error:
            self.refuse_value(f"{error} - at `$.{key}`")

    def need_for_ms(self) -> None:
        if "for_ms" in self.table:
            return
        for key in self.table:
            remedy = remedy_for_key(key, ["for_ms"])
            if key in _TIMES or remedy.startswith("use "):
                self.refuse(key, "unknown key", "use for_ms, in milliseconds")
        self.refuse("for_ms", "this key is missing", "add it")

    def choice(self, verb: str, choices: Mapping[str, type[S]]) -> type[S]:
        """What the verb's value names."""
        value = self.table[verb]
        if isinstance(value, str) and value in choices:
            return choices[value]
        event = value.get("event") if isinstance(value, dict) else None  # as `[expect]` has a condition
        if isinstance(event, str) and event in choices:
            self.refuse(verb, "expected a name", f'write {verb} = "{event}", and its other keys beside it')
        what = f"{value!r} is not one of the choices"
        self.refuse(verb, what, use_one_of(choices))

    def rest(self, struct: type[S], verb: str, hidden: Iterable[str] = (), **more: Any) -> S:
        """The struct of the keys that are left, and `more`; `verb` named it."""
        self.table.pop(verb, None)
        known = [key for key in struct.__struct_encode_fields__ if key not in hidden]
        self.refuse_unknown([*known, *_TIMES_OF.get(verb, ()), "note"])
        config = struct.__struct_config__
        return self.made(struct, {**self.table, str(config.tag_field): config.tag, **more})

    def refuse_unknown(self, known: Sequence[str]) -> None:
        for key in self.table:
            if key not in known:
                remedy = remedy_for_key(key, list(known))
                if key in _TIMES and not remedy.startswith("use "):
                    remedy = f"it belongs to {_TIMES[key]}"
                self.refuse(key, "unknown key", remedy)

    def made(self, struct: type[S], given: Mapping[str, Any]) -> S:
        try:
            return msgspec.convert(dict(given), struct)
        except msgspec.ValidationError as error:
            self.refuse_value(f"{error}", struct)

    def with_checks(self, step: CheckStep) -> CheckStep:
        """The checks of a step's table, in the words of `[expect]`."""
        place = f"step {self.index + 1}.check"
        made = checks_of_table(self.scenario, self.origin, place, step.check)
        return msgspec.structs.replace(
            step, checks=tuple(check for check in made.values() if check is not None)
        )

    # What is wrong

    def refuse(self, key: str, what: str, remedy: str = "") -> NoReturn:
        place = f"step {self.index + 1}"
        raise ScenarioError(self.origin, f"{place}.{key}" if key else place, what, remedy)

    def refuse_value(self, message: str, struct: type[msgspec.Struct] = Step) -> NoReturn:
        """What msgspec found in a `struct`: its place, value and limits in the words of the scenario."""
        what, _, path = message.partition(" - at `$")
        raw = {"step": [dict(table) for table in self.scenario.step]}
        found = value_error(self.origin, raw, f"{what} - at `$.step[{self.index}]{path.rstrip('`')}`")
        place = re.sub(r"^step\[\d+\]\.?", "", f"{found.place}")
        self.refuse(place, found.what, found.remedy or choices_of(struct, place))
