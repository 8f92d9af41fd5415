"""Checks of one condition: that it becomes true between two ticks, or that it never does.

A wait that failed becomes one of these, so that its case can be judged again.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import msgspec
from msgspec import Meta

from miro_exact.clock import NEVER_TICK
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.conditions import Condition, Followed, OnBoard, Recorded, Text
from miro_sim.world.events import PC, Event
from mirotwin.verify.checks.following import Following, event_of, unknown_source
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, SubjectKind, in_ms

Tick = Annotated[int, Meta(ge=-1, lt=NEVER_TICK)]


class ConditionCheck(Check, frozen=True, kw_only=True):
    """A condition after `after_tick`, up to `until_tick`."""

    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("robot", "board")
    condition: Recorded | OnBoard
    after_tick: Tick = -1
    until_tick: Tick

    def __post_init__(self) -> None:
        if self.until_tick <= self.after_tick:
            raise ValueError(f"until_tick {self.until_tick}: give one after after_tick {self.after_tick}")

    def problem(self, end_tick: int) -> str:
        if self.until_tick > end_tick:
            return f"until_tick {self.until_tick} is after the end of the run, tick {end_tick}"
        return ""

    def problem_alone(self, scenario: BoardScenario) -> str:
        return unknown_source(self.condition, scenario)

    def monitor(self, subject: Subject) -> Monitor[Check]:
        if isinstance(self.condition, Followed | Text):
            return FollowedMonitor(self, subject)
        return ConditionMonitor(self, subject)


class Happens(ConditionCheck, frozen=True, kw_only=True, tag="happens"):
    """The condition becomes true after `after_tick`, up to `until_tick`."""

    KIND: ClassVar[Kind] = "liveness"


class NeverHappens(ConditionCheck, frozen=True, kw_only=True, tag="never_happens"):
    """The condition does not become true after `after_tick`, up to `until_tick`."""

    KIND: ClassVar[Kind] = "safety"


class ConditionMonitor(Monitor[ConditionCheck]):
    """Judges at one robot: that of the condition, or for one of the PC the first of the network."""

    def __init__(self, check: ConditionCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.EVENTS = (check.condition.what,)
        slot = check.condition.at_slot(subject.first_slot)
        place = (check.condition.network, subject.first_slot if slot == PC else slot)
        self.done = place != (subject.network, subject.slot)
        self.wanted = wanted(check, subject)

    def event(self, event: Event) -> None:
        self.until(event.tick)
        inside = self.check.after_tick < event.tick <= self.check.until_tick
        if self.done or not inside or not self.check.condition.met_by(event):
            return
        self.done = True
        self.judged += 1
        if self.check.KIND == "safety":
            self.fail(event.tick, self.wanted, str(event).partition(": ")[2])

    def until(self, tick: int) -> None:
        if self.done or tick <= self.check.until_tick:
            return
        self.done = True
        self.judged += 1
        if self.check.KIND == "liveness":
            self.fail(self.check.until_tick, self.wanted, "none")

    def end(self, tick: int) -> None:
        self.until(tick + 1)


class FollowedMonitor(Monitor[ConditionCheck]):
    """Judges the pins, values and text of a board."""

    def __init__(self, check: ConditionCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.EVENTS = ("heard",) if isinstance(check.condition, Text) else ()
        self.wanted = wanted(check, subject)
        self.following = Following(check.condition, subject, max(check.after_tick, 0))
        self.unseen = self.following.unseen
        self.done = bool(self.unseen)

    def event(self, event: Event) -> None:
        if event.tick <= self.check.until_tick:
            self.following.heard(event)

    def until(self, tick: int) -> None:
        if self.done:
            return
        until_tick = self.check.until_tick
        matches = self.following.matches(min(tick, until_tick))
        if not matches and tick <= until_tick:
            return
        self.done = True
        self.judged += 1
        if matches and self.check.KIND == "safety":
            self.fail(matches[0][0], self.wanted, event_of(self.check.condition, matches[0]))
        elif not matches and self.check.KIND == "liveness":
            self.fail(until_tick, self.wanted, self.following.found())

    def end(self, tick: int) -> None:
        self.until(tick + 1)


def wanted(check: ConditionCheck, subject: Subject) -> str:
    """The condition of a check, in words."""
    duration = in_ms(check.until_tick - max(check.after_tick, 0), subject.clock)
    if check.KIND == "liveness":
        return f"{check.condition} within {duration}"
    return f"no {check.condition} for {duration}"


def expect_of(
    check: str, condition: Condition, after_tick: int, until_tick: int, alone: bool = False
) -> dict[str, Any] | None:
    """The `[expect]` table of `happens` or `never_happens`; None where no check can judge it, as of a robot's pins.

    `alone`: of a board alone.
    """
    if not isinstance(condition, Recorded | OnBoard if alone else Recorded):
        return None
    given = {"condition": msgspec.to_builtins(condition), "after_tick": after_tick, "until_tick": until_tick}
    return {check: given}
