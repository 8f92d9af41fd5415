"""Converts control periods, frames and faults to Foxglove's messages. Static objects are written again each second, for
viewers that jump in time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from miro_sim.periods import Period, RobotId
from miro_sim.scenario.camera_keys import PixelCamera, SeeingCamera
from miro_sim.scenario.keys import Scenario
from mirotwin.recording.track import error_of
from mirotwin.report.foxglove import frames, notes, pitch, robots
from mirotwin.report.foxglove.messages import FrameTransforms, SceneEntity, SceneUpdate, Timestamp, time_of
from mirotwin.report.foxglove.shapes import Point

AGAIN = 30
"""Control periods between two messages about static objects."""


class ErrorMessage(msgspec.Struct, frozen=True):
    """`error`: truth against reference at `tick`, the paper's c - r, heading wrapped. `off_pitch`: a corner is."""

    tick: int
    x_cm: float
    y_cm: float
    position_cm: float
    theta_rad: float
    off_pitch: bool


class DerivedMessage(NamedTuple):
    """A message for a topic. `tick`: of its content."""

    topic: str
    tick: int
    message: msgspec.Struct


class Derived:
    """Foxglove's messages of a run, one control period after the other.

    `scenario` None: unknown; then there are no camera, no ball, no patches and no references.
    """

    def __init__(self, scenario: Scenario | None) -> None:
        self.scenario = scenario
        self._lens = (
            scenario.camera if scenario and isinstance(scenario.camera, SeeingCamera) else None
        )  # a Gaussian camera has none
        self._paths: dict[RobotId, tuple[Point, ...]] = {}
        for network, spec in enumerate(() if scenario is None else scenario.networks):
            for robot in spec.robot:
                assert scenario is not None
                points = robots.reference_points(robot, scenario.duration_s)
                self._paths[network, robot.slot] = points
        self._trails: dict[RobotId, robots.Trail] = {}
        self._notes: dict[RobotId, notes.RobotNotes] = {}
        self._count = 0

    def period(self, period: Period) -> Iterator[DerivedMessage]:
        """Everything about a control period."""
        tick, time = period.tick, time_of(period.tick)
        still = self._count % AGAIN == 0
        self._count += 1
        yield DerivedMessage(TRANSFORMS, tick, self._transforms(period, time))
        if still:
            yield from self._standing(period, time)
        trails: list[SceneEntity] = []
        for robot in period.robots:
            trail = self._trails.setdefault((robot.network, robot.slot), robots.Trail())
            trails += trail.add(robot, period.index, time)
        yield DerivedMessage(TRAILS, tick, SceneUpdate(tuple(trails)))
        for robot in period.robots:
            place = robot.network, robot.slot
            sample = error_of(robot.truth, robot.reference, tick)
            error = sample.x_cm, sample.y_cm, sample.position_cm, sample.theta_rad, sample.off_pitch
            yield DerivedMessage(
                f"{PREFIX}{frames.robot_frame(*place)}/error", tick, ErrorMessage(tick, *error)
            )
            for line in self._notes.setdefault(place, notes.RobotNotes()).add(robot, tick):
                yield DerivedMessage(LOG, tick, line)
        for action in period.actions:
            yield DerivedMessage(LOG, action.tick, notes.of_action(action))

    def _transforms(self, period: Period, time: Timestamp) -> FrameTransforms:
        transforms = [frame for robot in period.robots for frame in frames.of_robot(robot, time)]
        if self._lens is not None:
            transforms += [frames.transform(network, self._lens.lens, time) for network in _networks(period)]
        return FrameTransforms(tuple(transforms))

    def _standing(self, period: Period, time: Timestamp) -> Iterator[DerivedMessage]:
        yield DerivedMessage(SCENE, period.tick, SceneUpdate(tuple(self._scene(period, time))))
        if self._lens is not None:
            for network in _networks(period):
                message = frames.calibration(network, self._lens.lens, time)
                yield DerivedMessage(f"{PREFIX}net{network}/calibration", period.tick, message)

    def _scene(self, period: Period, time: Timestamp) -> Iterator[SceneEntity]:
        yield pitch.pitch(time)
        if isinstance(self._lens, PixelCamera) and self._lens.ball is not None:
            yield pitch.ball(self._lens.ball, time)
        pattern = None if self._lens is None else self._lens.pattern
        for robot in period.robots:
            place = robot.network, robot.slot
            yield from robots.drawn(*place, pattern, time)
            if self._paths.get(place):
                yield robots.reference_line(*place, self._paths[place], time)


def _networks(period: Period) -> list[int]:
    return sorted({robot.network for robot in period.robots})


PREFIX = "/foxglove/"
TRANSFORMS = PREFIX + "transforms"
SCENE = PREFIX + "scene"
TRAILS = PREFIX + "trails"
LOG = PREFIX + "log"
