"""Headings at waypoints where none is given.

At a point between two others it is the heading of the circle through the three; at an end, that with which a circular
arc comes from, or leads to, the neighbour. Points on a circle so get its tangents, points on a line its direction.
"""

import math
from collections.abc import Sequence

from miro_exact.dmath import atan2, wrap_pi

TURNS_BACK = 1e-3
"""A sum of chords that is shorter than this share of them has no direction to speak of."""


def headings(
    points: Sequence[tuple[float, float]], given: Sequence[float | None], closed: bool
) -> list[float]:
    """Headings in rad, those `given` (rad or None) among them, for points in m.

    `closed`: the last point is followed by the first. ValueError where the path turns back on itself.
    """
    count = len(points)
    found: list[float | None] = list(given)
    inner = range(count) if closed else range(1, count - 1)
    for i in inner:
        if found[i] is None:
            found[i] = _on_circle(points[i - 1], points[i], points[(i + 1) % count], i)
    if not closed:
        for end, beside in ((0, 1), (count - 1, count - 2)):
            if found[end] is None:
                chord = _direction(points[min(end, beside)], points[max(end, beside)])
                neighbour = found[beside]
                found[end] = chord if neighbour is None else wrap_pi(2.0 * chord - neighbour)
    return [wrap_pi(heading) for heading in found if heading is not None]


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
