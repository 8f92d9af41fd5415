"""The steps that a scenario may have: one frozen struct a kind, each an action or a wait.

A table of a step has one key that says what it is, its verb: `VERBS`. The others are the verb's own.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import msgspec
from msgspec import Meta

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds, ticks
from miro_sim.world.conditions import Condition, Network, Slot, SpeedMS, WheelSpeeds
from mirotwin.verify.checks.interface import Check
from mirotwin.verify.steps.sends import Send

LONGEST_MS = 86_400_000.0
PauseMs = Annotated[float, Meta(gt=0.0, le=LONGEST_MS)]
WithinMs = Annotated[float, Meta(ge=0.0, le=LONGEST_MS)]
Verb = Literal["wait_for", "expect"]


def ms_ticks(time_ms: float) -> int:
    """Ticks of so many milliseconds, which need not be whole."""
    return ticks(time_ms / 1000.0)


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base. `number`: from 1 on, as messages count them. `note`: for people, in the messages of the step."""

    VERB: ClassVar[str] = ""

    number: int = 0
    note: str = ""

    @property
    def network(self) -> int:
        return 0

    def lasts_ticks(self) -> int:
        """How long it takes at least."""
        return 0

    def needs_ticks(self) -> int:
        """How long it may take, by what it says."""
        return self.lasts_ticks()

    def said(self) -> str:
        """What it is, in a few words."""
        return self.VERB

    def __str__(self) -> str:
        note = f" ({self.note})" if self.note else ""
        return f"step {self.number}{note}: {self.said()}"


class SendStep(Step, frozen=True, kw_only=True):
    """`send`: a frame or characters, once, as soon as the transmitter is free."""

    VERB = "send"

    what: Send

    @property
    def network(self) -> int:
        return self.what.network

    def said(self) -> str:
        return f"send {self.what.name}"


class StreamStep(Step, frozen=True, kw_only=True):
    """`stream = "on"`: from now on team frames go out by themselves, as a station's do, with the velocities told last.

    `every_ms`: left out, a camera period (33.367). `frames`: so many, and then no more. `slot`, `left_m_s`,
    `right_m_s`: velocities that are told first. `ask`: each asks the robot whose turn it is. `"off"`: no more.
    """

    VERB = "stream"

    stream: Literal["on", "off"]
    network_: Network = msgspec.field(default=0, name="network")
    every_ms: PauseMs | None = None
    frames: Annotated[int, Meta(ge=1, le=1_000_000)] | None = None
    slot: Slot | None = None
    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    ask: bool = True

    @property
    def network(self) -> int:
        return self.network_

    @property
    def every_ticks(self) -> int:
        return CONTROL_PERIOD_TICKS if self.every_ms is None else ms_ticks(self.every_ms)

    def said(self) -> str:
        return f"stream {self.stream}"


class WaitStep(Step, frozen=True, kw_only=True):
    """`wait_for`: goes on to the first event that fits. `expect`: the next event of the kind has to fit.

    What happened since the last wait counts, unless `from_now`. `within_ms`, from now on: left out, to the run's end.
    """

    verb: Verb
    condition: Condition
    within_ms: WithinMs | None = None
    from_now: bool = False

    @property
    def network(self) -> int:
        return self.condition.network

    def needs_ticks(self) -> int:
        return 0 if self.within_ms is None else ms_ticks(self.within_ms)

    def said(self) -> str:
        return f"{self.verb} {self.condition.what}"

    @property
    def wanted(self) -> str:
        within = "" if self.within_ms is None else f" within {self.within_ms:g} ms"
        return f"{self.condition}{within}"


class NeverStep(Step, frozen=True, kw_only=True):
    """`never`: no event that fits, for so long from now on. `silence_for_ms` is this for a character at the PC."""

    VERB = "never"

    condition: Condition
    for_ms: PauseMs

    @property
    def network(self) -> int:
        return self.condition.network

    def lasts_ticks(self) -> int:
        return ms_ticks(self.for_ms)

    def said(self) -> str:
        return f"never {self.condition.what}"


class HoldStep(Step, frozen=True, kw_only=True):
    """`hold = "wheels"`: they turn as fast as this, for so long from now on."""

    VERB = "hold"

    condition: WheelSpeeds
    for_ms: PauseMs

    @property
    def network(self) -> int:
        return self.condition.network

    def lasts_ticks(self) -> int:
        return ms_ticks(self.for_ms)

    def said(self) -> str:
        return "hold wheels"


class PauseStep(Step, frozen=True, kw_only=True):
    """`pause_ms`: time passes. What happens meanwhile is there for the next wait."""

    VERB = "pause_ms"

    pause_ms: PauseMs

    def lasts_ticks(self) -> int:
        return ms_ticks(self.pause_ms)


class CheckStep(Step, frozen=True, kw_only=True):
    """`check`: checks as in `[expect]`, judged from now on, for the robots of `network`, or for that in `slot`."""

    VERB = "check"

    check: dict[str, Any]
    network_: Network | None = msgspec.field(default=None, name="network")
    slot: Slot | None = None
    checks: tuple[Check, ...] = ()

    @property
    def network(self) -> int:
        return self.network_ or 0

    def said(self) -> str:
        return f"check {', '.join(self.check)}"


class RadioStep(Step, frozen=True, kw_only=True):
    """`radio`: of a network: `up`, `down` (no carrier) or `noise` (the receiver hears noise)."""

    VERB = "radio"

    radio: Literal["up", "down", "noise"]
    network_: Network = msgspec.field(default=0, name="network")

    @property
    def network(self) -> int:
        return self.network_

    def said(self) -> str:
        return f"radio {self.radio}"


class ResetStep(Step, frozen=True, kw_only=True):
    """`reset`: the level of a robot's reset pin; 1 holds its processor in reset."""

    VERB = "reset"

    reset: Literal[0, 1]
    network_: Network = msgspec.field(default=0, name="network")
    slot: Slot | None = None

    @property
    def network(self) -> int:
        return self.network_

    def said(self) -> str:
        return f"reset {self.reset}"


class PowerStep(Step, frozen=True, kw_only=True):
    """`power`: a robot is switched off, or on."""

    VERB = "power"

    power: Literal["on", "off"]
    network_: Network = msgspec.field(default=0, name="network")
    slot: Slot | None = None

    @property
    def network(self) -> int:
        return self.network_

    def said(self) -> str:
        return f"power {self.power}"


class SaveStep(Step, frozen=True, kw_only=True):
    """`save`: the world's state, as `World.save` gives it, into a file of this name (`NAME.world`)."""

    VERB = "save"

    save: str

    def said(self) -> str:
        return f"save {self.save}"


PLAIN: dict[str, type[Step]] = {
    struct.VERB: struct
    for struct in (StreamStep, PauseStep, CheckStep, RadioStep, ResetStep, PowerStep, SaveStep)
}
"""Those whose table is read as it stands."""
VERBS = ("send", "stream", "wait_for", "expect", "never", "silence_for_ms", "hold", *list(PLAIN)[1:])


def end_ms(tick: int) -> str:
    """A time of a run for people."""
    return f"{1000.0 * seconds(tick):.3f} ms"
