"""Robots as a scene: bodies with their patches in the frames of the truth, outlines in those of the PC, and their ways.

Trails go back for the last seconds; references are whole lines.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

from miro_exact.plugins import PluginError
from miro_host.eye.patterns import (
    IDENTITIES,
    PATCH_MM,
    PATTERNS,
    ROBOT_HALF_MM,
    ROBOT_HEIGHT_M,
    TEAMS,
    PatternName,
)
from miro_host.references.interface import Paced, Trajectory
from miro_sim.periods import RobotPeriod
from miro_sim.scenario.build import reference_for
from miro_sim.scenario.keys import RobotSpec
from mirotwin.report.foxglove import shapes
from mirotwin.report.foxglove.frames import PITCH, robot_frame
from mirotwin.report.foxglove.messages import (
    LINE_LOOP,
    Color,
    Pose,
    SceneEntity,
    SolidPrimitive,
    TextPrimitive,
    Timestamp,
    Vector3,
)
from mirotwin.report.foxglove.shapes import Point

HALF_M = ROBOT_HALF_MM / 1000.0
TOP_M = 0.002
"""Drawn thickness of the black top and of the patches on it, in metres."""
OUTLINE_M = 0.002
LABEL_Z_M = 0.11
MEASURED = Color(1.0, 0.85, 0.1, 1.0)
REFERENCE = Color(0.2, 0.9, 0.3, 1.0)
LABEL = Color(1.0, 1.0, 1.0, 1.0)


def drawn(network: int, slot: int, pattern: PatternName | None, time: Timestamp) -> Iterator[SceneEntity]:
    """A robot, its measurement and its reference; without a `pattern` its top is plain."""
    frame = robot_frame(network, slot)
    label = TextPrimitive(
        Pose(Vector3(0.0, 0.0, LABEL_Z_M), shapes.STRAIGHT), True, 0.02, False, LABEL, frame
    )
    cubes = (*_body(), *(() if pattern is None else _patches(network, slot, pattern)))
    yield SceneEntity(timestamp=time, frame_id=frame, id=frame, cubes=cubes, texts=(label,))
    yield _outline(f"{frame}/measured", MEASURED, time)
    yield _outline(f"{frame}/reference", REFERENCE, time)


def _body() -> Iterator[SolidPrimitive]:
    low = ROBOT_HEIGHT_M - TOP_M
    yield shapes.box((-HALF_M, -HALF_M, 0.0), (HALF_M, HALF_M, low), shapes.paint("side"))
    yield shapes.box((-HALF_M, -HALF_M, low), (HALF_M, HALF_M, ROBOT_HEIGHT_M), shapes.paint("top"))


def _patches(network: int, slot: int, pattern: PatternName) -> Iterator[SolidPrimitive]:
    """Team and identity, as far as there are colours for them."""
    half = PATCH_MM / 2000.0
    for names, number, place in zip((TEAMS, IDENTITIES), (network, slot), PATTERNS[pattern], strict=True):
        if number < len(names):
            x, y = place[0] / 1000.0, place[1] / 1000.0
            low, high = (x - half, y - half, ROBOT_HEIGHT_M), (x + half, y + half, ROBOT_HEIGHT_M + TOP_M)
            yield shapes.box(low, high, shapes.paint(names[number]))


def _outline(frame: str, color: Color, time: Timestamp) -> SceneEntity:
    """The square seen from above, and a line from its centre ahead; a little above the robot's top."""
    z_m = ROBOT_HEIGHT_M + 2.0 * TOP_M
    corners = ((HALF_M, HALF_M), (-HALF_M, HALF_M), (-HALF_M, -HALF_M), (HALF_M, -HALF_M))
    lines = (
        shapes.line(corners, z_m, OUTLINE_M, color, LINE_LOOP),
        shapes.line(((0.0, 0.0), (HALF_M, 0.0)), z_m, OUTLINE_M, color),
    )
    return SceneEntity(timestamp=time, frame_id=frame, id=frame, lines=lines)


KEPT = 30
EVERY = 5
"""Control periods between two points of a trail of `KEPT` points: the last five seconds.

So a run of hours stays drawable.
"""
MOST = 500
"""Points of a reference."""
STEP_M, STEP_RAD = 0.02, 0.1
"""Largest distance and turn of a reference between two points, in m and rad."""
TRAIL_Z_M, PATH_Z_M = 0.004, 0.003
WIDE_M = 0.003


class Trail:
    """The true and the measured path of one robot."""

    def __init__(self) -> None:
        self._truth: deque[Point] = deque(maxlen=KEPT)
        self._measured: deque[Point] = deque(maxlen=KEPT)

    def add(self, robot: RobotPeriod, index: int, time: Timestamp) -> Iterator[SceneEntity]:
        """The trails up to control period `index`, which is added."""
        frame = robot_frame(robot.network, robot.slot)
        for name, past, posture, color in (
            ("truth", self._truth, robot.truth, shapes.paint("side")),
            ("measured", self._measured, robot.measurement, MEASURED),
        ):
            points = [*past, *(() if posture is None else ((posture.x_m, posture.y_m),))]
            if posture is not None and index % EVERY == 0:
                past.append(points[-1])
            line = shapes.line(points, TRAIL_Z_M, WIDE_M, color)
            yield SceneEntity(timestamp=time, frame_id=PITCH, id=f"{frame}/trail/{name}", lines=(line,))


def reference_points(robot: RobotSpec, duration_s: float) -> tuple[Point, ...]:
    """The whole reference path of a robot; empty if a trajectory of another distribution fails."""
    try:
        trajectory = reference_for(robot, duration_s)
        postures = [trajectory.at(at_s).posture for at_s in _instants(trajectory, duration_s)]
    except PluginError:
        return ()
    return tuple((at.x_m, at.y_m) for at in postures)


def reference_line(network: int, slot: int, points: Iterable[Point], time: Timestamp) -> SceneEntity:
    """The reference as a line on the floor."""
    line = shapes.line(points, PATH_Z_M, WIDE_M, REFERENCE)
    name = f"{robot_frame(network, slot)}/path"
    return SceneEntity(timestamp=time, frame_id=PITCH, id=name, lines=(line,))


def _instants(trajectory: Trajectory, duration_s: float) -> Iterator[float]:
    """Times from begin to end, at most `MOST`."""
    until_s, step_s = duration_s, duration_s / MOST
    if isinstance(trajectory, Paced):
        pace = trajectory.pace(STEP_M, STEP_RAD)
        until_s = min(pace.until_s, duration_s)
        step_s = max(pace.step_s, until_s / MOST)
    count = 0
    while count * step_s < until_s:
        yield count * step_s
        count += 1
    yield until_s
