"""Conditions that a check of a board follows itself: its pins, values and text from a tick on."""

from __future__ import annotations

from typing import Any

from miro_exact.clock import CYCLE_TICKS
from miro_exact.plugins import PluginError
from miro_robot.parts.resolve import resolve
from miro_robot.parts.values import checked_read
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.changes import find_pin
from miro_sim.world.conditions import Condition, Followed, OfPin, Text, Value
from miro_sim.world.events import Event
from miro_sim.world.followers import Follower, Match, TextFollower, ValueFollower
from mirotwin.verify.checks.interface import Subject

NO_NETS = "the board has no parts, so nobody keeps what its pins do"


def unknown_source(condition: object, scenario: BoardScenario) -> str:
    """Reason and remedy if a board lacks the pin or value of a condition, as `key: reason; remedy`; else ""."""
    try:
        if isinstance(condition, OfPin):
            board, pin = scenario.at(condition.pin)
            find_pin(board, resolve(board), pin)
        elif isinstance(condition, Value):
            checked_read(scenario.parts, condition.of)
    except ValueError as error:
        return f"{error}" if isinstance(condition, OfPin) else f"of: {error}"
    return ""


class Following:
    """Follows a condition at the board of `subject` from `begin_tick` on, which may be in the future.

    `heard` takes the characters that the PC receives; `matches(tick)` returns the fitting events before `tick`.
    `unseen`: the reason why the board does not show the condition, else "".
    """

    def __init__(self, condition: Condition, subject: Subject, begin_tick: int) -> None:
        self.condition = condition
        self.clock = subject.clock
        self.begin_tick = begin_tick
        self.changes: Any = None
        name = condition.source if isinstance(condition, OfPin | Value) else ""
        if hasattr(subject.device, "source"):
            self.changes, name = subject.device.source(name)
        self.unseen = ""
        self.text: list[tuple[int, Any, Any]] = []
        self.follower: Follower | None = None
        self.serial = 0
        if isinstance(condition, Text):
            self.follower = TextFollower(condition, 0, self.clock)
        elif self.changes is None:
            self.unseen = NO_NETS
        elif isinstance(condition, OfPin):
            self.place = self.changes.find(name)
        elif isinstance(condition, Value):
            now = subject.cpu.cycles * CYCLE_TICKS
            value = self.changes.watch_value(name, now)
            self.serial = self.changes.values.end
            try:
                self.follower = condition.follower(name, 0, self.clock, now, value)
            except ValueError as error:  # a text is no number
                problem, _, remedy = f"{error}".partition("; ")
                raise PluginError(problem, remedy) from None

    def heard(self, event: Event) -> None:
        self.text.append((event.tick, 0, event.value))

    def matches(self, tick: int) -> list[Match]:
        """In the order of time; a state that is there at `begin_tick` already counts from then on."""
        if self.unseen or tick < self.begin_tick:
            return []
        condition, follower = self.condition, self.follower
        if isinstance(condition, Text):
            assert follower is not None
            text, self.text = self.text, []
            return [match for match in follower.feed(text, tick) if match[0] >= self.begin_tick]
        if isinstance(condition, Value):
            assert isinstance(follower, ValueFollower)
            matches = follower.feed(self._new(self.changes.values, tick + 1), tick)
            early = [match for match in matches if match[0] < self.begin_tick]
            if early and follower.fitted and len(early) == len(matches):
                return [(self.begin_tick, follower.last)]
            return matches[len(early) :]
        assert isinstance(condition, OfPin)
        if follower is None:
            level, self.serial = self.changes.level_before(self.place.net, self.begin_tick)
            flip = int(self.place.inverted)
            follower = condition.follower(self.place.net, flip, self.clock, self.begin_tick, level ^ flip)
            self.follower = follower
        return follower.feed(self._new(self.changes.edges, tick), tick)

    def _new(self, log: Any, tick: int) -> list[Any]:
        changes: list[Any] = log.since(self.serial, tick)
        self.serial = max(self.serial, log.first) + len(changes)
        return changes

    def found(self) -> str:
        return self.follower.found() if self.follower is not None else "none"


def event_of(condition: Condition, match: Match) -> str:
    """A match in words."""
    tick, measured = match
    source = condition.source if isinstance(condition, Followed) else ""
    level = measured if condition.what == "edge" else 0
    return f"{Event(tick=tick, what=condition.what, pin=source, value=level, measured=measured)}".split(": ")[
        -1
    ]
