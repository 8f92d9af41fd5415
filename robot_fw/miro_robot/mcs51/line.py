"""A wire's level over time: driven by one chip and sampled by another.

The chips at both ends interpret the levels (a UART bit, a strobe).

A Line has one producer, which appends edges in order and says up to where its content is final, and consumers
that never look beyond that tick. Edges live in a ring; the consumer forgets what is no longer needed. A line
without a consumer (`unread`) drops its oldest edges when the ring is full; on any other the ring grows.

What bounds the ring of a line that is listened to (TXD of a robot in a network): a CPU stops when more than
2048 edges wait to be heard (`full`), and the listener hears them before the CPU goes on. An edge that was heard may
still be needed for as long as the radio delays it and a bit of the PC lasts. A port pin and the shift clock of the
serial port make at most three edges a machine cycle, so a ring holds at most (latency + 2500) / 4 + 2048 edges
and those of one instruction.
"""

from __future__ import annotations

from array import array

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK, Items

_SIZE = 4096  # places of a new ring; always a power of two
_WAITING = 2048  # edges that may wait for the listener before the line is full
_MOST = 1 << 22  # edges of a saved line: more than the longest delay keeps


class Line:
    """Levels (0, 1) over ticks. `settled_tick`: content is final for every tick below it.

    `full`: more than 2048 edges have come since `hear`. The tick of the 2048th is `full_tick`.
    """

    STATE = {
        "settled_tick": TICK,
        "_before": FLAG,
        "ticks": Items("q", _MOST, 0, NEVER_TICK, ordered=True),
    }
    NOT_STATE = (
        *("_ticks", "_mask", "_first", "_end"),  # the ring that `ticks` are kept in
        *("_cursor", "unread"),  # `_cursor`: cache of the last query; `unread`: wiring
        *("_heard", "full"),  # what was heard: the listener says it after a load
    )

    def __init__(self, initial: int = 1) -> None:
        self.settled_tick = 0
        self.unread = False
        self.full = False
        self._ticks = array("q", bytes(8 * _SIZE))
        self._mask = _SIZE - 1
        self._before = initial  # level before the oldest edge kept; each edge toggles
        self._first = 0  # serial numbers of the oldest edge kept and of the next one
        self._end = 0
        self._cursor = 0  # serial number of the first edge after the tick last asked for
        self._heard = 0  # ... of the first edge that was not heard yet

    def append(self, tick: int, level: int) -> None:
        """The wire has `level` from `tick` on.

        No edge if that is no change; replaces an edge on the same tick. Raises ValueError on a tick before
        the last edge.
        """
        # Two writes to a pin on one tick are one level: what was there for no time is no edge.
        if self._end > self._first and tick <= self._ticks[(self._end - 1) & self._mask]:
            self._change_last(tick, level)
        elif level != self._last_level():
            if self._end - self._first > self._mask:
                self._make_room()
            self._ticks[self._end & self._mask] = tick
            self._end += 1
            if self._end - self._heard > _WAITING:
                # Nobody waits for an unread line, and the CPU must not stop for it.
                self.full = not self.unread

    def _change_last(self, tick: int, level: int) -> None:
        """Changes the level on the tick of the last edge. Edges alternate, so this removes that edge."""
        last = self.last_tick()
        if tick < last:
            raise ValueError(f"edge at tick {tick} comes after one at tick {last}")
        if level != self._last_level():
            self._end -= 1
            # Else both would pass over the edge that takes the place of the one that is gone.
            if self._cursor > self._end:
                self._cursor = self._end
            if self._heard > self._end:
                self._heard = self._end

    def _make_room(self) -> None:
        """The ring is full: drops the older half if no listener reads the line, else doubles it."""
        if self.unread:
            self._first += (self._mask + 1) // 2  # an even number: the level before the oldest edge stays
            self._cursor = max(self._cursor, self._first)
            self._heard = max(self._heard, self._first)
        else:
            self._resize(2 * (self._mask + 1))

    def _resize(self, size: int) -> None:
        """A ring of `size` places with the same edges in it."""
        old, old_mask = self._ticks, self._mask
        self._ticks = array("q", bytes(8 * size))
        self._mask = size - 1
        # Edges keep their serial numbers, so cursors stay valid; only their places change.
        for serial in range(self._first, self._end):
            self._ticks[serial & self._mask] = old[serial & old_mask]

    def level_at(self, tick: int) -> int:
        """Level after all edges with edge tick <= `tick`."""
        self._seek(tick)
        # Levels are not stored: each edge is a change, so their number tells.
        return self._before ^ ((self._cursor - self._first) & 1)

    def next_edge(self, tick: int) -> int:
        """Tick of the first edge strictly after `tick`, NEVER_TICK if none is known."""
        self._seek(tick)
        if self._cursor == self._end:
            return NEVER_TICK
        return self._ticks[self._cursor & self._mask]

    def edge_at(self, tick: int) -> int:
        """Tick of the last edge kept up to `tick`, -1 without one."""
        self._seek(tick)
        return self._ticks[(self._cursor - 1) & self._mask] if self._cursor > self._first else -1

    def samples(self, tick: int, step: int, width: int, end: int, most: int) -> int:
        """Levels at `tick`, `tick` + `step` .., at most `most` of 10: bit by bit, with their number from bit 16 on.

        Up to the first that does not hold until `width` ticks later, with that before `end`.
        """
        self._seek(tick)
        cursor = self._cursor
        level = self._before ^ ((cursor - self._first) & 1)
        edge = self._ticks[cursor & self._mask] if cursor < self._end else NEVER_TICK
        levels = 0
        taken = 0
        # A bit whose level changes between its votes is left to the caller, which takes them one by one.
        while taken < most and tick + width < edge and tick + width < end:
            levels |= level << taken
            taken += 1
            tick += step
            while edge <= tick:
                level ^= 1
                cursor += 1
                edge = self._ticks[cursor & self._mask] if cursor < self._end else NEVER_TICK
        self._cursor = cursor
        return taken << 16 | levels

    def forget(self, tick: int) -> None:
        """Drops the edges that no query at `tick` or later needs."""
        self._seek(tick)
        # Each edge that is dropped has toggled the level.
        self._before ^= (self._cursor - self._first) & 1
        self._first = self._cursor
        # What is dropped cannot be heard any more; `full` would count it for ever.
        if self._heard < self._first:
            self._heard = self._first

    def hear(self, tick: int) -> None:
        """The listener has read all edges below `tick`; later ones wait."""
        # Below `tick`, not on it: an edge there may still be taken back by a second write.
        while self._heard < self._end and self._ticks[self._heard & self._mask] < tick:
            self._heard += 1
        self.full = self._end - self._heard > _WAITING and not self.unread

    def full_tick(self) -> int:
        """Tick of the 2048th edge that waits for its consumer; NEVER_TICK if there are fewer."""
        if self._end - self._heard < _WAITING:
            return NEVER_TICK
        return self._ticks[(self._heard + _WAITING - 1) & self._mask]

    def edges(self) -> list[tuple[int, int]]:
        """The edges kept, oldest first, as (tick, level)."""
        first = self._before ^ 1
        return [(tick, first ^ (place & 1)) for place, tick in enumerate(self.ticks)]

    def last_tick(self) -> int:
        """Tick of the last edge kept, -1 without one."""
        return self._ticks[(self._end - 1) & self._mask] if self._end > self._first else -1

    def _last_level(self) -> int:
        return self._before ^ ((self._end - self._first) & 1)

    def _seek(self, tick: int) -> None:
        """Queries mostly walk forward, so the cursor walks with them."""
        cursor = self._cursor
        while cursor < self._end and self._ticks[cursor & self._mask] <= tick:
            cursor += 1
        # Back as well: the receiver has looked ahead for the next start bit, or at a bit that is not over.
        while cursor > self._first and self._ticks[(cursor - 1) & self._mask] > tick:
            cursor -= 1
        self._cursor = cursor

    @property
    def ticks(self) -> list[int]:
        """Ticks of the edges kept, oldest first."""
        return [self._ticks[serial & self._mask] for serial in range(self._first, self._end)]

    @ticks.setter
    def ticks(self, ticks: list[int]) -> None:
        """All edges count as unread, until the listener calls `hear`."""
        size = _SIZE
        # A power of two, because places are serial numbers under a mask.
        while size < len(ticks):
            size *= 2
        if size != self._mask + 1:
            self._resize(size)
        self._first = 0
        self._end = 0
        for tick in ticks:
            self._ticks[self._end] = tick
            self._end += 1
        self._cursor = 0
        self._heard = 0
        # Nothing was read yet, but `full` has to be known before the CPU goes on.
        self.hear(0)

    def __repr__(self) -> str:
        kept = self.edges()
        edges = ", ".join(f"{tick}:{level}" for tick, level in kept[max(0, len(kept) - 4) :])
        return f"Line(settled_tick={self.settled_tick}, level={self._last_level()}, last edges [{edges}])"
