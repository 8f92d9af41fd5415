"""Proves that a hardware fault changed something: a twin continues without it from the same state, and is compared.

Each digest includes the one before and the state at the end of a control period, without armed faults. Up to the fault
both digests are equal; they differ from the first period on at whose end the states differ.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from miro_protocol.actions import Action, Fault
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period
from miro_sim.world.outbox import INJECTED
from miro_sim.world.world import World

T = TypeVar("T")
NO_EFFECT = "the fault changed nothing up to the end of the run"


class Proof:
    """Follows `world` from the announcement of `fault`; `name` begins its messages."""

    def __init__(self, world: World, name: str, fault: Fault) -> None:
        self.name, self.fault = name, fault
        self._state = world.state.save()
        self._periods: list[Period] = []
        # What the state holds already of what the periods name.
        self._sent: list[Transmission] = []
        self._done: list[Action] = []
        self._missing: str | None = None
        for line in world.lines:
            self._sent += line.sent
            self._sent += [waiting.sent for waiting in line.outbox.waiting if waiting.origin == INJECTED]
            self._done += [*line.actions.done, *line.actions.announced()]
        world.observers.append(self._periods.append)

    @classmethod
    def begin(cls, proofs: list[Proof], world: World, name: str, fault: Fault) -> None:
        """Adds the proof of a fault, which is announced next. What is mended need not change anything."""
        if not fault.what.endswith(" ok"):
            proofs.append(cls(world, name, fault))

    def missing(self, make: Callable[[], World]) -> str:
        """Reason why the run proves nothing about this fault; "" if the fault changed something.

        `make()` returns a world in the first state of the followed one.
        """
        if self._missing is None:
            self._missing = self._look(make)
        return self._missing

    def _look(self, make: Callable[[], World]) -> str:
        if not any(self.fault in period.actions for period in self._periods):
            return f"{self.name}: the run ended before the fault"
        twin = make()
        twin.observers.clear()
        twin.go_on_from(self._state)
        later = [action for period in self._periods for action in period.actions if action != self.fault]
        for action in _without(self._done, later):
            twin.do(action)
        for period in self._periods:
            for sent in _without(self._sent, [each for each in period.wire if each.direction == DOWN]):
                # A station's own frame, which the twin computes, too, meets this one and gives way.
                twin.inject(sent.data, sent.network, sent.tick, sent.bad_stop)
            if twin.step().digest != period.digest:
                return ""
        return f"{self.name}: {NO_EFFECT}"


def _without(known: list[T], items: list[T]) -> list[T]:
    """The items that are not in `known`; removes the others from `known`."""
    new = []
    for item in items:
        if item in known:
            known.remove(item)
        else:
            new.append(item)
    return new
