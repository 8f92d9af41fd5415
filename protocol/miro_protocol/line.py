"""A serial line bit by bit: characters to levels, and a UART's receiver that makes characters of levels.

The receiver is a plain one: it waits for a fall, takes each bit in its middle, and looks for the next fall 10/16 of a
bit after the beginning of the stop bit, as an 8051 does. Where levels hold for whole bits the two agree character by
character; for a level that changes near the middle of a bit they may differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from miro_exact.state import FLAG, TICK, Rows
from miro_protocol.decoder import Symbol
from miro_protocol.table import BITS_PER_CHARACTER, HOST_BIT_TICKS, ROBOT_BIT_TICKS

Edge = tuple[int, int]
"""Tick, and the level from then on."""

_STOP = BITS_PER_CHARACTER - 1


def bits_of(data: bytes) -> list[int]:
    """Start bit, eight data bits low first, stop bit of every character."""
    return [
        level
        for byte in data
        for level in (0, *(byte >> place & 1 for place in range(BITS_PER_CHARACTER - 2)), 1)
    ]


def edges_of(bits: Sequence[int], start_tick: int, bit_ticks: int = HOST_BIT_TICKS) -> list[Edge]:
    """The changes of a line that is mark, carries `bits` from `start_tick` on, and is mark again."""
    edges, before = [], 1
    for place, level in enumerate([*bits, 1]):
        if level != before:
            edges.append((start_tick + place * bit_ticks, level))
        before = level
    return edges


class LineReceiver:
    """A UART's receiver. Fed the edges of a line, in order, it gives the characters that are over."""

    STATE = {"edges": Rows(1 << 20, TICK, FLAG, ordered=True), "level": FLAG, "looking_from": TICK}
    NOT_STATE = ("bit_ticks",)

    def __init__(self, bit_ticks: int = ROBOT_BIT_TICKS) -> None:
        self.bit_ticks = bit_ticks
        self.edges: list[Edge] = []  # not yet gone past
        self.level = 1  # before the first of them
        self.looking_from = 0  # falls before this tick belong to a character

    def feed(self, edges: Iterable[Edge], settled_tick: int) -> list[Symbol]:
        """Characters known once the line is final below `settled_tick`; `edges` are those since the last call."""
        self.edges += edges
        symbols = []
        while (fall := self._fall()) is not None:
            if fall + self._at(_STOP, 10) > settled_tick:
                break
            if self._level(fall + self._at(0, 8)):
                self.looking_from = fall + self._at(0, 10)
                continue
            byte = sum(self._level(fall + self._at(place + 1, 8)) << place for place in range(8))
            symbols.append((byte, self._level(fall + self._at(_STOP, 8)) == 1, fall))
            self.looking_from = fall + self._at(_STOP, 10)
        return symbols

    def _at(self, bit: int, sixteenths: int) -> int:
        return bit * self.bit_ticks + sixteenths * self.bit_ticks // 16

    def _fall(self) -> int | None:
        """The next fall to look at; edges before it are forgotten."""
        while self.edges and (self.edges[0][0] < self.looking_from or self.edges[0][1]):
            self.level = self.edges.pop(0)[1]
        return self.edges[0][0] if self.edges else None

    def _level(self, tick: int) -> int:
        level = self.level
        for at, after in self.edges:
            if at > tick:
                break
            level = after
        return level
