"""Checks of the failsafe: without a fresh frame the wheels get the order to stop in time, and motors go off in time.

Too early is as wrong as too late. The rule is `miro_protocol.robot_rules.SilenceRule` (protocol/README.md, "Freshness
and failsafe").
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_protocol.robot_rules import ACTING_TICKS, SilenceRule
from miro_protocol.table import TICKS_PER_MS
from miro_sim.world.events import Event
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, in_ms, ms_ticks
from mirotwin.verify.checks.orders import Order, OrdersMonitor

ACTING_MS = ACTING_TICKS / TICKS_PER_MS
"""Firmware has dealt with a frame so long after it."""

TimeMs = Annotated[float, Meta(gt=ACTING_MS, le=60_000.0)]
ToleranceMs = Annotated[float, Meta(ge=0.0, le=1000.0)]


class SilenceCheck(Check, frozen=True, kw_only=True):
    """So long after the last fresh frame, within +- `tolerance_ms` (half a millisecond is 1.5 LM629 samples)."""

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "after_ms"
    WANTED: ClassVar[str] = ""

    after_ms: TimeMs = 110.0
    tolerance_ms: ToleranceMs = 0.5

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return SilenceMonitor(self, subject)

    def fulfilled(self, order: Order) -> bool:
        """True if a wheel under this order is as it has to be after that time."""
        raise NotImplementedError


class FailsafeStop(SilenceCheck, frozen=True, kw_only=True, tag="failsafe_stop_ms"):
    """Without a fresh frame both wheels receive the order to stop."""

    WANTED = "both wheels told to stop"

    def fulfilled(self, order: Order) -> bool:
        return not order.moves


class MotorsOff(SilenceCheck, frozen=True, kw_only=True, tag="motors_off_ms"):
    """Without a fresh frame both motors go off."""

    WANTED = "both motors off"

    after_ms: TimeMs = 500.0

    def fulfilled(self, order: Order) -> bool:
        return order.what == "off"


class SilenceMonitor(OrdersMonitor[SilenceCheck]):
    """`in_time`: a wheel received its order in time. A standing wheel needs no order and is not judged.

    `late`: (end of the last fresh frame, tick of the failure) of wheels without an order yet. A lost wheel switches
    both motors off at any time: a silence with a lost wheel is not judged.
    """

    EVENTS = ("received", "frame", "command", "wheel_lost")

    def __init__(self, check: SilenceCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.rule = SilenceRule(ms_ticks(check.after_ms), ms_ticks(check.tolerance_ms))
        self.in_time = False
        self.late: tuple[int, int] | None = None
        self.wanted = (
            f"{check.WANTED} {check.after_ms:g} +- {check.tolerance_ms:g} ms after the last fresh frame"
        )

    def event(self, event: Event) -> None:
        self.until(event.tick)
        if event.what == "received":
            self.rule.received(event.tick)
        elif event.what == "frame":
            if event.value and event.frame is not None:
                self._fail_late(event.tick)
                self.rule.last_tick = event.frame.last_tick
                self.in_time = False
        elif event.what == "wheel_lost":
            self.rule.last_tick = -1
        else:
            self._command(event)

    def _command(self, event: Event) -> None:
        unfulfilled = self._unfulfilled()
        order = self.orders.take(event)
        if not self._unfulfilled():
            self._fail_late(event.tick)
        if order is None or not self.check.fulfilled(order) or order.side not in unfulfilled:
            return
        if self.rule.is_early(event.tick):
            self.judged += 1
            after = in_ms(event.tick - self.rule.end_tick())
            self.fail(event.tick, self.wanted, f"the {order.side} one after {after}")
            self.rule.last_tick = -1
        elif self.rule.is_judged(event.tick):
            self.in_time = True

    def restarted(self, tick: int) -> None:
        self.until(tick)
        self._fail_late(tick)
        self.rule.last_tick = -1
        super().restarted(tick)

    def end(self, tick: int) -> None:
        self._fail_late(tick)

    def until(self, tick: int) -> None:
        if not self.rule.is_over(tick):
            return
        unfulfilled = self._unfulfilled()
        self.judged += bool(unfulfilled or self.in_time)
        if unfulfilled:
            self.late = (self.rule.end_tick(), self.rule.deadline())
        self.rule.last_tick = -1

    def _fail_late(self, tick: int) -> None:
        """Reports late wheels when the delay is known: at `tick` they receive their order, or the wait ends."""
        if self.late is not None:
            (fresh_tick, latest_tick), self.late = self.late, None
            texts = [self._when(order, fresh_tick, tick) for order in self.orders.last.values()]
            self.fail(latest_tick, self.wanted, ", ".join(texts))

    def _when(self, order: Order, fresh_tick: int, tick: int) -> str:
        if not self.check.fulfilled(order):
            return f"{order.side} not within {in_ms(tick - fresh_tick)}"
        if order.tick <= fresh_tick:
            return f"{order.side} before that frame"
        return f"{order.side} at {in_ms(order.tick - fresh_tick)}"

    def _unfulfilled(self) -> list[str]:
        return [side for side, order in self.orders.last.items() if not self.check.fulfilled(order)]
