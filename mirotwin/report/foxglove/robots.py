"""Robots as a scene: bodies with their patches in the frames of the truth, outlines in those of the PC."""

from __future__ import annotations

from collections.abc import Iterator

from miro_host.eye.patterns import (
    IDENTITIES,
    PATCH_MM,
    PATTERNS,
    ROBOT_HALF_MM,
    ROBOT_HEIGHT_M,
    TEAMS,
    PatternName,
)
from mirotwin.report.foxglove import shapes
from mirotwin.report.foxglove.frames import measured_frame, reference_frame, robot_frame
from mirotwin.report.foxglove.messages import (
    Color,
    CubePrimitive,
    Pose,
    SceneEntity,
    TextPrimitive,
    Timestamp,
    Vector3,
)

HALF_M = ROBOT_HALF_MM / 1000.0
TOP_M = 0.002
"""How thick the black top is drawn, and the patches on it."""
OUTLINE_M = 0.002
LABEL_Z_M = 0.11
MEASURED = Color(1.0, 0.85, 0.1, 1.0)
REFERENCE = Color(0.2, 0.9, 0.3, 1.0)
LABEL = Color(1.0, 1.0, 1.0, 1.0)


def drawn(network: int, slot: int, pattern: PatternName | None, at: Timestamp) -> Iterator[SceneEntity]:
    """A robot, its measurement and its reference; without a `pattern` its top is plain."""
    frame = robot_frame(network, slot)
    label = TextPrimitive(
        Pose(Vector3(0.0, 0.0, LABEL_Z_M), shapes.STRAIGHT), True, 0.02, False, LABEL, frame
    )
    cubes = (*_body(), *(() if pattern is None else _patches(network, slot, pattern)))
    yield SceneEntity(timestamp=at, frame_id=frame, id=frame, cubes=cubes, texts=(label,))
    for ghost, color in (
        (measured_frame(network, slot), MEASURED),
        (reference_frame(network, slot), REFERENCE),
    ):
        yield _outline(ghost, color, at)


def _body() -> Iterator[CubePrimitive]:
    low = ROBOT_HEIGHT_M - TOP_M
    yield shapes.box((-HALF_M, -HALF_M, 0.0), (HALF_M, HALF_M, low), shapes.paint("side"))
    yield shapes.box((-HALF_M, -HALF_M, low), (HALF_M, HALF_M, ROBOT_HEIGHT_M), shapes.paint("top"))


def _patches(network: int, slot: int, pattern: PatternName) -> Iterator[CubePrimitive]:
    """Team and identity, as far as there are colours for them."""
    half = PATCH_MM / 2000.0
    for names, number, place in zip((TEAMS, IDENTITIES), (network, slot), PATTERNS[pattern], strict=True):
        if number < len(names):
            x, y = place[0] / 1000.0, place[1] / 1000.0
            low, high = (x - half, y - half, ROBOT_HEIGHT_M), (x + half, y + half, ROBOT_HEIGHT_M + TOP_M)
            yield shapes.box(low, high, shapes.paint(names[number]))


def _outline(frame: str, color: Color, at: Timestamp) -> SceneEntity:
    """The square seen from above, and a line from its centre ahead; a little above the robot's top."""
    z_m = ROBOT_HEIGHT_M + 2.0 * TOP_M
    corners = ((HALF_M, HALF_M), (-HALF_M, HALF_M), (-HALF_M, -HALF_M), (HALF_M, -HALF_M))
    lines = (
        shapes.loop(corners, z_m, OUTLINE_M, color),
        shapes.strip(((0.0, 0.0), (HALF_M, 0.0)), z_m, OUTLINE_M, color),
    )
    return SceneEntity(timestamp=at, frame_id=frame, id=frame, lines=lines)
