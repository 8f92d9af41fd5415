"""The motion of each robot in a run, as columns of numbers, for summary, figures, pages and campaigns.

A run of hours has 100 000 periods an hour: a record of a period is some 3 KB, its row in these columns some 200 bytes.
A column is an `array`, which grows; `numpy.asarray` reads it without a copy. Missing values are NaN.

Errors are truth against the reference at the same tick, e = c - r in the paper's axes, heading wrapped to (-pi, pi].
"""

from __future__ import annotations

import math
from array import array
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import Any, TypeAlias

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_sim.periods import Period, RobotId, RobotPeriod
from miro_sim.pitch import ground as pitch
from mirotwin.recording.channels import TheoryMessage
from mirotwin.recording.theory.track import TheoryTrack

TWO_PI = 6.283185307179586
SETTLED_CM = 3.0
SETTLED_RAD = 0.15
NAN = math.nan
LONGEST_FRAMES = 40
"""Frames for which a reference is held; more than any camera's delay."""

Column: TypeAlias = "array[float]"


def column() -> Column:
    return array("d")


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
    def within_limits(self) -> bool:
        """Within 3 cm and 0.15 rad."""
        return self.position_cm <= SETTLED_CM and abs(self.theta_rad) <= SETTLED_RAD


class TrackingErrors(Sequence[ErrorSample]):
    """Tracking errors of one robot in the order of time."""

    def __init__(self) -> None:
        self.ticks, self.off_pitch = array("q"), array("b")
        self.x_cm, self.y_cm, self.theta_rad = column(), column(), column()

    def append(self, sample: ErrorSample) -> None:
        self.ticks.append(sample.tick)
        self.x_cm.append(sample.x_cm)
        self.y_cm.append(sample.y_cm)
        self.theta_rad.append(sample.theta_rad)
        self.off_pitch.append(sample.off_pitch)

    def __len__(self) -> int:
        return len(self.ticks)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[at] for at in range(*index.indices(len(self)))]
        error = self.x_cm[index], self.y_cm[index], self.theta_rad[index]
        return ErrorSample(self.ticks[index], *error, bool(self.off_pitch[index]))


def last_second(samples: Sequence[ErrorSample]) -> Sequence[ErrorSample]:
    """The samples of the last second of a run that has some; all, if it is shorter."""
    return [sample for sample in samples if sample.tick > samples[-1].tick - TICKS_PER_SECOND]


def settled(samples: Sequence[ErrorSample]) -> bool:
    """True if a robot has settled: it was within 3 cm and 0.15 rad for the whole last second of the run."""
    return all(sample.within_limits for sample in last_second(samples))


class Postures:
    """Postures as they were recorded, in m and rad."""

    def __init__(self) -> None:
        self.x_m, self.y_m, self.theta_rad = column(), column(), column()

    def append(self, posture: Posture | None) -> None:
        self.x_m.append(NAN if posture is None else posture.x_m)
        self.y_m.append(NAN if posture is None else posture.y_m)
        self.theta_rad.append(NAN if posture is None else posture.theta_rad)

    def points_cm(self) -> tuple[list[float], list[float]]:
        """x and y of the points that exist."""
        there = [(x, y) for x, y in zip(self.x_m, self.y_m, strict=True) if not math.isnan(x)]
        return [100.0 * x for x, _ in there], [100.0 * y for _, y in there]


class Series:
    """A value against time."""

    def __init__(self) -> None:
        self.times_s, self.values = column(), column()

    def append(self, tick: int, value: float) -> None:
        self.times_s.append(seconds(tick))
        self.values.append(value)


class MeasuredErrors(TrackingErrors):
    """Tracking errors as the PC could plot them: measurements against the reference at their exposure.

    A measurement arrives some frames after its exposure. It is compared with the reference at the exposure, so a delay
    alone is no error: a laboratory without another camera can plot nothing better. `delay_frames`: delay of a camera
    whose measurements have no tick; without it the columns stay empty.
    """

    def __init__(self, delay_frames: int | None) -> None:
        super().__init__()
        self.delay_frames = delay_frames
        self._references: dict[int, Posture] = {}

    def add(self, robot: RobotPeriod, tick: int) -> None:
        """Takes over the measurement of the next control period."""
        if self.delay_frames is None:
            return
        self._references[tick] = robot.reference
        self._references.pop(tick - LONGEST_FRAMES * CONTROL_PERIOD_TICKS, None)
        measured = robot.measurement
        if measured is None:
            return
        exposed = (
            measured.tick
            if isinstance(measured, Sighting)
            else tick - self.delay_frames * CONTROL_PERIOD_TICKS
        )
        reference = self._references.get(exposed)
        if reference is not None:
            self.append(error_of(measured, reference, exposed))


class RobotTrack:
    """One robot: true, reference and measured postures; true errors, and errors of the measurements.

    `delay_frames` as in `MeasuredErrors`. `theory`: filled by `Tracks`.
    """

    def __init__(self, delay_frames: int | None = None) -> None:
        self.truth, self.reference, self.measured = Postures(), Postures(), Postures()
        self.errors = TrackingErrors()
        self.measured_errors = MeasuredErrors(delay_frames)
        self.theory = TheoryTrack()

    def add(self, robot: RobotPeriod, tick: int) -> None:
        self.truth.append(robot.truth)
        self.reference.append(robot.reference)
        self.measured.append(robot.measurement)
        self.errors.append(error_of(robot.truth, robot.reference, tick))
        self.measured_errors.add(robot, tick)


class Tracks:
    """All robots of a run, in the order of the world.

    `count` control periods with `digest` at the end of the last one. `inner`: name of a law's inner value -> robot ->
    its series, names in the order of the robots and of their laws. `delay_frames` as in `RobotTrack`.
    """

    def __init__(self, periods: Iterable[Period] = (), delay_frames: int | None = None) -> None:
        self.delay_frames = delay_frames
        self.count = 0
        self.digest = ""
        self.robots: dict[RobotId, RobotTrack] = {}
        self.inner: dict[str, dict[RobotId, Series]] = defaultdict(partial(defaultdict, Series))
        for period in periods:
            self.add(period)

    def add(self, period: Period) -> None:
        """Adds the next control period."""
        for robot in period.robots:
            robot_id = (robot.network, robot.slot)
            track = self.robots.get(robot_id)
            if track is None:
                track = self.robots[robot_id] = RobotTrack(self.delay_frames)
            track.add(robot, period.tick)
            track.theory.add(robot, period.tick)
            for name, value in robot.control.inner.items() if robot.control is not None else ():
                self.inner[name][robot_id].append(period.tick, value)
        self.count += 1
        self.digest = period.digest

    def theories(self) -> Iterator[tuple[int, int, TheoryMessage]]:
        """Network, slot and theory values of each steered robot in the period that was added last."""
        for (network, slot), track in self.robots.items():
            if track.theory.now is not None:
                yield network, slot, track.theory.now


def wrapped(angle_rad: float) -> float:
    """The angle in (-pi, pi]."""
    angle = math.fmod(angle_rad, TWO_PI)
    if angle > math.pi:
        return angle - TWO_PI
    return angle + TWO_PI if angle <= -math.pi else angle


def error_of(posture: Posture, reference: Posture, tick: int) -> ErrorSample:
    """The tracking error of a robot at `posture` against the `reference`, at `tick`."""
    return ErrorSample(
        tick,
        100.0 * (posture.x_m - reference.x_m),
        100.0 * (posture.y_m - reference.y_m),
        wrapped(posture.theta_rad - reference.theta_rad),
        not pitch.holds(Posture(posture.x_m, posture.y_m, wrapped(posture.theta_rad))),
    )
