"""A path with a timetable: points with their times, and between them a cubic spline of time in each coordinate.

Position, velocity and acceleration are continuous while it moves. Where points stand still it stands, and comes to rest
before. v, w and their derivatives are those of the spline:

    v = sqrt(x'^2 + y'^2)       w = (x' y'' - y' x'') / v^2
    v' = (x' x'' + y' y'') / v  w' = (x' y''' - y' x''') / v^2 - 2 w v' / v
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import msgspec

from miro_exact.dmath import atan2
from miro_host.posture import Posture
from miro_host.references.interface import Reference, ReferenceParameters, SamplingPace, with_polar_form

MOST_POINTS = 5000
MOST_S = 86_400.0
MOST_CM = 1000.0
LEAST_STEP_S = 1e-3
STANDS_M_S = 1e-3
"""Slower than this it has no direction of its own, but that from point to point."""
LOOKS = 4
"""Places in each piece at which the turning rate is looked for."""

Point = tuple[float, float, float]


class Piece(msgspec.Struct, frozen=True):
    """From one point to the next: places in m, second derivatives at both ends, and the direction of the chord."""

    begin_s: float
    length_s: float
    x: tuple[float, float, float, float]
    y: tuple[float, float, float, float]
    heading_rad: float

    def at(self, t_s: float) -> tuple[list[float], list[float]]:
        """x and y with three derivatives each."""
        return self._course(self.x, t_s), self._course(self.y, t_s)

    def _course(self, ends: tuple[float, float, float, float], t_s: float) -> list[float]:
        a, b, bend_a, bend_b = ends
        h = self.length_s
        to_b = (t_s - self.begin_s) / h
        to_a = 1.0 - to_b
        of_a, of_b = to_a * to_a * to_a - to_a, to_b * to_b * to_b - to_b
        place = to_a * a + to_b * b + (of_a * bend_a + of_b * bend_b) * (h * h / 6.0)
        slope = (b - a) / h + ((3.0 * to_b * to_b - 1.0) * bend_b - (3.0 * to_a * to_a - 1.0) * bend_a) * (
            h / 6.0
        )
        return [place, slope, to_a * bend_a + to_b * bend_b, (bend_b - bend_a) / h]


class Timed:
    """A trajectory through `points`, (t in s, x in m, y in m), in the order of time."""

    def __init__(self, points: Sequence[Point]) -> None:
        self.times_s = [t for t, _, _ in points]
        bends = [_bends(self.times_s, [point[axis] for point in points], _rests(points)) for axis in (1, 2)]
        self.pieces = [
            Piece(
                a[0],
                b[0] - a[0],
                (a[1], b[1], *bends[0][number]),
                (a[2], b[2], *bends[1][number]),
                heading,
            )
            for number, ((a, b), heading) in enumerate(zip(pairwise(points), _headings(points), strict=True))
        ]

    def __repr__(self) -> str:
        return f"Timed({len(self.times_s)} points to {self.times_s[-1]:.3f} s)"

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; it stands before the first point's time and after the last one's."""
        inside_s = min(max(t_s, self.times_s[0]), self.times_s[-1])
        number = min(bisect_right(self.times_s, inside_s), len(self.pieces)) - 1
        (x, dx, d2x, d3x), (y, dy, d2y, d3y) = self.pieces[number].at(inside_s)
        square = dx * dx + dy * dy
        v = math.sqrt(square)
        if v < STANDS_M_S:
            posture = Posture(x, y, self.pieces[number].heading_rad)
            return with_polar_form(posture, 0.0, 0.0, 0.0, 0.0)
        posture = Posture(x, y, atan2(dy, dx))
        if inside_s != t_s:
            return with_polar_form(posture, 0.0, 0.0, 0.0, 0.0)
        w, v_dot = (dx * d2y - dy * d2x) / square, (dx * d2x + dy * d2y) / v
        w_dot = (dx * d3y - dy * d3x) / square - 2.0 * w * v_dot / v
        return with_polar_form(posture, v, w, v_dot, w_dot)

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """By the largest speed and turning rate at points and between them, twice as closely as these need.

        No closer than 1 ms: no robot goes as fast as that would need, and the scenario is refused for its speed.
        """
        end_s = self.times_s[-1]
        looks = (
            self.at(piece.begin_s + piece.length_s * k / LOOKS)
            for piece in self.pieces
            for k in range(LOOKS + 1)
        )
        step_s = end_s or 1.0
        for look in looks:
            step_s = min(
                step_s, 0.5 * step_m / max(look.v_m_s, 1e-9), 0.5 * step_rad / max(abs(look.w_rad_s), 1e-9)
            )
        return SamplingPace(max(step_s, LEAST_STEP_S), end_s, end_s)


def _rests(points: Sequence[Point]) -> list[bool]:
    """For each piece: True if it stands still."""
    return [a[1:] == b[1:] for a, b in pairwise(points)]


def _headings(points: Sequence[Point]) -> list[float]:
    """For each piece: the direction from its first point to its last; a standing piece has the direction of the one
    before.
    """
    known: list[float | None] = [
        None if rests else atan2(b[2] - a[2], b[1] - a[1])
        for (a, b), rests in zip(pairwise(points), _rests(points), strict=True)
    ]
    last = next((heading for heading in known if heading is not None), 0.0)
    headings = []
    for heading in known:
        last = last if heading is None else heading
        headings.append(last)
    return headings


def _bends(
    times: Sequence[float], places: Sequence[float], rests: Sequence[bool]
) -> list[tuple[float, float]]:
    """Second derivatives at both ends of each piece.

    Pieces that move, one after the other, are one spline: at rest where a piece that stands is beside it, and natural
    (not bent) at the ends of the table.
    """
    bends, first = [(0.0, 0.0)] * len(rests), 0
    while first < len(rests):
        last = first
        while last < len(rests) and not rests[last]:
            last += 1
        if last > first:
            at_rest = first > 0, last < len(rests)
            solved = _spline(times[first : last + 1], places[first : last + 1], at_rest)
            bends[first:last] = pairwise(solved)
        first = max(last, first + 1)
    return bends


def _spline(times: Sequence[float], places: Sequence[float], at_rest: tuple[bool, bool]) -> list[float]:
    """Second derivatives of the cubic spline at its points, by elimination along the three diagonals."""
    steps = [b - a for a, b in pairwise(times)]
    slopes = [(b - a) / step for (a, b), step in zip(pairwise(places), steps, strict=True)]
    rows = [(0.0, 2.0 * steps[0], steps[0], 6.0 * slopes[0]) if at_rest[0] else (0.0, 1.0, 0.0, 0.0)]
    for k in range(1, len(steps)):
        jump = 6.0 * (slopes[k] - slopes[k - 1])
        rows.append((steps[k - 1], 2.0 * (steps[k - 1] + steps[k]), steps[k], jump))
    rows.append((steps[-1], 2.0 * steps[-1], 0.0, -6.0 * slopes[-1]) if at_rest[1] else (0.0, 1.0, 0.0, 0.0))
    over, right = [0.0], [0.0]
    for below, middle, above, wanted in rows:
        pivot = middle - below * over[-1]
        over.append(above / pivot)
        right.append((wanted - below * right[-1]) / pivot)
    bends = [0.0]
    for k in range(len(rows), 0, -1):
        bends.append(right[k] - over[k] * bends[-1])
    return bends[:0:-1]


class TimedRef(ReferenceParameters, frozen=True, kw_only=True, tag="timed"):
    """A path with a timetable: `points` are [t in s, x in cm, y in cm], joined by a cubic spline of time.

    It stands before the first time and after the last. Two points of one place are a pause.
    """

    points: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        count = len(self.points)
        if not 2 <= count <= MOST_POINTS:
            raise ValueError(f"points: there are {count}; give 2 to {MOST_POINTS}")
        last_s = -LEAST_STEP_S
        for number, (t_s, x_cm, y_cm) in enumerate(self.points):
            if not 0.0 <= t_s <= MOST_S:
                raise ValueError(
                    f"points[{number}]: the time {t_s:g} s is out of range; give 0 to {MOST_S:g}"
                )
            if not (abs(x_cm) <= MOST_CM and abs(y_cm) <= MOST_CM):
                raise ValueError(
                    f"points[{number}]: ({x_cm:g}, {y_cm:g}) cm is out of range; give -1000 to 1000"
                )
            if t_s - last_s < 0.999 * LEAST_STEP_S:
                raise ValueError(
                    f"points[{number}]: {t_s:g} s is not 1 ms after the point before; sort by time"
                )
            last_s = t_s

    def trajectory(self, duration_s: float) -> Timed:
        return _planned(self)


@lru_cache(maxsize=16)
def _planned(keys: TimedRef) -> Timed:
    """The plan, which is a constant."""
    return Timed([(t_s, x_cm / 100.0, y_cm / 100.0) for t_s, x_cm, y_cm in keys.points])
