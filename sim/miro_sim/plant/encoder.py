"""A two-channel incremental encoder on a motor shaft: angle in, edges with their ticks out.

Count n stands for positions n <= p < n + 1 (in quarter lines). Forward A leads B: (A, B) goes 00, 10, 11, 01.
Inside a step the shaft turns evenly; an edge falls on the first integer tick at which p has the new count.
"""

from __future__ import annotations

from miro_robot.lm629.chip import Lm629

_MOST_COUNTS = 1 << 50  # doubles still hold fractions of it


class Quadrature:
    """Position (counts, float) of one shaft and what A and B show of it."""

    STATE = {
        "position": ("d", -_MOST_COUNTS, _MOST_COUNTS),
        "count": ("q", -_MOST_COUNTS, _MOST_COUNTS),
    }
    NOT_STATE = ("counts_per_radian", "counts_per_turn")

    def __init__(self, counts_per_radian: float, counts_per_turn: int = 0) -> None:
        self.counts_per_radian = counts_per_radian
        self.counts_per_turn = counts_per_turn  # 0: there is no index channel
        self.position = 0.5  # the rotor stands in the middle of a quarter line
        self.count = 0

    def turn(self, radians: float, start_tick: int, ticks: int, chip: Lm629 | None) -> None:
        """Turns the shaft evenly from `start_tick` on for `ticks`, and tells the LM629 of its edges in order.

        The index channel changes with A and B.
        """
        moved = radians * self.counts_per_radian
        start = self.position
        self.position = start + moved
        last = int(self.position)
        if last > self.position:
            last -= 1
        count = self.count
        if last == count:
            return
        ticks_per_count = ticks / moved
        while count != last:
            forward = last > count
            boundary = count + 1 if forward else count
            exact = (boundary - start) * ticks_per_count
            after = int(exact)
            if not forward or after < exact:
                after += 1  # forward the first tick at or after the crossing, backward the first beyond it
            after = min(max(after, 1), ticks)
            count += 1 if forward else -1
            self.count = count
            if chip is not None:
                chip.set_encoder(start_tick + after, ((count + 1) >> 1) & 1, (count >> 1) & 1)
                if self.counts_per_turn:
                    chip.set_index(start_tick + after, self.index())

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
        """Raises ValueError unless A and B show the position."""
        if not self.count <= self.position < self.count + 1:
            raise ValueError(f"count is {self.count} at position {self.position}")

    def __repr__(self) -> str:
        return f"Quadrature(position={self.position!r} A={self.a()} B={self.b()})"
