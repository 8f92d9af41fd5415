"""The speed along a path: the greatest within its limits, by one pass forwards and one backwards.

The path is cut into cells. Within a cell the acceleration along the path is constant, so the square of the speed is
linear in the way: z' = 2 a ds. A pass forwards keeps z from growing faster than the acceleration allows, one backwards
from falling faster; what a cell's curvature allows is a bound at both of its ends, so within it, too.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import msgspec


class Bounds(msgspec.Struct, frozen=True):
    """The greatest speed, acceleration along the path and across it, and turning rate."""

    speed_m_s: float
    accel_m_s2: float
    lateral_accel_m_s2: float
    turn_rad_s: float

    def square(self, curvature_per_m: float) -> float:
        """The square of the greatest speed at this curvature, in m2/s2."""
        most = self.speed_m_s * self.speed_m_s
        bend = abs(curvature_per_m)
        if bend > 0.0:
            turning = self.turn_rad_s / bend
            most = min(most, self.lateral_accel_m_s2 / bend, turning * turning)
        return most


class Lap(msgspec.Struct, frozen=True):
    """Cells one after the other: times at their beginnings and at the end, speeds there, and accelerations within."""

    times_s: list[float]
    speeds_m_s: list[float]
    accels_m_s2: list[float]

    @property
    def duration_s(self) -> float:
        return self.times_s[-1]


def at_nodes(
    bounds: Bounds, curvatures_per_m: Sequence[float], closed: bool, limits_m_s: Sequence[float | None] = ()
) -> list[float]:
    """Squares of speed that the nodes allow: the stricter of the cells beside a node counts.

    `limits_m_s`: more bounds of speed, of each cell or of none.
    """
    cells = [bounds.square(curvature) for curvature in curvatures_per_m]
    for number, limit in enumerate(limits_m_s):
        if limit is not None:
            cells[number] = min(cells[number], limit * limit)
    around = min(cells[0], cells[-1]) if closed else 0.0
    inner = [min(before, after) for before, after in pairwise(cells)]
    return [around, *inner, around]


def smooth(squares: Sequence[float], ways_m: Sequence[float], accel_m_s2: float, closed: bool) -> list[float]:
    """The greatest squares of speed below `squares` that keep the acceleration."""
    z = list(squares)
    for _ in range(2 if closed else 1):  # the second time round, the first node has its own bound
        for k, way in enumerate(ways_m):
            z[k + 1] = min(z[k + 1], z[k] + 2.0 * accel_m_s2 * way)
        if closed:
            z[0] = z[-1]
    for _ in range(2 if closed else 1):
        for k in range(len(ways_m) - 1, -1, -1):
            z[k] = min(z[k], z[k + 1] + 2.0 * accel_m_s2 * ways_m[k])
        if closed:
            z[-1] = z[0]
    return z


def run_up(steady: Sequence[float], ways_m: Sequence[float], accel_m_s2: float) -> list[float]:
    """Squares of speed from rest until they are those of the `steady` lap, at the end of one of the laps."""
    z = [0.0]
    while z[-1] < steady[0]:
        for k, way in enumerate(ways_m):
            z.append(min(steady[k + 1], z[-1] + 2.0 * accel_m_s2 * way))
    return z


def timed(squares: Sequence[float], ways_m: Sequence[float]) -> Lap:
    """Times, speeds and accelerations of the cells; the `ways_m` repeat if there are more speeds than cells."""
    speeds = [math.sqrt(z) for z in squares]
    times, accels = [0.0], []
    for k in range(len(speeds) - 1):
        way = ways_m[k % len(ways_m)]
        step_s = 2.0 * way / (speeds[k] + speeds[k + 1])
        accels.append((speeds[k + 1] - speeds[k]) / step_s)
        times.append(times[-1] + step_s)
    return Lap(times, speeds, accels)
