"""Checks of one event: that it happens between two ticks, or that it never does."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, get_args

from msgspec import Meta

from miro_exact.clock import NEVER_TICK
from miro_sim.world import conditions
from miro_sim.world.events import SIDES, Event
from mirotwin.verify.checks.interface import Check, Judge, Kind, Subject, in_ms

What = Literal["sent", "heard", "answer", "received", "transmitted", "frame", "command", "fault"]
AT_THE_PC = ("sent", "heard", "answer")
Tick = Annotated[int, Meta(ge=-1, lt=NEVER_TICK)]
_CONDITIONS: dict[str, tuple[type[conditions.Condition], dict[str, Any], str]] = {
    "sent": (conditions.Sent, {}, ""),
    "heard": (conditions.Heard, {}, "value"),
    "answer": (conditions.Answer, {}, ""),
    "received": (conditions.Byte, {"sent": False}, "value"),
    "transmitted": (conditions.Byte, {"sent": True}, "value"),
    "frame": (conditions.Frame, {}, ""),
    "command": (conditions.Command, {}, "name"),
    "fault": (conditions.Fault, {}, ""),
}
"""The condition of a wait for each event, its fixed fields, and the field that narrows it."""


class EventCheck(Check, frozen=True, kw_only=True):
    """An event after `after_tick`, up to `until_tick`, at the robot in `slot` (default: the first) or at its PC.

    `value`: of a character; `command`: name of an LM629 command, `side`: of which chip. For `answer`, `slot` is who
    answers, default anybody.
    """

    what: What
    after_tick: Tick = -1
    until_tick: Tick
    network: Annotated[int, Meta(ge=0)] = 0
    slot: Annotated[int, Meta(ge=0)] | None = None
    value: Annotated[int, Meta(ge=0, le=255)] | None = None
    command: str | None = None
    side: Literal["left", "right"] | None = None

    def __post_init__(self) -> None:
        if self.until_tick <= self.after_tick:
            raise ValueError(f"until_tick {self.until_tick}: give one after `after_tick` {self.after_tick}")
        _, _, narrow = _CONDITIONS[self.what]
        for key, allowed in (
            ("value", narrow == "value"),
            ("command", narrow == "name"),
            ("side", narrow == "name"),
        ):
            if getattr(self, key) is not None and not allowed:
                raise ValueError(f"{key}: does not go with {self.what!r}")
        self.condition()

    def condition(self) -> conditions.Condition:
        """The condition of a wait that means the same."""
        kind, fixed, narrow = _CONDITIONS[self.what]
        fields: dict[str, Any] = {**fixed, "network": self.network}
        if self.what == "answer":
            fields["robot"] = self.slot
        elif self.what == "command":
            fields.update(name=self.command, side=self.side)
        elif narrow:
            fields["value"] = self.value
        return kind(**fields)

    def problem(self, end_tick: int) -> str:
        if self.until_tick > end_tick:
            return f"until_tick {self.until_tick} is after the end of the run, tick {end_tick}"
        return ""

    def judge(self, subject: Subject) -> Judge[Check]:
        return EventJudge(self, subject)

    def __str__(self) -> str:
        fields: list[str] = [self.what]
        fields += [str(one) for one in (self.side, self.command) if one is not None]
        fields += [] if self.value is None else [f"{self.value:02X}h"]
        fields += [f"of robot {self.slot}"] if self.what == "answer" and self.slot is not None else []
        return " ".join(fields)


class Happens(EventCheck, frozen=True, kw_only=True, tag="happens"):
    """It happens."""

    KIND: ClassVar[Kind] = "liveness"


class NeverHappens(EventCheck, frozen=True, kw_only=True, tag="never_happens"):
    """It does not happen."""

    KIND: ClassVar[Kind] = "safety"


class EventJudge(Judge[EventCheck]):
    """Judges at one robot: that in `slot`, or the first of the network."""

    HEARS = get_args(What)

    def __init__(self, check: EventCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.condition = check.condition()
        at_pc = check.what in AT_THE_PC
        slots = [subject.first_slot if at_pc or check.slot is None else check.slot]
        self.mine = subject.network == check.network and subject.slot in slots
        self.done = not self.mine
        duration = in_ms(check.until_tick - max(check.after_tick, 0))
        self.wanted = (
            f"{check} within {duration}" if check.KIND == "liveness" else f"no {check} for {duration}"
        )

    def event(self, event: Event) -> None:
        self.until(event.tick)
        inside = self.check.after_tick < event.tick <= self.check.until_tick
        if self.done or not inside or not self.condition.met_by(event):
            return
        self.done = True
        self.judged += 1
        if self.check.KIND == "safety":
            self.fail(event.tick, self.wanted, str(event).partition(": ")[2])

    def until(self, tick: int) -> None:
        if self.done or tick <= self.check.until_tick:
            return
        self.done = True
        self.judged += 1
        if self.check.KIND == "liveness":
            self.fail(self.check.until_tick, self.wanted, "none")

    def end(self, tick: int) -> None:
        self.until(tick + 1)


assert set(_CONDITIONS) == set(get_args(What))
assert SIDES == ("left", "right")
