"""The course of each robot in a run, as columns of numbers: what summary, table and figure are made from.

A run of hours has 100 000 periods an hour: a record of a period is some 3 KB, its row in these columns some 150
bytes.

Errors are truth against the reference at the same tick, e = c - r in the paper's axes, heading wrapped to (-pi, pi].
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import overload

import msgspec

from miro_exact.clock import seconds
from miro_sim.periods import Period, RobotPeriod
from miro_sim.pitch import ground as pitch
from mirotwin.recording.derived import TheoryMessage
from mirotwin.recording.theory_track import TheoryTrack

TWO_PI = 6.283185307179586
SETTLED_CM = 3.0
SETTLED_RAD = 0.15

RobotId = tuple[int, int]
"""Network and slot of a robot."""


class ErrorSample(msgspec.Struct, frozen=True):
    """Tracking error of a robot at one tick, and whether a corner of it is off the pitch."""

    tick: int
    x_cm: float
    y_cm: float
    theta_rad: float
    off_pitch: bool = False

    @property
    def position_cm(self) -> float:
        return math.sqrt(self.x_cm * self.x_cm + self.y_cm * self.y_cm)

    @property
    def settled(self) -> bool:
        """Within 3 cm and 0.15 rad."""
        return self.position_cm <= SETTLED_CM and abs(self.theta_rad) <= SETTLED_RAD


class TrackingErrors(Sequence[ErrorSample]):
    """Tracking errors of one robot in the order of time."""

    def __init__(self) -> None:
        self.ticks = array("q")
        self.x_cm = array("d")
        self.y_cm = array("d")
        self.theta_rad = array("d")
        self.off_pitch = array("b")

    def append(self, sample: ErrorSample) -> None:
        self.ticks.append(sample.tick)
        self.x_cm.append(sample.x_cm)
        self.y_cm.append(sample.y_cm)
        self.theta_rad.append(sample.theta_rad)
        self.off_pitch.append(sample.off_pitch)

    def __len__(self) -> int:
        return len(self.ticks)

    @overload
    def __getitem__(self, index: int) -> ErrorSample: ...
    @overload
    def __getitem__(self, index: slice) -> list[ErrorSample]: ...
    def __getitem__(self, index: int | slice) -> ErrorSample | list[ErrorSample]:
        if isinstance(index, slice):
            return [self[at] for at in range(*index.indices(len(self)))]
        error = self.x_cm[index], self.y_cm[index], self.theta_rad[index]
        return ErrorSample(self.ticks[index], *error, bool(self.off_pitch[index]))


class Points:
    """Points of the pitch in world axes."""

    def __init__(self) -> None:
        self.x_cm = array("d")
        self.y_cm = array("d")

    def append(self, x_m: float, y_m: float) -> None:
        self.x_cm.append(100.0 * x_m)
        self.y_cm.append(100.0 * y_m)


class Series:
    """A value against time."""

    def __init__(self) -> None:
        self.times_s = array("d")
        self.values = array("d")


class RobotTrack:
    """One robot: errors, where it was, should have been and was seen, and what the theory says of it."""

    def __init__(self) -> None:
        self.errors = TrackingErrors()
        self.truth = Points()
        self.reference = Points()
        self.seen = Points()
        self.theory = TheoryTrack()

    def add(self, robot: RobotPeriod, tick: int) -> None:
        self.errors.append(error_of(robot, tick))
        self.truth.append(robot.truth.x_m, robot.truth.y_m)
        self.reference.append(robot.reference.x_m, robot.reference.y_m)
        if robot.measurement is not None:
            self.seen.append(robot.measurement.x_m, robot.measurement.y_m)
        self.theory.add(robot, tick)


class Tracks:
    """All robots of a run, in the order of the world.

    `count` control periods with `digest` at the end of the last one. `inner`: name of a law's inner value -> robot ->
    its course, names in the order of the robots and of their laws.
    """

    def __init__(self, periods: Iterable[Period] = ()) -> None:
        self.count = 0
        self.digest = ""
        self.robots: dict[RobotId, RobotTrack] = {}
        self.inner: dict[str, dict[RobotId, Series]] = {}
        for period in periods:
            self.add(period)

    def add(self, period: Period) -> None:
        """Takes over what is needed of the next control period."""
        for robot in period.robots:
            place = (robot.network, robot.slot)
            track = self.robots.get(place)
            if track is None:
                track = self.robots[place] = RobotTrack()
            track.add(robot, period.tick)
            if robot.control is not None:
                self._add_inner(place, period.tick, robot.control.inner)
        self.count += 1
        self.digest = period.digest

    def theories(self) -> Iterator[tuple[int, int, TheoryMessage]]:
        """Network, slot and what the theory says of each steered robot in the period that was added last."""
        for (network, slot), track in self.robots.items():
            if track.theory.now is not None:
                yield network, slot, track.theory.now

    def _add_inner(self, place: RobotId, tick: int, inner: dict[str, float]) -> None:
        for name, value in inner.items():
            line = self.inner.setdefault(name, {}).get(place)
            if line is None:
                line = self.inner[name][place] = Series()
            line.times_s.append(seconds(tick))
            line.values.append(value)


def wrapped(angle_rad: float) -> float:
    """The angle in (-pi, pi]."""
    angle = math.fmod(angle_rad, TWO_PI)
    if angle > math.pi:
        return angle - TWO_PI
    return angle + TWO_PI if angle <= -math.pi else angle


def error_of(robot: RobotPeriod, tick: int) -> ErrorSample:
    """The tracking error in a robot's record."""
    truth, at = robot.truth, robot.reference
    return ErrorSample(
        tick,
        100.0 * (truth.x_m - at.x_m),
        100.0 * (truth.y_m - at.y_m),
        wrapped(truth.theta_rad - at.theta_rad),
        not pitch.holds(msgspec.structs.replace(truth, theta_rad=wrapped(truth.theta_rad))),
    )
