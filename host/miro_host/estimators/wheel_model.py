"""What the wheels do with the commands that were sent: speeds that rise and fall with the LM629's slope.

What belongs here: the way of each rim, from commands at the times of their effect. What does not: when that is, and the
remembering of commands (`ekf`); the way of the robot (`motion`).

    speed
      ^          to ________________        A command takes effect at time 0 and is held until the next one.
      |           /                         The rim's speed goes from `start` to `to` with a constant slope,
      |  start __/                          and stays there. A step of more than slope times period is not
      +---------+--+---------------+-> t    finished when the next command takes effect.
                0  ramp            period

All speeds are those of wheels with the nominal radius.
"""

from collections.abc import Iterator
from typing import NamedTuple


class Ramp(NamedTuple):
    """One wheel under one command: its speed when the command takes effect, and the speed that it is told."""

    start_m_s: float
    to_m_s: float

    def length_s(self, slope_m_s2: float) -> float:
        """How long the speed changes."""
        return abs(self.to_m_s - self.start_m_s) / slope_m_s2

    def speed(self, time_s: float, slope_m_s2: float) -> float:
        """The speed in m/s at `time_s` after the effect."""
        length_s = self.length_s(slope_m_s2)
        if time_s >= length_s:
            return self.to_m_s
        return self.start_m_s + (self.to_m_s - self.start_m_s) * (time_s / length_s)


class Stretch(NamedTuple):
    """A short time and the ways of both rims in it, at constant acceleration."""

    duration_s: float
    left_m: float
    right_m: float


def stretches(left: Ramp, right: Ramp, slope_m_s2: float, begin_s: float, end_s: float) -> Iterator[Stretch]:
    """The motion between two times after the effect of a command, cut where a ramp ends."""
    cuts = sorted((left.length_s(slope_m_s2), right.length_s(slope_m_s2)))
    from_s = begin_s
    for cut_s in (*cuts, end_s):
        to_s = min(cut_s, end_s)
        if to_s > from_s:
            half_s = 0.5 * (to_s - from_s)
            yield Stretch(
                to_s - from_s,
                half_s * (left.speed(from_s, slope_m_s2) + left.speed(to_s, slope_m_s2)),
                half_s * (right.speed(from_s, slope_m_s2) + right.speed(to_s, slope_m_s2)),
            )
            from_s = to_s
