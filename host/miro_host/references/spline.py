"""The path through waypoints: quintic polynomials with continuous heading and curvature.

Each piece leads from one point to the next in u = 0 to its length, a guess of the way along it. At both ends dp/du is
the heading as a unit vector and d2p/du2 is the curvature, normal to it: so heading and curvature do not jump from piece
to piece. The curvature at a point is the mean of those that the pieces beside it would have by themselves,
weighted by the other's length (after C. Sprunk, Planning Motion Trajectories for Mobile Robots Using Splines,
University of Freiburg, 2008, who takes the mean of the second derivatives of cubics).
"""

import math
from collections.abc import Sequence

import msgspec

from miro_exact.dmath import atan2, sincos, wrap_pi

BEND_MOST_RAD = 2.0
"""A piece is taken for no longer than an arc that leaves its chord at this angle."""


class Shape(msgspec.Struct, frozen=True):
    """The path at one place: position in m, and derivatives by the piece's parameter tau of 0 to 1, up to the third."""

    x_m: float
    y_m: float
    dx: float
    dy: float
    d2x: float
    d2y: float
    d3x: float
    d3y: float

    def curvature(self) -> tuple[float, float]:
        """Curvature in 1/m, and its derivative along the path in 1/m2."""
        square = self.dx * self.dx + self.dy * self.dy
        rate = math.sqrt(square)
        cross = self.dx * self.d2y - self.dy * self.d2x
        along = self.dx * self.d2x + self.dy * self.d2y
        curvature = cross / (square * rate)
        by_tau = (self.dx * self.d3y - self.dy * self.d3x) / (
            square * rate
        ) - 3.0 * curvature * along / square
        return curvature, by_tau / rate


class SplinePiece(msgspec.Struct, frozen=True):
    """One polynomial in each coordinate: coefficients of tau^0 to tau^5, in m."""

    x: tuple[float, float, float, float, float, float]
    y: tuple[float, float, float, float, float, float]

    def rate(self, tau: float) -> float:
        """m of path for each unit of tau."""
        dx, dy = _slope(self.x, tau), _slope(self.y, tau)
        return math.sqrt(dx * dx + dy * dy)

    def shape(self, tau: float) -> Shape:
        """Position and derivatives at tau."""
        x, y = self.x, self.y
        return Shape(
            _value(x, tau),
            _value(y, tau),
            _slope(x, tau),
            _slope(y, tau),
            _second(x, tau),
            _second(y, tau),
            _third(x, tau),
            _third(y, tau),
        )


Six = tuple[float, float, float, float, float, float]


def _value(c: Six, t: float) -> float:
    return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))


def _slope(c: Six, t: float) -> float:
    return c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * (5.0 * c[5]))))


def _second(c: Six, t: float) -> float:
    return 2.0 * c[2] + t * (6.0 * c[3] + t * (12.0 * c[4] + t * (20.0 * c[5])))


def _third(c: Six, t: float) -> float:
    return 6.0 * c[3] + t * (24.0 * c[4] + t * (60.0 * c[5]))


def spline(
    points: Sequence[tuple[float, float]], headings: Sequence[float], closed: bool
) -> list[SplinePiece]:
    """The pieces between points in m with these headings in rad; `closed`: with one from the last to the first."""
    count = len(points)
    ends = [(i, (i + 1) % count) for i in range(count if closed else count - 1)]
    tangents = [(cos, sin) for sin, cos in map(sincos, headings)]
    arcs = (_arc_like(points[i], points[j], headings[i], headings[j]) for i, j in ends)
    lengths, bends = zip(*arcs, strict=True)
    curvatures = []
    for i in range(count):
        if not closed and i in (0, count - 1):
            curvatures.append(bends[-1][1] if i else bends[0][0])
        else:
            arriving, leaving = lengths[i - 1], lengths[i]
            mean = (bends[i - 1][1] * leaving + bends[i][0] * arriving) / (arriving + leaving)
            curvatures.append(mean)
    return [
        _quintic(points[i], points[j], tangents[i], tangents[j], curvatures[i], curvatures[j], length)
        for (i, j), length in zip(ends, lengths, strict=True)
    ]


Pair = tuple[float, float]


def _arc_like(a: Pair, b: Pair, leaving: float, arriving: float) -> tuple[float, Pair]:
    """The length of a piece and its curvatures at both ends, from the angles between its headings and its chord.

    The length is the chord times delta / sin(delta), delta the mean of both angles. The curvatures are those of the
    cubic over the chord whose slopes are these angles. Both are exact on an arc.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    chord, direction = math.sqrt(dx * dx + dy * dy), atan2(dy, dx)
    first, last = wrap_pi(leaving - direction), wrap_pi(arriving - direction)
    delta = min(0.5 * (abs(first) + abs(last)), BEND_MOST_RAD)
    length = chord if delta < 1e-6 else chord * delta / sincos(delta)[0]
    return length, (-(4.0 * first + 2.0 * last) / length, (2.0 * first + 4.0 * last) / length)


def _quintic(
    a: Pair, b: Pair, at_a: Pair, at_b: Pair, bend_a: float, bend_b: float, length: float
) -> SplinePiece:
    """The quintic with these ends, unit tangents and curvatures in 1/m."""
    normal_a, normal_b = (-at_a[1], at_a[0]), (-at_b[1], at_b[0])
    square = length * length
    both = []
    for k in (0, 1):
        h = b[k] - a[k]
        d0, d1 = length * at_a[k], length * at_b[k]
        e0, e1 = square * bend_a * normal_a[k], square * bend_b * normal_b[k]
        both.append(
            (
                a[k],
                d0,
                0.5 * e0,
                10.0 * h - 6.0 * d0 - 4.0 * d1 - 1.5 * e0 + 0.5 * e1,
                -15.0 * h + 8.0 * d0 + 7.0 * d1 + 1.5 * e0 - e1,
                6.0 * h - 3.0 * d0 - 3.0 * d1 - 0.5 * e0 + 0.5 * e1,
            )
        )
    return SplinePiece(*both)
