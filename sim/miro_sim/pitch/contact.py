"""Whether robots touch: squares seen from above, checked at the ticks of a grid in time.

Pushing will need the robots at one tick, so the grid is where they meet.

A check is needed only while two bodies can touch before the next one: they are further apart than their circumscribed
circles, and each of them closes in by no more than its top speed.
"""

from __future__ import annotations

import math

from miro_exact.clock import NEVER_TICK, TICKS_PER_SECOND
from miro_exact.dmath import sincos
from miro_host.posture import Posture
from miro_sim.pitch.ground import ROBOT_HALF_M

GRID_TICKS = 24_000
"""1 ms: at 1.46 m/s each two robots close in by 2.9 mm."""
CIRCLE_M = 0.05304
"""Radius of the circle around it, rounded up."""


def touch(one: Posture, other: Posture) -> bool:
    """Whether two robots' squares overlap or touch (separating axes)."""
    dx, dy = other.x_m - one.x_m, other.y_m - one.y_m
    for square in (one, other):
        sin, cos = sincos(square.theta_rad)
        turned = sincos(other.theta_rad - one.theta_rad)
        reach = ROBOT_HALF_M + ROBOT_HALF_M * (abs(turned[0]) + abs(turned[1]))
        if abs(dx * cos + dy * sin) > reach or abs(dy * cos - dx * sin) > reach:
            return False
    return True


def next_look(tick: int, one: Posture, other: Posture, closing_m_s: float) -> int:
    """The first tick of the grid after `tick` at which they may touch, as they stand at `tick`."""
    dx, dy = other.x_m - one.x_m, other.y_m - one.y_m
    gap_m = math.sqrt(dx * dx + dy * dy) - 2.0 * CIRCLE_M
    wait = 0
    if gap_m > 0.0:
        if closing_m_s <= 0.0:
            return NEVER_TICK
        seconds = gap_m / closing_m_s
        if seconds > 3600.0:
            return tick + 3600 * TICKS_PER_SECOND
        wait = int(seconds * TICKS_PER_SECOND)
    return ((tick + wait) // GRID_TICKS + 1) * GRID_TICKS
