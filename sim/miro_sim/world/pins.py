"""Pins of a robot's board that one can wait for, and their edges with exact ticks.

Encoder channels and busy bits are not among them: the board learns of their edges late.
"""

from __future__ import annotations

from miro_robot.board import Board
from miro_robot.inspect.tap import PLACES, CpuTap, port_pins
from miro_robot.inspect.watcher import attach, detach

_PLACE = {name: place for place, name in enumerate(PLACES)}
_CHIP_PINS = ("cs", "rd", "wr", "ps", "rst", "hi", "pwm", "sign")
_WIRES = ("rxd", "txd", *(f"{side}.{pin}" for side in ("left", "right") for pin in _CHIP_PINS))
_PORT_PINS = {f"P{port}.{bit}": (port, bit) for port in range(4) for bit in range(8)}
PINS = (*_WIRES, *_PORT_PINS)


class PinWatch:
    """Edges of some `pins` of a board, from now until `close`. It costs the CPU its fast loop."""

    def __init__(self, board: Board, pins: frozenset[str]) -> None:
        self.board = board
        self.pins = sorted(pins)
        self.tap = CpuTap(board, lambda: None)
        attach(board.cpu, self.tap)
        self._levels = list(self.tap.start)
        self._shown = {pin: self._level(pin) for pin in self.pins}

    def close(self) -> None:
        detach(self.board.cpu, self.tap)
        self.tap.detach()

    def take(self, known_tick: int) -> list[tuple[int, str, int]]:
        """(tick, pin, level) of the edges up to `known_tick` that were not taken yet, in order."""
        found = []
        events = self.tap.events
        events.sort(key=lambda event: event[0])
        done = 0
        while done < len(events) and events[done][0] <= known_tick:
            tick = events[done][0]
            while done < len(events) and events[done][0] == tick:
                _, place, level = events[done]
                self._levels[place] = level
                done += 1
            for pin in self.pins:
                if self._level(pin) != self._shown[pin]:
                    self._shown[pin] = self._level(pin)
                    found.append((tick, pin, self._shown[pin]))
        del events[:done]
        return found

    def _level(self, pin: str) -> int:
        if pin not in _PORT_PINS:
            return self._levels[_PLACE[pin]]
        port, bit = _PORT_PINS[pin]
        return port_pins(self._levels, port) >> bit & 1
