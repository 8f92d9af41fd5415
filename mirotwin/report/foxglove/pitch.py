"""The pitch as a scene: floor, lines, walls and goals, and the ball.

As flat as it can be: lines lie on the floor, the triangles in the corners are tops without sides.
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_exact.dmath import sincos
from miro_host.eye.pitch_marks import (
    AREA_DEPTH_M,
    AREA_HALF_M,
    BOTTOM_M,
    LEFT_M,
    MIDDLE_X_M,
    MIDDLE_Y_M,
    RIGHT_M,
    TOP_M,
    WALL_M,
)
from miro_sim.pitch.colour_samples import BALL_RADIUS_M
from miro_sim.scenario.camera_keys import Ball
from mirotwin.report.foxglove import shapes
from mirotwin.report.foxglove.frames import PITCH
from mirotwin.report.foxglove.messages import (
    LINE_LIST,
    LINE_LOOP,
    LinePrimitive,
    Pose,
    SceneEntity,
    SolidPrimitive,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)
from mirotwin.report.foxglove.shapes import Point

GOAL_HALF_M = 0.20
GOAL_DEPTH_M = 0.15
CORNER_M = 0.07
CIRCLE_M = 0.25
WALL_WIDE_M = 0.025
LINE_WIDE_M = 0.003
FLOOR_DEEP_M = 0.005
LINE_Z_M = 0.001
CIRCLE_POINTS = 48
_TURN_RAD = 6.283185307179586


def pitch(time: Timestamp) -> SceneEntity:
    """Everything but the ball."""
    return SceneEntity(
        timestamp=time,
        frame_id=PITCH,
        id="pitch",
        cubes=(*_floor(), *_walls()),
        lines=tuple(_lines()),
        triangles=(_corners(),),
    )


def ball(placed: Ball, time: Timestamp) -> SceneEntity:
    """The golf ball, which lies still."""
    across, place = 2.0 * BALL_RADIUS_M, Vector3(placed.x_cm / 100.0, placed.y_cm / 100.0, BALL_RADIUS_M)
    size = Vector3(across, across, across)
    sphere = SolidPrimitive(Pose(place, shapes.STRAIGHT), size, shapes.paint("ball middle"))
    return SceneEntity(timestamp=time, frame_id=PITCH, id="ball", spheres=(sphere,))


def _floor() -> Iterator[SolidPrimitive]:
    paint = shapes.paint("floor")
    yield shapes.box((LEFT_M, BOTTOM_M, -FLOOR_DEEP_M), (RIGHT_M, TOP_M, 0.0), paint)
    low, high = MIDDLE_Y_M - GOAL_HALF_M, MIDDLE_Y_M + GOAL_HALF_M
    for left, right in ((LEFT_M - GOAL_DEPTH_M, LEFT_M), (RIGHT_M, RIGHT_M + GOAL_DEPTH_M)):
        yield shapes.box((left, low, -FLOOR_DEEP_M), (right, high, 0.0), paint)


def _walls() -> Iterator[SolidPrimitive]:
    """White boxes with thin black ones on top of them."""
    for left, bottom, right, top in _wall_places():
        yield shapes.box((left, bottom, 0.0), (right, top, WALL_M), shapes.paint("wall face"))
        black = shapes.paint("wall top")
        yield shapes.box((left, bottom, WALL_M), (right, top, WALL_M + LINE_Z_M), black)


def _wall_places() -> Iterator[tuple[float, float, float, float]]:
    """Left, bottom, right and top of each, seen from above."""
    wide = WALL_WIDE_M
    for low in (BOTTOM_M - wide, TOP_M):
        yield LEFT_M - wide, low, RIGHT_M + wide, low + wide
    goal_low, goal_high = MIDDLE_Y_M - GOAL_HALF_M, MIDDLE_Y_M + GOAL_HALF_M
    for wall, mouth, back in (
        (LEFT_M - wide, LEFT_M - GOAL_DEPTH_M, LEFT_M - GOAL_DEPTH_M - wide),
        (RIGHT_M, RIGHT_M + wide, RIGHT_M + GOAL_DEPTH_M),
    ):
        yield wall, BOTTOM_M, wall + wide, goal_low
        yield wall, goal_high, wall + wide, TOP_M
        deep = GOAL_DEPTH_M - wide
        yield mouth, goal_low - wide, mouth + deep, goal_low
        yield mouth, goal_high, mouth + deep, goal_high + wide
        yield back, goal_low - wide, back + wide, goal_high + wide


def _lines() -> Iterator[LinePrimitive]:
    paint = shapes.paint("line")
    straight: list[Point] = [(MIDDLE_X_M, BOTTOM_M), (MIDDLE_X_M, TOP_M)]
    for end, into in ((LEFT_M, 1.0), (RIGHT_M, -1.0)):
        area = end + into * AREA_DEPTH_M
        low, high = MIDDLE_Y_M - AREA_HALF_M, MIDDLE_Y_M + AREA_HALF_M
        straight += [(end, MIDDLE_Y_M - GOAL_HALF_M), (end, MIDDLE_Y_M + GOAL_HALF_M)]
        straight += [(area, low), (area, high), (end, low), (area, low), (end, high), (area, high)]
    yield shapes.line(straight, LINE_Z_M, LINE_WIDE_M, paint, LINE_LIST)
    yield shapes.line(_circle(), LINE_Z_M, LINE_WIDE_M, paint, LINE_LOOP)


def _circle() -> Iterator[Point]:
    for number in range(CIRCLE_POINTS):
        sin, cos = sincos(_TURN_RAD * number / CIRCLE_POINTS)
        yield MIDDLE_X_M + CIRCLE_M * cos, MIDDLE_Y_M + CIRCLE_M * sin


def _corners() -> TriangleListPrimitive:
    points = []
    for x, x_in in ((LEFT_M, 1.0), (RIGHT_M, -1.0)):
        for y, y_in in ((BOTTOM_M, 1.0), (TOP_M, -1.0)):
            ends = [(x, y), (x + x_in * CORNER_M, y), (x, y + y_in * CORNER_M)]
            if x_in * y_in < 0.0:  # counter-clockwise seen from above, so that its face is up
                ends.reverse()
            points += [Vector3(*end, WALL_M) for end in ends]
    return TriangleListPrimitive(shapes.ORIGIN, tuple(points), shapes.paint("wall top"))
