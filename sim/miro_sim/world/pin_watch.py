"""Edges of the pins of one board, with exact ticks, for a wait."""

from __future__ import annotations

from bisect import bisect_right
from itertools import groupby
from operator import itemgetter

from miro_robot.board import Board
from miro_robot.inspect.tap import OUTSIDE, PLACES, CpuTap, port_pins
from miro_robot.inspect.watcher import attach, detach
from miro_sim.world.device import Device
from miro_sim.world.events import Event
from miro_sim.world.watch import EDGES, Entry

_PLACE = {name: place for place, name in enumerate(PLACES)}
_BY_TICK = itemgetter(0)


class PinWatch:
    """Edges of some `pins` of a robot with exact ticks, from now until `close`. It costs the CPU its fast loop."""

    def __init__(self, robot_id: tuple[int, int], device: Device, pins: set[str]) -> None:
        board = device.board
        self.robot_id = robot_id
        self.board = board
        self.moves = device.pin_moves
        self.pins = sorted(pins)
        self._ports = {pin: device.port_pin(pin) for pin in pins if pin not in _PLACE}
        self.tap = CpuTap(board if isinstance(board, Board) else None, lambda: None)
        attach(board.cpu, self.tap)
        self._levels = list(self.tap.start)
        self._moved = bisect_right(self.moves, self.tap.begin_tick, key=_BY_TICK)
        for _, port, levels in self.moves[: self._moved]:
            self._levels[OUTSIDE + port] = levels
        self.shown = {pin: self._level(pin) for pin in self.pins}

    def close(self) -> None:
        detach(self.board.cpu, self.tap)
        self.tap.detach()

    def take(self, known_tick: int) -> list[Entry]:
        """The edges up to `known_tick` that were not taken yet."""
        entries: list[Entry] = []
        network, slot = self.robot_id
        events = self.tap.events
        moved = bisect_right(self.moves, known_tick, key=_BY_TICK)
        events += [(tick, OUTSIDE + port, levels) for tick, port, levels in self.moves[self._moved : moved]]
        self._moved = max(self._moved, moved)
        events.sort(key=_BY_TICK)
        done = bisect_right(events, known_tick, key=_BY_TICK)
        for tick, changes in groupby(events[:done], key=_BY_TICK):
            for _, place, level in changes:
                self._levels[place] = level
            for number, pin in enumerate(self.pins):
                level = self._level(pin)
                if level != self.shown[pin]:
                    self.shown[pin] = level
                    edge = Event(tick=tick, what="edge", network=network, slot=slot, pin=pin, value=level)
                    entries.append(((tick, network, slot, EDGES + number), edge))
        del events[:done]
        return entries

    def _level(self, pin: str) -> int:
        if pin in _PLACE:
            return self._levels[_PLACE[pin]]
        port, bit = self._ports[pin]
        return port_pins(self._levels, port) >> bit & 1
