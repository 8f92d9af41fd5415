"""The usual shapes of a scene: boxes, balls, lines and marks, made of few numbers."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

from miro_exact.dmath import exp, log, sincos
from miro_sim.pitch.paints import PAINTS
from mirotwin.report.foxglove.messages import (
    LINE_STRIP,
    Color,
    LinePrimitive,
    Pose,
    Quaternion,
    SolidPrimitive,
    Vector3,
)

STRAIGHT = Quaternion(0.0, 0.0, 0.0, 1.0)
ORIGIN = Pose(Vector3(0.0, 0.0, 0.0), STRAIGHT)
SCREEN_GAMMA = 0.45
"""Gamma of a screen, as of the camera: a paint is a share of light, a colour is the value sent to a screen."""

Point = tuple[float, float]


def heading(theta_rad: float) -> Quaternion:
    """A turn about the axis that points up."""
    sin, cos = sincos(0.5 * theta_rad)
    return Quaternion(0.0, 0.0, sin, cos)


@cache
def paint(name: str) -> Color:
    """Screen colour of a paint of the scene."""
    red, green, blue = (exp(SCREEN_GAMMA * log(part / 1000.0)) for part in PAINTS[name])
    return Color(red, green, blue, 1.0)


def box(low: tuple[float, float, float], high: tuple[float, float, float], color: Color) -> SolidPrimitive:
    """Between two corners."""
    middle = Vector3(*((first + other) / 2.0 for first, other in zip(low, high, strict=True)))
    size = Vector3(*(other - first for first, other in zip(low, high, strict=True)))
    return SolidPrimitive(Pose(middle, STRAIGHT), size, color)


def line(
    points: Iterable[Point], z_m: float, wide_m: float, color: Color, kind: int = LINE_STRIP
) -> LinePrimitive:
    """At one height. LINE_STRIP: from point to point; LINE_LOOP: and back to the first; LINE_LIST: from the first to
    the second, from the third to the fourth, and so on.
    """
    return LinePrimitive(kind, ORIGIN, wide_m, False, tuple(Vector3(x, y, z_m) for x, y in points), color)
