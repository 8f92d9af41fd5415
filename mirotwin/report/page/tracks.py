"""The course of each robot as columns of numbers, one a control period: what pitch and plots draw.

Postures are the recorded numbers, unchanged; what a period does not have is NaN.

The LM629's velocity is known at each exposure. The actual one is the mean over the period before it: counts that the
encoder has moved on, in the samples of 8192 ticks that lie between. NaN where the position was set meanwhile.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from typing import TypeAlias

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, LM629_SAMPLE_TICKS, TICKS_PER_SECOND
from miro_host.wheels import UNITS_PER_COUNT, Wheels
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.periods import Axis, Period, RobotPeriod
from mirotwin.recording.channels import SampleMessage
from mirotwin.recording.track import RobotId, TrackingErrors, error_of
from mirotwin.report.seen import MeasuredErrors

Column: TypeAlias = "array[float]"
SIDES = ("left", "right")
M_S_PER_COUNT = UNITS_PER_COUNT / Wheels().units_per_m_s
"""Wheel speed of one count per sample, of a wheel with the nominal radius."""
_VELOCITY_SCALE = M_S_PER_COUNT / 65536.0
_PERIOD_SAMPLES = CONTROL_PERIOD_TICKS / LM629_SAMPLE_TICKS
_SETS_POSITION = frozenset(opcode for opcode, one in BY_OPCODE.items() if one.name in ("RESET", "DFH"))
_WRAP = 1 << 32
NAN = math.nan


def column() -> Column:
    return array("d")


class Postures:
    """Postures in m and rad, heading unwrapped where it was recorded so."""

    def __init__(self) -> None:
        self.x_m, self.y_m, self.theta_rad = column(), column(), column()

    def append(self, x_m: float, y_m: float, theta_rad: float) -> None:
        self.x_m.append(x_m)
        self.y_m.append(y_m)
        self.theta_rad.append(theta_rad)


class Wheel:
    """One wheel: speeds in m/s at the nominal radius. `told`: by the host, `profile`: of the LM629, `actual`."""

    def __init__(self) -> None:
        self.told, self.profile, self.actual = column(), column(), column()
        self._position: int | None = None

    def add(self, axis: Axis, told: int | None) -> None:
        before, self._position = self._position, axis.real_position
        self.told.append(NAN if told is None else told / UNITS_PER_COUNT * M_S_PER_COUNT)
        self.profile.append(axis.desired_velocity * _VELOCITY_SCALE)
        again = any(opcode in _SETS_POSITION for _, opcode, _ in axis.commands)
        if before is None or again:
            self.actual.append(NAN)
            return
        moved = (axis.real_position - before + _WRAP // 2) % _WRAP - _WRAP // 2
        self.actual.append(moved / _PERIOD_SAMPLES * M_S_PER_COUNT)


class Fine:
    """The profile of one wheel sample by sample, where a recording is full."""

    def __init__(self) -> None:
        self.times_s, self.profile = column(), column()


class RobotCourse:
    """One robot. `seen`: errors of measurements at their exposure; `steered`: a host steers it along its reference."""

    def __init__(self, place: RobotId, steered: bool, delay_frames: int) -> None:
        self.place = place
        self.steered = steered
        self.truth, self.reference, self.measured = Postures(), Postures(), Postures()
        self.errors = TrackingErrors()
        self.v_m_s, self.w_rad_s = column(), column()
        self.told_v_m_s, self.told_w_rad_s = column(), column()
        self.wheels = {side: Wheel() for side in SIDES}
        self.fine = {side: Fine() for side in SIDES}
        self._seen = MeasuredErrors(delay_frames)

    @property
    def name(self) -> str:
        return f"net{self.place[0]}/robot{self.place[1]}"

    @property
    def seen(self) -> TrackingErrors:
        return self._seen.errors

    def add(self, robot: RobotPeriod, tick: int) -> None:
        self.errors.append(error_of(robot, tick))
        self._seen.add(robot, tick)
        for postures, at in ((self.truth, robot.truth), (self.reference, robot.reference)):
            postures.append(at.x_m, at.y_m, at.theta_rad)
        seen, control = robot.measurement, robot.control
        self.measured.append(*((NAN, NAN, NAN) if seen is None else (seen.x_m, seen.y_m, seen.theta_rad)))
        self.v_m_s.append(robot.v_m_s)
        self.w_rad_s.append(robot.w_rad_s)
        self.told_v_m_s.append(NAN if control is None else control.v_m_s)
        self.told_w_rad_s.append(NAN if control is None else control.w_rad_s)
        self.wheels["left"].add(robot.left, None if control is None else control.left)
        self.wheels["right"].add(robot.right, None if control is None else control.right)


class Course(msgspec.Struct, frozen=True):
    """All robots of a run, in the order of the world. `first`: number of the first control period."""

    first: int
    ticks: list[int]
    robots: list[RobotCourse]

    @property
    def times_s(self) -> list[float]:
        return [tick / TICKS_PER_SECOND for tick in self.ticks]

    def index_at(self, tick: int) -> int:
        """The control period under way at `tick`, as a place in these columns; the nearest one beyond the ends."""
        if not self.ticks:
            return 0
        return max(0, min(len(self.ticks) - 1, (tick - self.ticks[0]) // CONTROL_PERIOD_TICKS))


def course_of(
    periods: Sequence[Period], steered: Sequence[bool], delay_frames: int, shown: range | None = None
) -> Course:
    """Of the periods with a number in `shown`. `steered`: for each network, whether its host steers."""
    robots: dict[RobotId, RobotCourse] = {}
    ticks = []
    for period in periods:
        if shown is not None and period.index not in shown:
            continue
        ticks.append(period.tick)
        for robot in period.robots:
            place = (robot.network, robot.slot)
            if place not in robots:
                robots[place] = RobotCourse(place, steered[robot.network], delay_frames)
            robots[place].add(robot, period.tick)
    first = ticks[0] // CONTROL_PERIOD_TICKS if ticks else 0
    return Course(first, ticks, list(robots.values()))


def add_samples(course: Course, samples: Sequence[tuple[RobotId, SampleMessage]]) -> None:
    """Puts the LM629 samples of a full recording to their robots, as far as the course goes."""
    if not course.ticks:
        return
    robots = {robot.place: robot for robot in course.robots}
    for place, sample in samples:
        if place in robots and course.ticks[0] <= sample.tick < course.ticks[-1] + CONTROL_PERIOD_TICKS:
            for side, fine in robots[place].fine.items():
                fine.times_s.append(sample.tick / TICKS_PER_SECOND)
                fine.profile.append(getattr(sample, f"{side}_desired_velocity") * _VELOCITY_SCALE)
