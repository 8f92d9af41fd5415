"""What went into a world from outside: all that its hosts sent, and all that was done to its robots and radios."""

from __future__ import annotations

from miro_protocol.actions import ScriptItem
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from miro_sim.world.world import World


class Trace:
    """Of a world at tick 0 from now on. Raises ValueError for one that has moved.

    A world that loads a saved one needs a trace that knows what happened before: give it as `before`.
    """

    def __init__(self, world: World, before: tuple[ScriptItem, ...] = ()) -> None:
        if world.tick and not before:
            raise ValueError(f"the world is at tick {world.tick}: what happened before is not known")
        self.world = world
        self._happened: list[ScriptItem] = list(before)
        world.observers.append(self._look)

    def _look(self, period: Period) -> None:
        self._happened += [sent for sent in period.wire if sent.direction == DOWN]
        self._happened += period.actions

    def script(self) -> tuple[ScriptItem, ...]:
        """Transmissions of hosts that have been put on the air, and actions that were done, in the order of time."""
        found = list(self._happened)
        if self.world.in_period:
            for network in self.world.networks:
                found += [*network.sent, *network.actions.done]
        return tuple(sorted(found, key=lambda one: one.tick))

    def close(self) -> None:
        """Lets go of the world."""
        self.world.observers.remove(self._look)

    def __repr__(self) -> str:
        return f"Trace({len(self._happened)} actions and transmissions up to tick {self.world.tick})"
