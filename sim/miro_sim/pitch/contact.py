"""Decides if robots touch: squares seen from above, checked at the ticks of a grid in time.

Pushing will need the robots at one tick, so the grid is where they meet.

A check is needed only while two bodies can touch before the next one: they are further apart than their circumscribed
circles, and each of them closes in by no more than its top speed.
"""

from __future__ import annotations

import math

from miro_exact.clock import NEVER_TICK, TICKS_PER_SECOND
from miro_exact.dmath import sincos
from miro_sim.pitch.ground import ROBOT_HALF_M

GRID_TICKS = 24_000
"""1 ms: at 1.46 m/s each two robots close in by 2.9 mm."""
_GRID_TICKS = 24_000  # a C constant when compiled
CIRCLE_M = 0.05304
"""Radius of the circle around it, rounded up."""
Pose = tuple[float, float, float]
"""x and y in m, heading in rad."""


def touch(first: Pose, other: Pose) -> bool:
    """True if two robots' squares overlap or touch (separating axes)."""
    dx, dy = other[0] - first[0], other[1] - first[1]
    sin, cos = sincos(other[2] - first[2])
    reach = ROBOT_HALF_M + ROBOT_HALF_M * (abs(sin) + abs(cos))
    return not (_apart(dx, dy, first[2], reach) or _apart(dx, dy, other[2], reach))


def _apart(dx: float, dy: float, theta_rad: float, reach: float) -> bool:
    """True if a distance is longer than `reach` along one of the axes of a robot."""
    sin, cos = sincos(theta_rad)
    return abs(dx * cos + dy * sin) > reach or abs(dy * cos - dx * sin) > reach


def next_look(tick: int, first: Pose, other: Pose, closing_m_s: float) -> int:
    """The first tick of the grid after `tick` at which they may touch, as they stand at `tick`."""
    dx, dy = other[0] - first[0], other[1] - first[1]
    gap_m = math.sqrt(dx * dx + dy * dy) - 2.0 * CIRCLE_M
    wait = 0
    if gap_m > 0.0:
        if closing_m_s <= 0.0:
            return NEVER_TICK
        seconds = gap_m / closing_m_s
        if seconds > 3600.0:
            return tick + 3600 * TICKS_PER_SECOND
        wait = int(seconds * TICKS_PER_SECOND)
    return ((tick + wait) // _GRID_TICKS + 1) * _GRID_TICKS
