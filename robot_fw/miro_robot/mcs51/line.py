"""A wire's level over time: what one chip drove and another one samples.

What belongs here: edges with their ticks, and the queries a sampling receiver needs. What a level means (a
UART bit, a strobe) belongs to the chips at both ends.

A Line has one producer, which appends edges in order and says up to where its content is final, and consumers
that never look beyond that tick. Edges live in a ring; the consumer forgets what is no longer needed. A line
without a consumer (`unread`) drops its oldest edges when the ring is full.
"""

from __future__ import annotations

from typing import Any

FAR = 1 << 62  # "never", for everybody
_FAR = 1 << 62  # the same as a C constant
_MASK = 4095  # ring of 4096 edges
_SIZE = 4096


class Line:
    """Levels (0, 1) over ticks. `settled_tick`: content is final for every tick below it."""

    NOT_STATE = ("_cursor", "unread")  # where the last query ended: a cache; who listens: wiring

    def __init__(self, initial: int = 1) -> None:
        self.settled_tick = 0
        self.unread = False
        self._ticks = [0] * 4096
        self._before = initial  # level before the oldest edge kept; each edge toggles
        self._first = 0  # serial numbers of the oldest edge kept and of the next one
        self._end = 0
        self._cursor = 0  # serial number of the first edge after the tick last asked for

    def append(self, tick: int, level: int) -> None:
        """The wire has `level` from `tick` on.

        No edge if that is no change; replaces an edge on the same tick. Raises ValueError on a tick before
        the last edge, OverflowError when 4096 edges are waiting to be forgotten by somebody.
        """
        if self._end > self._first:
            last = self._ticks[(self._end - 1) & _MASK]
            if tick < last:
                raise ValueError(f"edge at tick {tick} comes after one at tick {last}")
            if tick == last and level != self._last_level():
                self._end -= 1  # edges alternate, so replacing the last one takes it back
                if self._cursor > self._end:
                    self._cursor = self._end
                return
        if level == self._last_level():
            return
        if self._end - self._first == _SIZE and self.unread:
            self._first += _SIZE // 2  # an even number: the level before the oldest edge stays
            self._cursor = max(self._cursor, self._first)
        if self._end - self._first == _SIZE:
            raise OverflowError(f"line holds {_SIZE} edges already at tick {tick}: nobody forgets them")
        self._ticks[self._end & _MASK] = tick
        self._end += 1

    def level_at(self, tick: int) -> int:
        """Level after all edges with edge tick <= `tick`."""
        self._seek(tick)
        return self._before ^ ((self._cursor - self._first) & 1)

    def next_edge(self, tick: int) -> int:
        """Tick of the first edge strictly after `tick`, FAR if none is known."""
        self._seek(tick)
        if self._cursor == self._end:
            return _FAR
        return self._ticks[self._cursor & _MASK]

    def forget(self, tick: int) -> None:
        """Drops the edges that no query at `tick` or later needs."""
        self._seek(tick)
        self._before ^= (self._cursor - self._first) & 1
        self._first = self._cursor

    def edges(self) -> list[tuple[int, int]]:
        """The edges kept, oldest first, as (tick, level)."""
        level = self._before
        kept = []
        for serial in range(self._first, self._end):
            level ^= 1
            kept.append((self._ticks[serial & _MASK], level))
        return kept

    def _last_level(self) -> int:
        return self._before ^ ((self._end - self._first) & 1)

    def _seek(self, tick: int) -> None:
        """Queries mostly walk forward, so the cursor walks with them."""
        cursor = self._cursor
        while cursor < self._end and self._ticks[cursor & _MASK] <= tick:
            cursor += 1
        while cursor > self._first and self._ticks[(cursor - 1) & _MASK] > tick:
            cursor -= 1
        self._cursor = cursor

    def snapshot(self) -> dict[str, object]:
        return {
            "settled_tick": self.settled_tick,
            "before": self._before,
            "ticks": [tick for tick, _ in self.edges()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        ticks = state["ticks"]
        self.settled_tick = state["settled_tick"]
        self._before = state["before"]
        self._first = 0
        self._cursor = 0
        self._end = len(ticks)
        for serial, tick in enumerate(ticks):
            self._ticks[serial] = tick

    def __repr__(self) -> str:
        kept = self.edges()
        edges = ", ".join(f"{tick}:{level}" for tick, level in kept[max(0, len(kept) - 4) :])
        return f"Line(settled_tick={self.settled_tick}, level={self._last_level()}, last edges [{edges}])"
