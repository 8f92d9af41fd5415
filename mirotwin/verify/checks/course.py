"""Checks of a robot's position: near its reference, settled in time, on the pitch.

They sample once a control period, at its start, like the summary. A failure is reported at the tick at which the robot
begins to violate the check.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_exact.clock import TICKS_PER_SECOND, seconds, ticks
from miro_sim.periods import RobotPeriod
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, ErrorSample, error_of
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject

LONGEST_S = 86_400.0
LimitCm = Annotated[float, Meta(gt=0.0, le=1000.0)]


class CourseCheck(Check, frozen=True, kw_only=True):
    """Looks at where the robot is, from `first_tick` of the run on."""

    KIND: ClassVar[Kind] = "safety"

    def first_tick(self, end_tick: int) -> int:
        return 0

    def wanted(self) -> str:
        raise NotImplementedError

    def found(self, error: ErrorSample) -> str:
        """The error of the robot's place in words, or the empty string."""
        raise NotImplementedError

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return CourseMonitor(self, subject)


class TracksWithin(CourseCheck, frozen=True, kw_only=True, tag="tracks_within_cm"):
    """The robot is never further than so from its reference, from `from_s` on; default: in the run's last second."""

    MAIN: ClassVar[str] = "limit_cm"

    limit_cm: LimitCm
    from_s: Annotated[float, Meta(ge=0.0, le=LONGEST_S)] | None = None

    def problem(self, end_tick: int) -> str:
        if self.from_s is not None and ticks(self.from_s) >= end_tick:
            return f"from_s: {self.from_s:g} s is not before the end of the run, {seconds(end_tick):g} s"
        return ""

    def first_tick(self, end_tick: int) -> int:
        return max(0, end_tick - TICKS_PER_SECOND) if self.from_s is None else ticks(self.from_s)

    def wanted(self) -> str:
        return f"at most {self.limit_cm:g} cm from the reference"

    def found(self, error: ErrorSample) -> str:
        return f"{error.position_cm:.3f} cm" if error.position_cm > self.limit_cm else ""


class SettlesWithin(CourseCheck, frozen=True, kw_only=True, tag="settles_within_s"):
    """From so long after the start of the run on the robot stays within `position_cm` and `heading_rad` of its
    reference.
    """

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "within_s"

    within_s: Annotated[float, Meta(ge=0.0, le=LONGEST_S)]
    position_cm: LimitCm = SETTLED_CM
    heading_rad: Annotated[float, Meta(gt=0.0, le=3.141592653589793)] = SETTLED_RAD

    def problem(self, end_tick: int) -> str:
        if ticks(self.within_s) >= end_tick:
            return f"{self.within_s:g} s is not before the end of the run, {seconds(end_tick):g} s"
        return ""

    def first_tick(self, end_tick: int) -> int:
        return ticks(self.within_s)

    def wanted(self) -> str:
        limits = f"{self.position_cm:g} cm and {self.heading_rad:g} rad"
        return f"within {limits} of the reference after {self.within_s:g} s"

    def found(self, error: ErrorSample) -> str:
        position_cm, heading_rad = error.position_cm, abs(error.theta_rad)
        if position_cm <= self.position_cm and heading_rad <= self.heading_rad:
            return ""
        return f"{position_cm:.3f} cm and {heading_rad:.4f} rad"


class InsidePitch(CourseCheck, frozen=True, kw_only=True, tag="inside_pitch"):
    """All corners of the robot's square stay on the pitch."""

    def wanted(self) -> str:
        return "all corners on the pitch"

    def found(self, error: ErrorSample) -> str:
        return "a corner beyond its edge" if error.off_pitch else ""


class CourseMonitor(Monitor[CourseCheck]):
    """Records the begin of each violation."""

    LATER = True

    def __init__(self, check: CourseCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.first_tick = check.first_tick(subject.end_tick)
        self.wrong = False

    def period(self, record: RobotPeriod, tick: int) -> None:
        if tick < self.first_tick:
            return
        self.judged += 1
        before, reason = self.wrong, self.check.found(error_of(record.truth, record.reference, tick))
        self.wrong = bool(reason)
        if reason and not before:
            self.fail(tick, self.check.wanted(), reason)
