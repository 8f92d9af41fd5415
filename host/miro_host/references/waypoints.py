"""A path through waypoints, planned: from points, some with headings, to a trajectory within bounds.

    points ─► headings ─► quintic pieces ─► table of cells: length, curvature ─► speeds ─► times
                                                                                             │
    t ─► cell ─► way along the path in it ─► tau ─► posture, curvature ─► Reference  ◄───────┘

The path begins and ends at rest. A closed one is driven round and round: from rest until its speed is that of the lap
before, then lap after lap. Speed and heading are continuous, so is the curvature: v and w do not jump. v' is constant
within a cell of the table.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.dmath import atan2, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import (
    DEGREE,
    Cm,
    Reference,
    ReferenceParameters,
    SamplingPace,
    TurnDeg,
    with_polar_form,
)
from miro_host.references.speeds import Bounds, at_nodes, run_up, smooth, timed
from miro_host.references.spline import SplinePiece, spline

CELLS = 64
"""Cells of the table in each piece of the path."""
LEAST_CM = 7.5
"""The edge of the robot's square: points that are nearer to each other say more about heading than about place."""
MOST_POINTS = 200
MOST_CURVATURE_PER_M = 100.0
LEAST_RATE = 0.05
Speed = Annotated[float, Meta(ge=0.01, le=1.46)]
GAUSS = ((0.1127016653792583, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.8872983346207417, 5.0 / 18.0))
"""Gauss and Legendre's three points in 0 to 1, and their weights."""


class Waypoints:
    """A trajectory through `points` in m, with `given` headings in rad or None, within `bounds`.

    `limits_m_s`: the greatest speed from each point to the next, or None; it may be left out.

    ValueError for a path that cannot be driven: one that turns back on itself or bends to less than 1 cm.
    """

    def __init__(
        self,
        points: list[tuple[float, float]],
        given: list[float | None],
        bounds: Bounds,
        closed: bool = False,
        limits_m_s: Sequence[float | None] = (),
    ) -> None:
        self.closed = closed
        self.bounds = bounds
        self.pieces = spline(points, headings(points, given, closed), closed)
        self.ways_m: list[float] = []
        curvatures: list[float] = []
        for number, piece in enumerate(self.pieces):
            self._tabulate(piece, number, curvatures)
        limits = [limit for limit in limits_m_s[: len(self.pieces)] for _ in range(CELLS)]
        squares = at_nodes(bounds, curvatures, closed, limits)
        lap = smooth(squares, self.ways_m, bounds.accel_m_s2, closed)
        self.lap = timed(lap, self.ways_m)
        self.start = timed(run_up(lap, self.ways_m, bounds.accel_m_s2), self.ways_m) if closed else self.lap
        self.most_curvature_per_m = max(curvatures)

    def __repr__(self) -> str:
        kind = "closed" if self.closed else "open"
        return f"Waypoints({len(self.pieces)} pieces, {kind}, lap of {self.lap.duration_s:.3f} s)"

    def _tabulate(self, piece: SplinePiece, number: int, curvatures: list[float]) -> None:
        """The cells of one piece: their lengths, and a bound of their curvature.

        A peak between two of the places that are looked at is higher than the higher one by an eighth of the difference
        between them and their neighbour, if it is a parabola: half of it is added.
        """
        chord_rate = _way(piece, 0.0, 1.0)
        bends = []
        for half in range(2 * CELLS + 1):
            shape = piece.shape(half / (2.0 * CELLS))
            rate = piece.rate(half / (2.0 * CELLS))
            bend = abs(shape.curvature()[0]) if rate > LEAST_RATE * chord_rate else 2.0 * MOST_CURVATURE_PER_M
            if bend > MOST_CURVATURE_PER_M:
                where = f"({100.0 * shape.x_m:.1f}, {100.0 * shape.y_m:.1f}) cm"
                raise ValueError(
                    f"points[{number}]: behind this point, at {where}, the path bends to less than"
                    f" {100.0 / MOST_CURVATURE_PER_M:.0f} cm; give another heading_deg, or move points apart"
                )
            bends.append(bend)
        for cell in range(CELLS):
            self.ways_m.append(_way(piece, cell / CELLS, (cell + 1) / CELLS))
            a, b, c = bends[2 * cell : 2 * cell + 3]
            curvatures.append(max(a, b, c) + 0.5 * max(abs(b - a), abs(c - b)))

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; it stands before 0 s and, unless it is closed, after its end."""
        lap, since_s = self.start, max(t_s, 0.0)
        if t_s > lap.duration_s and self.closed:
            since_s = (t_s - lap.duration_s) % self.lap.duration_s
            lap = self.lap
        moving = t_s >= 0.0 and since_s <= lap.duration_s
        since_s = min(since_s, lap.duration_s)
        cell = min(bisect_right(lap.times_s, since_s), len(lap.accels_m_s2)) - 1
        in_cell_s = since_s - lap.times_s[cell]
        accel, speed = lap.accels_m_s2[cell], lap.speeds_m_s[cell]
        way = in_cell_s * (speed + 0.5 * accel * in_cell_s)
        on_path = cell % len(self.ways_m)
        piece = self.pieces[on_path // CELLS]
        shape = piece.shape(self._tau(piece, on_path, way))
        bend, bend_rate = shape.curvature()
        v = max(speed + accel * in_cell_s, 0.0) if moving else 0.0
        v_dot = accel if moving else 0.0
        posture = Posture(shape.x_m, shape.y_m, atan2(shape.dy, shape.dx))
        return with_polar_form(posture, v, bend * v, v_dot, bend * v_dot + bend_rate * v * v)

    def _tau(self, piece: SplinePiece, cell: int, way_m: float) -> float:
        """The parameter `way_m` behind a cell's beginning: linearly, then two steps of Newton."""
        first = (cell % CELLS) / CELLS
        tau = first + min(way_m / self.ways_m[cell], 1.0) / CELLS
        for _ in range(2):
            tau -= (_way(piece, first, tau) - way_m) / piece.rate(tau)
        return tau

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """The pace of a path that is complete at its end, or after the first lap at its full speed."""
        until_s = self.start.duration_s
        if self.closed:
            until_s += self.lap.duration_s
        bend = self.most_curvature_per_m
        step_s = min(step_m, step_rad / bend if bend > 0.0 else step_m) / self.bounds.speed_m_s
        return SamplingPace(step_s, until_s, until_s)


def _way(piece: SplinePiece, first: float, last: float) -> float:
    """Length in m of a piece from one parameter to another, by Gauss and Legendre."""
    span = last - first
    rate = 0.0
    for place, weight in GAUSS:
        rate += weight * piece.rate(first + place * span)
    return span * rate


class Waypoint(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One point of a path; without a heading it gets that of the circle through it and its neighbours.

    `speed_m_s`: the greatest from here to the next point, if that is less than the one of the whole path.
    """

    x_cm: Cm
    y_cm: Cm
    heading_deg: TurnDeg | None = None
    speed_m_s: Speed | None = None


class WaypointsRef(ReferenceParameters, frozen=True, kw_only=True, tag="waypoints"):
    """A smooth path through `points`, as fast as the bounds allow, from rest to rest.

    `accel_m_s2` bounds the acceleration along the path, `lateral_accel_m_s2` that across it, v w, and `turn_rad_s` the
    turning rate w. With `closed` the last point is followed by the first, and the path is driven until the run ends.
    """

    points: tuple[Waypoint, ...]
    closed: bool = False
    speed_m_s: Speed = 0.20
    accel_m_s2: Annotated[float, Meta(ge=0.01, le=100.0)] = 0.40
    lateral_accel_m_s2: Annotated[float, Meta(ge=0.01, le=100.0)] = 0.40
    turn_rad_s: Annotated[float, Meta(ge=0.01, le=100.0)] = 3.0

    def __post_init__(self) -> None:
        count = len(self.points)
        if not 2 <= count <= MOST_POINTS:
            raise ValueError(f"points: there are {count}; give 2 to {MOST_POINTS}")
        for number, point in enumerate(self.points):
            for key, value in msgspec.structs.asdict(point).items():
                if value is not None and not math.isfinite(value):
                    raise ValueError(f"points[{number}].{key}: {value} is not a number that can be used")
        for number in range(count if self.closed else count - 1):
            here, there = self.points[number], self.points[(number + 1) % count]
            x, y = there.x_cm - here.x_cm, there.y_cm - here.y_cm
            if x * x + y * y < LEAST_CM * LEAST_CM:
                raise ValueError(
                    f"points[{(number + 1) % count}]: less than {LEAST_CM} cm from points[{number}], the length of the"
                    " robot; move them apart, or leave one out"
                )
        self.trajectory(0.0)

    def trajectory(self, duration_s: float) -> Waypoints:
        return _planned(self)


@lru_cache(maxsize=16)
def _planned(keys: WaypointsRef) -> Waypoints:
    """The plan, which is a constant: a scenario is checked with the one that it is then driven with."""
    return Waypoints(
        [(point.x_cm / 100.0, point.y_cm / 100.0) for point in keys.points],
        [None if point.heading_deg is None else point.heading_deg * DEGREE for point in keys.points],
        Bounds(keys.speed_m_s, keys.accel_m_s2, keys.lateral_accel_m_s2, keys.turn_rad_s),
        keys.closed,
        [point.speed_m_s for point in keys.points],
    )


TURNS_BACK = 1e-3
"""A sum of chords that is shorter than this share of them has no direction to speak of."""


def headings(
    points: Sequence[tuple[float, float]], given: Sequence[float | None], closed: bool
) -> list[float]:
    """Headings in rad, those `given` (rad or None) among them, for points in m.

    Where none is given: at a point between two others that of the circle through the three; at an end that with which
    a circular arc comes from, or leads to, the neighbour. Points on a circle so get its tangents.

    `closed`: the last point is followed by the first. ValueError where the path turns back on itself.
    """
    count = len(points)
    filled: list[float | None] = list(given)
    inner = range(count) if closed else range(1, count - 1)
    for i in inner:
        if filled[i] is None:
            filled[i] = _on_circle(points[i - 1], points[i], points[(i + 1) % count], i)
    if not closed:
        for end, beside in ((0, 1), (count - 1, count - 2)):
            if filled[end] is None:
                chord = _direction(points[min(end, beside)], points[max(end, beside)])
                neighbour = filled[beside]
                filled[end] = chord if neighbour is None else wrap_pi(2.0 * chord - neighbour)
    return [wrap_pi(heading) for heading in filled if heading is not None]


def _direction(a: tuple[float, float], b: tuple[float, float]) -> float:
    return atan2(b[1] - a[1], b[0] - a[0])


def _on_circle(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], number: int) -> float:
    """Heading in b of the circle from a through b to c: each chord has the weight 1 / its length^2."""
    x1, y1, x2, y2 = b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]
    square1, square2 = x1 * x1 + y1 * y1, x2 * x2 + y2 * y2
    x, y = x1 * square2 + x2 * square1, y1 * square2 + y2 * square1
    sum_of_both = math.sqrt(square1) * square2 + math.sqrt(square2) * square1
    if math.sqrt(x * x + y * y) < TURNS_BACK * sum_of_both:
        raise ValueError(f"points[{number}]: the path turns back on itself here; give heading_deg")
    return atan2(y, x)
