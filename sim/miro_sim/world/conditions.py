"""The conditions of a wait: `World.run_until(condition)`.

`slot` None is the network's first robot; conditions of the PC have none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

import msgspec

from miro_robot.lm629.commands import BY_NAME
from miro_sim.world.events import PC, SIDES, Event

if TYPE_CHECKING:
    from miro_sim.world.robot import Robot


class Condition(msgspec.Struct, frozen=True, kw_only=True):
    """Something that becomes true at a tick, on `network` and there at `slot`."""

    network: int = 0
    slot: int | None = None

    def met_by(self, event: Event) -> bool:
        """Whether this event, of the network and slot that are meant, fulfils the condition."""
        raise NotImplementedError


class Sent(Condition, frozen=True, kw_only=True):
    """The network's host begins a transmission."""

    def met_by(self, event: Event) -> bool:
        return event.what == "sent"


class Heard(Condition, frozen=True, kw_only=True):
    """The PC hears a character (`value`: this one) from a robot."""

    value: int | None = None

    def met_by(self, event: Event) -> bool:
        return event.what == "heard" and self.value in (None, event.value)


class Answer(Condition, frozen=True, kw_only=True):
    """The PC hears a valid answer, of the robot in slot `robot` or of any."""

    robot: int | None = None

    def met_by(self, event: Event) -> bool:
        return event.what == "answer" and self.robot in (None, event.value)


class Byte(Condition, frozen=True, kw_only=True):
    """A robot's serial port has received a character (`value`: this one), or with `sent` has sent it."""

    value: int | None = None
    sent: bool = False

    def met_by(self, event: Event) -> bool:
        return event.what == ("transmitted" if self.sent else "received") and self.value in (
            None,
            event.value,
        )


class Frame(Condition, frozen=True, kw_only=True):
    """A robot's serial port has received the last character of a valid frame, fresh or not."""

    def met_by(self, event: Event) -> bool:
        return event.what == "frame"


class Command(Condition, frozen=True, kw_only=True):
    """An LM629 has completed a command: of one `side` or either, of this `name` (`STT`, ..) or any."""

    name: str | None = None
    side: Literal["left", "right"] | None = None

    def __post_init__(self) -> None:
        if self.name is not None and self.name not in BY_NAME:
            raise ValueError(f"{self.name!r} is no LM629 command; there are {', '.join(BY_NAME)}")
        if self.side not in (None, *SIDES):
            raise ValueError(f"side {self.side!r}: give left or right")

    def met_by(self, event: Event) -> bool:
        name_fits = self.name is None or event.opcode == BY_NAME[self.name].opcode
        return event.what == "command" and name_fits and self.side in (None, event.side)


class Fault(Condition, frozen=True, kw_only=True):
    """The firmware does what it must not."""

    def met_by(self, event: Event) -> bool:
        return event.what == "fault"


class Reached(Condition, frozen=True, kw_only=True):
    """The instruction at `place`, an address or a symbol of the image, is the next to be executed.

    `address` is filled in by the world.
    """

    place: int | str
    address: int = -1

    def met_by(self, event: Event) -> bool:
        return event.what == "reached" and event.address == self.address


class Edge(Condition, frozen=True, kw_only=True):
    """A `pin` of the robot's board changes (to `level`): `rxd`, `txd`, `P1.0`, `left.hi`, .. (`pins.PINS`)."""

    pin: str
    level: Literal[0, 1] | None = None

    def met_by(self, event: Event) -> bool:
        return event.what == "edge" and event.pin == self.pin and self.level in (None, event.value)


class Touch(Condition, frozen=True, kw_only=True):
    """A robot of the network touches another robot on the pitch, seen on the contact grid of 1 ms."""

    def met_by(self, event: Event) -> bool:
        return event.what == "touch"


class When(Condition, frozen=True, kw_only=True):
    """`predicate(robot)` is true, asked at each sample of the robot's left LM629, or after each instruction.

    `at = "instruction"` is some 70 times slower. The predicate reads the robot and changes nothing.
    """

    predicate: Callable[[Robot], object]
    at: Literal["sample", "instruction"] = "sample"

    def met_by(self, event: Event) -> bool:
        return event.what == "true"


AT_THE_PC = (Sent, Heard, Answer, Touch)


def place_of(condition: Condition, first_slot: int) -> int:
    """The slot at which events for this condition happen."""
    if isinstance(condition, AT_THE_PC):
        return PC
    return first_slot if condition.slot is None else condition.slot
