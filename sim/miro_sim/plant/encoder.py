"""A two-channel incremental encoder on a motor shaft: angle in, edges with their ticks out.

Count n stands for positions n <= p < n + 1 (in quarter lines). Forward A leads B: (A, B) goes 00, 10, 11, 01.
Inside a step the shaft turns evenly; an edge falls on the first integer tick at which p has the new count.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import Lm629

_NEVER = NEVER_TICK
_MOST_COUNTS = 1 << 50  # doubles still hold fractions of it


class Quadrature:
    """Position (counts, float) of one shaft and what A and B show of it."""

    STATE = {
        "position": ("d", -_MOST_COUNTS, _MOST_COUNTS),
        "count": ("q", -_MOST_COUNTS, _MOST_COUNTS),
    }
    NOT_STATE = (
        "counts_per_radian",
        "counts_per_turn",
        "edge_tick",
        "_start",
        "_start_tick",
        "_ticks",
        "_ticks_per_count",
        "_last",
    )

    def __init__(self, counts_per_radian: float, counts_per_turn: int = 0) -> None:
        self.counts_per_radian = counts_per_radian
        self.counts_per_turn = counts_per_turn  # 0: there is no index channel
        self.position = 0.5  # the rotor stands in the middle of a quarter line
        self.count = 0
        self.edge_tick = _NEVER  # of the next edge of the step being reported
        self._start = 0.5
        self._start_tick = 0
        self._ticks = 0
        self._ticks_per_count = 0.0
        self._last = 0

    def turn(self, radians: float, start_tick: int, ticks: int) -> None:
        """Turns the shaft evenly from `start_tick` on for `ticks`; its edges then wait in `edge_tick`."""
        moved = radians * self.counts_per_radian
        self._start = self.position
        self.position = self._start + moved
        last = int(self.position)
        if last > self.position:
            last -= 1
        self._last = last
        if last == self.count:
            self.edge_tick = _NEVER
            return
        self._start_tick = start_tick
        self._ticks = ticks
        self._ticks_per_count = ticks / moved
        self._aim()

    def show(self) -> None:
        """Lets the edge at `edge_tick` happen: A and B change, `edge_tick` goes on to the next edge."""
        if self._last > self.count:
            self.count += 1
        else:
            self.count -= 1
        if self._last == self.count:
            self.edge_tick = _NEVER
        else:
            self._aim()

    def report(self, chip: Lm629) -> None:
        """Lets the edge at `edge_tick` happen and tells the LM629 of it. The index channel changes with A and B."""
        tick = self.edge_tick
        self.show()
        chip.set_encoder(tick, self.a(), self.b())
        if self.counts_per_turn:
            chip.set_index(tick, self.index())

    def _aim(self) -> None:
        forward = self._last > self.count
        boundary = self.count + 1 if forward else self.count
        exact = (boundary - self._start) * self._ticks_per_count
        after = int(exact)
        if forward:
            if after < exact:
                after += 1  # the first tick at or after the crossing
        else:
            after += 1  # the first tick beyond it
        after = min(max(after, 1), self._ticks)
        self.edge_tick = self._start_tick + after

    def a(self) -> int:
        """Level of channel A."""
        return ((self.count + 1) >> 1) & 1

    def b(self) -> int:
        """Level of channel B."""
        return (self.count >> 1) & 1

    def index(self) -> int:
        """Level of the index channel: low for one count a turn; high for good without one."""
        return 1 if self.counts_per_turn == 0 or self.count % self.counts_per_turn else 0

    def after_load(self) -> None:
        """No edge is waiting. Raises ValueError unless A and B show the position."""
        self.edge_tick = _NEVER
        if not self.count <= self.position < self.count + 1:
            raise ValueError(f"count is {self.count} at position {self.position}")

    def __repr__(self) -> str:
        return f"Quadrature(position={self.position!r} A={self.a()} B={self.b()})"
