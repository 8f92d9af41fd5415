"""The data slicer of a receiver: a threshold that follows the mean of the signal it decides about.

The discriminator puts out +1 for mark and -1 for space (here times 65536), plus a constant `offset` while
there is a carrier (the crystals of the two ends differ), and noise of mean 0 without one. The threshold is
that, smoothed with one time constant (AC coupling): at rest it is at 0, so after key-up it has to climb to
`offset` first, and a run of equal bits draws it towards their level. A mark is decided with the margin
1 - threshold + offset, a space with 1 + threshold - offset.
"""

from __future__ import annotations

from miro_exact.state import TICK
from miro_sim.radio.params import SlicerParams, margin_table

_BIT = 2500
_ONE = 65536
_TABLE = 513
_STEP = 9  # 65536 / 128: a margin in steps of the table


class Slicer:
    """State: `mean` is the threshold at `tick`, since when the input is `signal` (1, -1, or 0: no carrier)."""

    STATE = {"tick": TICK, "signal": ("i", -1, 1), "mean": ("q", -4 * 65536, 4 * 65536)}
    NOT_STATE = ("gain", "offset", "table")

    def __init__(self, params: SlicerParams, eb_n0_db: float) -> None:
        self.gain = params.gain
        self.offset = params.offset_units
        self.table = list(margin_table(eb_n0_db))
        self.tick = 0
        self.signal = 0
        self.mean = 0

    def __repr__(self) -> str:
        return f"Slicer(tick={self.tick}, signal={self.signal}, mean={self.mean})"

    def hear(self, tick: int, signal: int) -> None:
        """From `tick` on, not before the last one, the input is `signal`."""
        target = self.signal * _ONE + self.offset if self.signal else 0
        left = tick - self.tick
        while left > 0:
            step = min(left, _BIT)
            change = ((target - self.mean) * (self.gain * step // _BIT)) >> 16
            if change == 0 and step == _BIT:
                break  # it has arrived
            self.mean += change
            left -= step
        self.tick = tick
        self.signal = signal

    def threshold(self, level: int) -> int:
        """The chance, times 2^32, that a bit of this level is decided wrongly now."""
        margin = self.mean - self.offset
        if level:
            margin = -margin
        index = (margin + 2 * _ONE) >> _STEP  # the table begins at a margin of -1, which is 1 + margin here
        return self.table[min(max(index, 0), _TABLE - 1)]
