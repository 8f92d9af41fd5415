"""The wall clock beside virtual time.

A world that is paced is moved on to `Pace.tick()` and never beyond; it may be behind, which is counted.
"""

from __future__ import annotations

import time

from miro_exact.clock import TICKS_PER_SECOND, seconds, ticks

FASTEST = 1000.0
"""Virtual seconds in one, at most."""
LATE_TICKS = ticks(0.020)
"""What counts as late: a little more than the 16 ms for which an adapter of USB may keep a character."""


class Pace:
    """Wall time as ticks from when it was made (or `start`ed): `factor` virtual seconds in one.

    `late_ticks`: the most that a world was behind; `late_s`: virtual time in which it was behind by 20 ms or more.
    """

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor
        self.late_ticks = 0
        self.late_s = 0.0
        self._told_ticks = 0
        self.start(0)

    def start(self, tick: int) -> None:
        """Now is `tick`."""
        self._began_tick = tick
        self._began_s = time.monotonic()

    def tick(self) -> int:
        """Where virtual time should be now."""
        since_s = time.monotonic() - self._began_s
        return self._began_tick + int(since_s * self.factor * TICKS_PER_SECOND)

    def note(self, from_tick: int, to_tick: int, due_tick: int) -> str:
        """Counts that a world went on from one tick to the other when it should have been at `due_tick`.

        By how much it is behind, for people; "" where it is not late, or not twice as late as they were told last.
        """
        behind = due_tick - to_tick
        self.late_ticks = max(self.late_ticks, behind)
        if behind < LATE_TICKS:
            return ""
        self.late_s += seconds(to_tick - from_tick)
        if behind < 2 * self._told_ticks:
            return ""
        self._told_ticks = behind
        return f"{1000.0 * seconds(behind):.0f} ms behind the wall clock"

    def wait_s(self, tick: int) -> float:
        """Wall time until virtual time should be at `tick`; 0 where it should be there already."""
        return max(0, tick - self.tick()) / (self.factor * TICKS_PER_SECOND)

    def sleep_until(self, tick: int) -> None:
        """Sleeps until virtual time should be at `tick`."""
        time.sleep(self.wait_s(tick))
