"""Records the nets and parts of a running board: all edges, and all changes of values.

Values are sampled every millisecond and right after each put (`Changes`). Data too dense to be drawn is thinned here,
so that a page can mark the places.
"""

from __future__ import annotations

from array import array
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from miro_robot.parts.nets import Observer
from miro_robot.wired_board import WiredBoard
from miro_sim.periods import Period
from miro_sim.world.world import World

MOST_EDGES = 6000
"""Largest number of edges of a net that are drawn one by one."""
MOST_VALUES = 3000
"""Largest number of changes stored for a value."""
TOGETHER = 3
"""Fewer edges than that in a stretch are drawn one by one."""


class Wave(NamedTuple):
    """A net: `level` at the begin, and the ticks of its edges. `on_it`: the pins of parts there."""

    name: str
    on_it: list[str]
    level: int
    ticks: Any

    def drawn(self, span: int) -> tuple[Any, Any]:
        """In `span` ticks: edges that are drawn one by one, and stretches of edges too close for that: first, last."""
        ticks, near = self.ticks, 0
        while True:
            begins = np.concatenate(([0], np.flatnonzero(np.diff(ticks) >= near) + 1))
            sizes = np.diff(np.append(begins, len(ticks)))
            close = sizes >= TOGETHER
            alone = ticks[np.repeat(~close, sizes)]
            if len(alone) + 2 * close.sum() <= MOST_EDGES:
                return alone, np.stack((ticks[begins[close]], ticks[(begins + sizes - 1)[close]]), axis=1)
            near = max(span // MOST_EDGES, 2 * near, 1)


class Changed(NamedTuple):
    """The values at `path`, and since when each was there; `changes`: how often, also where it is thinned."""

    path: str
    ticks: list[int]
    values: list[Any]
    changes: int


class BoardWatch:
    """Watches the first board of a world from its present tick to its end; the run's bits do not change."""

    def __init__(self, world: World) -> None:
        self._world, self.begin_tick = world, world.tick
        device, self._changes = world.devices[0], world.devices[0].changes
        self._values = {path: ([world.tick], [value]) for path, value in device.values().items()}
        self._edges: list[array[int]] = []
        if not isinstance(device.board, WiredBoard):
            return  # a processor with nothing on its pins
        nets = self._nets = device.board.nets
        self._observer = Observer(range(len(nets.all_names)))
        nets.observe(self._observer)
        self._levels = list(nets.levels)
        self._edges = [array("q") for _ in nets.all_names]
        for path in self._values:
            self._changes.watch_value(path, world.tick)
        self._serial = self._changes.values.end
        world.observers.append(self._look)

    def _look(self, period: Period) -> None:
        """Copies the period's events before the logs overwrite them."""
        for tick, net, _ in self._observer.take(self._world.tick):
            self._edges[net].append(tick)
        log = self._changes.values
        for tick, path, value in log.since(self._serial, self._world.tick + 1):
            ticks, values = self._values[path]
            ticks.append(tick)
            values.append(value)
        self._serial = log.end

    def waves(self, first_tick: int, end_tick: int) -> list[Wave]:
        """The nets that moved within these ticks, in the order of the board."""
        waves = []
        for net, edges in enumerate(self._edges):
            ticks = np.array(edges, dtype=np.int64)
            before, after = (int(at) for at in np.searchsorted(ticks, (first_tick, end_tick)))
            if after > before:
                level = self._levels[net] ^ before & 1
                waves.append(Wave(self._nets.all_names[net], self._on(net), level, ticks[before:after]))
        return waves

    def _on(self, net: int) -> list[str]:
        return [
            f"{part.name}.{pin.name}"
            for part, places in zip(self._nets.parts, self._nets.netlist.parts, strict=True)
            for pin, place in zip(part.keys.PINS, places, strict=True)
            if place.net == net
        ]

    def values(self, first_tick: int, end_tick: int) -> list[Changed]:
        """All values within these ticks; the first one is the value at `first_tick`."""
        changed = []
        for path, (ticks, values) in self._values.items():
            first = max(0, int(np.searchsorted(ticks, first_tick, side="right")) - 1)
            end = int(np.searchsorted(ticks, end_tick))
            kept = _thinned(values, first, end)
            since = [max(first_tick, ticks[at]) for at in kept]
            changed.append(Changed(path, since, [values[at] for at in kept], end - first - 1))
        return changed

    def changes(self, end_tick: int) -> list[tuple[int, str, str, Any]]:
        """All nets and values at the begin, then each change: tick, kind, name, new value."""
        rows = [
            (tick, "value", path, value)
            for path, (ticks, values) in self._values.items()
            for tick, value in zip(ticks, values, strict=True)
        ]
        for net, edges in enumerate(self._edges):
            name, level, ticks = self._nets.all_names[net], self._levels[net], (self.begin_tick, *edges)
            rows += [(tick, "net", name, level ^ number & 1) for number, tick in enumerate(ticks)]
        return sorted((row for row in rows if row[0] < end_tick), key=itemgetter(0))


def _thinned(values: list[Any], first: int, end: int) -> list[int]:
    """The indices to keep: all; if there are too many, the first, least, greatest and last of each stretch."""
    if end - first <= MOST_VALUES:
        return list(range(first, end))
    size, kept = -(-4 * (end - first) // MOST_VALUES), set[int]()

    def order(at: int) -> tuple[bool, Any]:  # parts may have a number or a word
        return isinstance(values[at], str), values[at]

    for begin in range(first, end, size):
        part = range(begin, min(begin + size, end))
        kept |= {part[0], min(part, key=order), max(part, key=order), part[-1]}
    return sorted(kept)
