"""Where robots were, and where they are to go: trails of the last seconds, and references as whole lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

from miro_host.plugins import PluginError
from miro_host.references.interface import Paced, Trajectory
from miro_sim.periods import RobotPeriod
from miro_sim.scenario.build import reference_for
from miro_sim.scenario.keys import RobotSpec
from mirotwin.report.foxglove import shapes
from mirotwin.report.foxglove.frames import PITCH, robot_frame
from mirotwin.report.foxglove.messages import SceneEntity, Timestamp
from mirotwin.report.foxglove.robots import MEASURED, REFERENCE
from mirotwin.report.foxglove.shapes import Point

KEPT = 30
EVERY = 5
"""A trail has so many points, one in so many control periods: the last five seconds. A run of hours has an end."""
MOST = 500
"""Points of a reference."""
STEP_M, STEP_RAD = 0.02, 0.1
"""How far a reference goes or turns from point to point, at most."""
TRAIL_Z_M, PATH_Z_M = 0.004, 0.003
WIDE_M = 0.003


class Trail:
    """Where one robot was, in truth and as measured."""

    def __init__(self) -> None:
        self._truth: deque[Point] = deque(maxlen=KEPT)
        self._seen: deque[Point] = deque(maxlen=KEPT)

    def add(self, robot: RobotPeriod, index: int, at: Timestamp) -> Iterator[SceneEntity]:
        """The trails up to control period `index`, which is added."""
        frame = robot_frame(robot.network, robot.slot)
        for name, kept, posture, color in (
            ("truth", self._truth, robot.truth, shapes.paint("side")),
            ("measured", self._seen, robot.measurement, MEASURED),
        ):
            points = [*kept, *(() if posture is None else ((posture.x_m, posture.y_m),))]
            if posture is not None and index % EVERY == 0:
                kept.append(points[-1])
            line = shapes.strip(points, TRAIL_Z_M, WIDE_M, color)
            yield SceneEntity(timestamp=at, frame_id=PITCH, id=f"{frame}/trail/{name}", lines=(line,))


def reference_points(robot: RobotSpec, duration_s: float) -> tuple[Point, ...]:
    """The whole path that a robot is to go; none for one of another distribution that fails."""
    try:
        trajectory = reference_for(robot, duration_s)
        found = [trajectory.at(at_s).posture for at_s in _instants(trajectory, duration_s)]
    except PluginError:
        return ()
    return tuple((at.x_m, at.y_m) for at in found)


def reference(network: int, slot: int, points: Iterable[Point], at: Timestamp) -> SceneEntity:
    """It as a line on the floor."""
    line = shapes.strip(points, PATH_Z_M, WIDE_M, REFERENCE)
    name = f"{robot_frame(network, slot)}/path"
    return SceneEntity(timestamp=at, frame_id=PITCH, id=name, lines=(line,))


def _instants(trajectory: Trajectory, duration_s: float) -> Iterator[float]:
    """Times from begin to end, no more than `MOST` of them."""
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
