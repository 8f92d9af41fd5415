"""The wire between a radio's receiver and the robot's RXD, with hands on it: bursts of noise and dropped links."""

from __future__ import annotations

from typing import Literal, get_args

from msgspec import Struct

from miro_exact.clock import HOST_BIT_TICKS
from miro_exact.rng import Stream
from miro_exact.state import FLAG, TICK, Rows
from miro_protocol.line import Edge
from miro_robot.mcs51.line import Line

Kind = Literal["burst", "mark"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class Trouble(Struct, frozen=True, array_like=True):
    """From `start_tick` to `end_tick`: "burst" gives fair random bits, "mark" a dropped link with squelch."""

    start_tick: int
    end_tick: int
    kind: Kind


class NoisyWire:
    """Takes levels from `heard`, gives them to `rxd`, but for the troubles announced; seeds as in `rng.Stream`."""

    STATE = {
        "heard": Line,
        "troubles": Rows(
            *(1 << 16, TICK, TICK, ("B", 0, len(KINDS) - 1)),
            split=lambda one: (one.start_tick, one.end_tick, KINDS.index(one.kind)),
            make=lambda cells: Trouble(cells[0], cells[1], KINDS[cells[2]]),
            ordered=True,
        ),
        "settled_tick": TICK,
        "level": FLAG,
    }
    NOT_STATE = ("rxd", "noise")

    def __init__(self, heard: Line, rxd: Line, seed: int, name: str) -> None:
        self.heard = heard
        self.rxd = rxd
        self.noise = Stream(seed, f"{name}/bursts")
        self.troubles: list[Trouble] = []
        self.settled_tick = 0
        self.level = 1
        rxd.settled_tick = 0

    def trouble(self, trouble: Trouble) -> None:
        """Announces one, before the wire is settled there (ValueError) and after all announced before."""
        free = max([self.settled_tick, *(one.end_tick for one in self.troubles)])
        if trouble.start_tick < free:
            raise ValueError(
                f"disturbance at tick {trouble.start_tick} overlaps another one that lasts until tick {free}"
            )
        self.troubles.append(trouble)

    def settle(self) -> list[Edge]:
        """Carries on as far as `heard` goes; returns the new edges of `rxd`."""
        until = self.heard.settled_tick
        ticks = {self.settled_tick}
        ticks.update(tick for tick, _ in self.heard.edges() if tick > self.settled_tick)
        for trouble in self.troubles:
            first = -(-trouble.start_tick // HOST_BIT_TICKS) * HOST_BIT_TICKS
            ticks.update((trouble.start_tick, trouble.end_tick))
            if trouble.kind == "burst":
                ticks.update(range(first, trouble.end_tick, HOST_BIT_TICKS))
        edges = []
        for tick in sorted(ticks):
            if not self.settled_tick <= tick < until:
                continue
            level = self._level(tick)
            if level != self.level:
                self.rxd.append(tick, level)
                edges.append((tick, level))
                self.level = level
        self.heard.forget(until)
        self.settled_tick = self.rxd.settled_tick = until
        self.troubles = [trouble for trouble in self.troubles if trouble.end_tick > until]
        return edges

    def _level(self, tick: int) -> int:
        for trouble in self.troubles:
            if trouble.start_tick <= tick < trouble.end_tick:
                return 1 if trouble.kind == "mark" else self.noise.bit(tick // HOST_BIT_TICKS)
        return self.heard.level_at(tick)
