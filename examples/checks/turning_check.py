"""A check of one's own: the robot never turns faster than so.

`mirotwin.verify.checks.interface` says what a monitor may be told: besides control periods, as here, events of the logs
and firmware faults.
"""

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_sim.periods import RobotPeriod
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject


class TurnsAtMost(Check, frozen=True, kw_only=True, tag="turns_at_most_rad_s"):
    """The robot turns at most so fast at the start of each control period, from `from_s` on."""

    KIND: ClassVar[Kind] = "safety"
    MAIN: ClassVar[str] = "limit_rad_s"

    limit_rad_s: Annotated[float, Meta(gt=0.0, le=1000.0)]
    from_s: Annotated[float, Meta(ge=0.0)] = 0.0

    def monitor(self, subject: Subject) -> "TurningMonitor":
        return TurningMonitor(self, subject)


class TurningMonitor(Monitor[TurnsAtMost]):
    """`fast`: it turned too fast a control period ago. It fails once each time, not once a period."""

    fast = False

    def period(self, record: RobotPeriod, tick: int) -> None:
        if tick < self.check.from_s * 24e6:
            return
        self.judged += 1
        before, self.fast = self.fast, abs(record.w_rad_s) > self.check.limit_rad_s
        if self.fast and not before:
            self.fail(tick, f"at most {self.check.limit_rad_s:g} rad/s", f"{record.w_rad_s:.3f} rad/s")
