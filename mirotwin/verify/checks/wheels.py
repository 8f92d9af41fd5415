"""The check of the wheels' speed: the requested one and the real one."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_host.wheels import Wheels
from miro_sim.periods import RobotPeriod
from miro_sim.world.events import SIDES, Event
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject
from mirotwin.verify.checks.orders import OrdersMonitor

_NOMINAL = Wheels()
_UNITS_OF_1616 = 256.0
"""Of an LM629's velocity register (16.16 counts per sample) in one unit of the radio (1/256 count per sample)."""


class WheelsWithin(Check, frozen=True, kw_only=True, tag="wheels_within_m_s"):
    """No wheel is told to turn faster than so, rim speed at the nominal radius, and none is faster than that and
    `overshoot_m_s` at the start of a control period.
    """

    KIND: ClassVar[Kind] = "safety"
    MAIN: ClassVar[str] = "limit_m_s"

    limit_m_s: Annotated[float, Meta(gt=0.0, le=100.0)]
    overshoot_m_s: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.1

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return WheelsMonitor(self, subject)


class WheelsMonitor(OrdersMonitor[WheelsWithin]):
    """`faster`: the sides that were too fast at the last look."""

    EVENTS = ("command",)

    def __init__(self, check: WheelsWithin, subject: Subject) -> None:
        super().__init__(check, subject)
        self.faster: set[str] = set()

    def event(self, event: Event) -> None:
        order = self.orders.take(event)
        if order is None or order.what != "drive":
            return
        self.judged += 1
        speed_m_s = order.velocity / _UNITS_OF_1616 / _NOMINAL.units_per_m_s
        if abs(speed_m_s) > self.check.limit_m_s:
            wanted = f"orders to a wheel of at most {self.check.limit_m_s:g} m/s"
            self.fail(event.tick, wanted, f"{speed_m_s:.4f} m/s for the {order.side} one")

    def period(self, record: RobotPeriod, tick: int) -> None:
        self.judged += 1
        limit_m_s = self.check.limit_m_s + self.check.overshoot_m_s
        wheels = Wheels(track_m=self.subject.robot.spec.drive.chassis.track_m)
        for side, speed_m_s in zip(SIDES, wheels.split(record.v_m_s, record.w_rad_s), strict=True):
            fast = abs(speed_m_s) > limit_m_s
            if fast and side not in self.faster:
                self.faster.add(side)
                self.fail(
                    tick, f"a wheel at most {limit_m_s:g} m/s fast", f"{speed_m_s:.4f} m/s of the {side} one"
                )
            elif not fast:
                self.faster.discard(side)
