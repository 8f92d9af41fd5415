"""Checks of how a robot acts on the frames that it receives."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_exact.bad_input import amount
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import ContentError, TeamFrame
from miro_protocol.robot_rules import NO_WORD, DrivingRule, OriginRule
from miro_sim.periods import RobotPeriod
from miro_sim.world.device import COUNTERS
from miro_sim.world.events import Event
from mirotwin.verify.checks.failsafe import ACTING_MS
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, in_ms, ms_ticks
from mirotwin.verify.checks.orders import OrdersMonitor, saturated

WithinMs = Annotated[float, Meta(gt=0.0, le=60_000.0)]
Words = tuple[int, int]


class MovesOnlyWhenFresh(Check, frozen=True, kw_only=True, tag="moves_only_when_fresh"):
    """A wheel receives an order to turn only within `within_ms` of the last character of a fresh frame."""

    KIND: ClassVar[Kind] = "safety"

    within_ms: WithinMs = ACTING_MS

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return MovesMonitor(self, subject)


class MovesMonitor(OrdersMonitor[MovesOnlyWhenFresh]):
    EVENTS = ("frame", "command")

    def __init__(self, check: MovesOnlyWhenFresh, subject: Subject) -> None:
        super().__init__(check, subject)
        self.rule = DrivingRule(ms_ticks(check.within_ms))

    def restarted(self, tick: int) -> None:
        super().restarted(tick)
        self.rule.begin()

    def event(self, event: Event) -> None:
        if event.what == "frame":
            if event.value and event.frame is not None:
                self.rule.fresh_tick = event.frame.last_tick
            return
        order = self.orders.take(event)
        if order is None or not order.moves:
            return
        self.judged += 1
        if not self.rule.may_move(event.tick):
            fresh_tick = self.rule.fresh_tick
            when = (
                f" after {in_ms(event.tick - fresh_tick)}" if fresh_tick >= 0 else ", before any fresh frame"
            )
            wanted = f"wheels told to turn only within {self.check.within_ms:g} ms of a fresh frame"
            self.fail(event.tick, wanted, f"the {order.side} one{when}")


class AcceptsOnlySent(Check, frozen=True, kw_only=True, tag="accepts_only_sent"):
    """Both wheels get the velocities of one team frame that this network's host began to send in the last `within_ms`,
    cut off at +-16633. Velocity 0 is always allowed: it is a way to stop.
    """

    KIND: ClassVar[Kind] = "safety"

    within_ms: WithinMs = 1000.0

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return SentMonitor(self, subject)


class SentMonitor(OrdersMonitor[AcceptsOnlySent]):
    """`ordered_tick`: of orders that are not judged yet, because one to the other wheel may come on the same tick."""

    EVENTS = ("sent", "command")

    def __init__(self, check: AcceptsOnlySent, subject: Subject) -> None:
        super().__init__(check, subject)
        self.decoder = Decoder(subject.robots)
        self.rule = OriginRule(ms_ticks(check.within_ms))
        self.ordered_tick: int | None = None

    def event(self, event: Event) -> None:
        self.until(event.tick)
        if event.what == "sent":
            self._note_sent(event)
            return
        order = self.orders.take(event)
        if order is not None and order.moves:
            self.ordered_tick = event.tick

    def _note_sent(self, event: Event) -> None:
        for reception in self.decoder.feed(event.data, event.tick):
            words = words_of(reception, self.subject) if isinstance(reception, Received) else None
            if words is not None:
                self.rule.team(reception.start_tick, *words)

    def until(self, tick: int) -> None:
        if self.ordered_tick is None or tick <= self.ordered_tick:
            return
        order_tick, self.ordered_tick = self.ordered_tick, None
        self.judged += 1
        words = self.orders.words()
        if not self.rule.allows(order_tick, *words):
            wanted = f"velocities that the host sent in the last {self.check.within_ms:g} ms"
            left, right = (None if word == NO_WORD else word for word in words)
            self.fail(order_tick, wanted, f"{left}, {right} (left, right)")

    def end(self, tick: int) -> None:
        self.until(tick + 1)


class ActsCheck(Check, frozen=True, kw_only=True):
    """A robot acts on frames within `within_ms` of the start bit of the last character."""

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "within_ms"
    AFTER_DAMAGE: ClassVar[bool] = False

    within_ms: WithinMs = ACTING_MS

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return ActsMonitor(self, subject)


class ActsWithin(ActsCheck, frozen=True, kw_only=True, tag="acts_within_ms"):
    """On each fresh team frame both wheels receive its velocities in time, unless that is 0 and they stop already."""


class BackInSync(ActsCheck, frozen=True, kw_only=True, tag="back_in_sync_within_ms"):
    """On the first valid frame after characters that are no frame both wheels receive its velocities in time."""

    AFTER_DAMAGE = True


class ActsMonitor(OrdersMonitor[ActsCheck]):
    """`damaged`: characters that are no frame came since the last frame.

    `lost`: a wheel does not follow, so the robot must stand until both wheels are ordered to stand.
    """

    EVENTS = ("frame", "damaged", "command", "wheel_lost")

    def __init__(self, check: ActsCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.damaged = self.lost = False
        self.rule = DrivingRule(ms_ticks(check.within_ms))

    def event(self, event: Event) -> None:
        self.until(event.tick)
        if event.what == "damaged":
            self.damaged = True
        elif event.what == "frame":
            self._frame(event)
        elif event.what == "wheel_lost":
            self.lost = True
            self.rule.begin()
        elif self.orders.take(event) is not None:
            self.rule.told(*self.orders.words())

    def restarted(self, tick: int) -> None:
        super().restarted(tick)
        self.rule.begin()
        self.damaged = self.lost = False

    def _frame(self, event: Event) -> None:
        damaged, self.damaged = self.damaged, False
        frame = event.frame
        if frame is None or not event.value or (self.check.AFTER_DAMAGE and not damaged):
            return
        words = words_of(frame, self.subject)
        if words == (0, 0):
            self.lost = False
        if words is not None and not self.lost:
            self.judged += 1
            if words != (0, 0) or not self._stopping():
                self.rule.team(frame.last_tick, *words)

    def _stopping(self) -> bool:
        """True if both wheels are ordered to stop with their loops closed: velocity 0 changes nothing for them."""
        return all(order.what != "off" and not order.moves for order in self.orders.last.values())

    def until(self, tick: int) -> None:
        while (missed := self.rule.missed(tick)) is not None:
            deadline, *words = missed
            after = " after damage" if self.check.AFTER_DAMAGE else ""
            wanted = (
                f"wheels told {words[0]}, {words[1]} within {self.check.within_ms:g} ms of a frame{after}"
            )
            left, right = self.orders.last["left"], self.orders.last["right"]
            self.fail(deadline, wanted, f"{left.what} {left.word}, {right.what} {right.word}")


class FramesAccepted(Check, frozen=True, kw_only=True, tag="frames_accepted_min"):
    """The firmware counts at least so many fresh frames by the end of the run; needs its counter."""

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "frames"

    frames: Annotated[int, Meta(ge=1, le=1 << 40)]

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return AcceptedMonitor(self, subject)


class AcceptedMonitor(Monitor[FramesAccepted]):
    """`counter`: the firmware's, which wraps at 2^16, `frames` does not."""

    LATER = True

    def __init__(self, check: FramesAccepted, subject: Subject) -> None:
        super().__init__(check, subject)
        self.counter = 0
        self.frames = 0
        if subject.robot.counter(0) is None:
            self.unseen = f"the image has no symbol {COUNTERS[0]}, which its .map or .cdb would name"

    def period(self, record: RobotPeriod, tick: int) -> None:
        self._count(record.accepted)

    def end(self, tick: int) -> None:
        accepted = self.subject.robot.counter(0)
        if accepted is None:
            return
        self._count(accepted)
        if self.frames < self.check.frames and self.subject.cut and tick < self.subject.end_tick:
            return
        self.judged += 1
        if self.frames < self.check.frames:
            self.fail(tick, f"at least {amount(self.check.frames, 'frame')} accepted", f"{self.frames}")

    def restarted(self, tick: int) -> None:
        self.counter = 0

    def _count(self, counter: int | None) -> None:
        if counter is not None:
            self.frames += (counter - self.counter) & 0xFFFF
            self.counter = counter


def words_of(frame: Received, subject: Subject) -> Words | None:
    """The velocities that a team frame has for this robot, cut off as firmware does; None for other frames."""
    try:
        message = frame.message(subject.robots)
    except ContentError:  # contents to come: valid, but no robot acts on it
        return None
    if not isinstance(message, TeamFrame) or subject.slot >= len(message.velocities):
        return None
    left, right = message.velocities[subject.slot]
    return saturated(left), saturated(right)
