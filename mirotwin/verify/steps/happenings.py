"""What a step can wait for: one frozen struct a kind, with the keys that a step may give it.

A kind has two conditions: `kind` is true for every event of it, `fits` says whether an event is the one that is meant.
`wait_for` passes over those that do not fit; `expect` fails at the first of them.

Long because every kind stands here with its own keys.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import msgspec
from msgspec import Meta

from miro_host.wheels import Wheels
from miro_protocol.frames import ContentError, TelemetryFrame
from miro_protocol.table import SEQ_MODULUS, SLOT_MASK, Flags
from miro_robot.lm629.commands import BY_NAME
from miro_sim.world import conditions
from miro_sim.world.conditions import Condition
from miro_sim.world.events import Event
from miro_sim.world.pins import PINS
from miro_sim.world.robot import Robot

Slot = Annotated[int, Meta(ge=0, le=4)]
Network = Annotated[int, Meta(ge=0, le=31)]
Byte = Annotated[int, Meta(ge=0, le=0xFF)]
Word = Annotated[int, Meta(ge=0, le=0xFFFF)]
SpeedMS = Annotated[float, Meta(ge=-2.876, le=2.876)]
"""What a 16-bit word carries."""
Side = Literal["left", "right"]


class Happening(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="happening",
    omit_defaults=True,
):
    """Base. `network`: where; the keys that are left out may be anything."""

    network: Network = 0

    AT_ROBOT: ClassVar[bool] = True
    """Whether it happens at a robot, that in `slot`, and not at the PC."""

    @property
    def name(self) -> str:
        return str(self.__struct_config__.tag)

    def problem(self) -> str:
        """What is wrong with its keys beside their types: `what; remedy`, or the empty string."""
        return ""

    def kind(self) -> Condition:
        """True for every event of this kind."""
        raise NotImplementedError

    def fits(self, event: Event, robots: int) -> bool:
        """Whether an event of this kind is the one that is meant. `robots`: slots of the network."""
        return True

    def exactly(self) -> Condition | None:
        """True for what fits and for nothing else; None where no condition says that alone."""
        return self.kind()

    def __str__(self) -> str:
        given = msgspec.to_builtins(self)
        keys = [
            f"{key} = {msgspec.json.encode(value).decode()}"
            for key, value in given.items()
            if key != "happening"
        ]
        return f"{self.name}{' with ' * bool(keys)}{', '.join(keys)}"


class AtRobot(Happening, frozen=True, kw_only=True):
    """Happens at the robot in `slot`; left out: the network's first."""

    slot: Slot | None = None


class Answer(Happening, frozen=True, kw_only=True, tag="answer"):
    """The PC hears a robot's valid answer: that of `slot`, if given, with these fields."""

    AT_ROBOT: ClassVar[bool] = False

    slot: Slot | None = None
    seq: Annotated[int, Meta(ge=0, lt=SEQ_MODULUS)] | None = None
    stopped: bool | None = None
    motors_off: bool | None = None
    init_failed: bool | None = None
    status_left: Byte | None = None
    status_right: Byte | None = None
    position_left: Word | None = None
    position_right: Word | None = None
    accepted: Byte | None = None
    rejected: Byte | None = None

    def kind(self) -> Condition:
        return conditions.Answer(network=self.network, robot=self.slot)

    def exactly(self) -> Condition | None:
        only = Answer(network=self.network, slot=self.slot)
        return self.kind() if self == only else None

    def fits(self, event: Event, robots: int) -> bool:
        found = answer_fields(event, robots)
        wanted = msgspec.structs.asdict(self)
        return all(wanted[key] in (None, value) for key, value in found.items())


def answer_fields(event: Event, robots: int) -> dict[str, int | bool]:
    """What an answer says, under the keys of `Answer`; nothing, where it says what no robot may."""
    if event.frame is None:
        return {}
    try:
        said = event.frame.message(robots)
    except ContentError:
        return {"seq": -1}
    assert isinstance(said, TelemetryFrame)
    found: dict[str, int | bool] = {"slot": said.slot & SLOT_MASK, "seq": said.seq}
    for flag in Flags:
        found[str(flag.name).lower()] = bool(said.flags & flag)
    for key in ("status_left", "status_right", "position_left", "position_right", "accepted", "rejected"):
        found[key] = getattr(said, key)
    return found


class Heard(Happening, frozen=True, kw_only=True, tag="heard"):
    """The PC hears a character from a robot."""

    AT_ROBOT: ClassVar[bool] = False

    byte: Byte | None = None

    def kind(self) -> Condition:
        return conditions.Heard(network=self.network)

    def exactly(self) -> Condition | None:
        return conditions.Heard(network=self.network, value=self.byte)

    def fits(self, event: Event, robots: int) -> bool:
        return self.byte in (None, event.value)


class Sent(Happening, frozen=True, kw_only=True, tag="sent"):
    """The network's host begins to send."""

    AT_ROBOT: ClassVar[bool] = False

    def kind(self) -> Condition:
        return conditions.Sent(network=self.network)


class Frame(AtRobot, frozen=True, kw_only=True, tag="frame"):
    """A robot's serial port has the last character of a valid frame, fresh or not."""

    seq: Annotated[int, Meta(ge=0, lt=SEQ_MODULUS)] | None = None

    def kind(self) -> Condition:
        return conditions.Frame(network=self.network, slot=self.slot)

    def exactly(self) -> Condition | None:
        return self.kind() if self.seq is None else None

    def fits(self, event: Event, robots: int) -> bool:
        return self.seq is None or (event.frame is not None and event.frame.seq == self.seq)


class Received(AtRobot, frozen=True, kw_only=True, tag="received"):
    """A robot's serial port has received a character."""

    byte: Byte | None = None

    def kind(self) -> Condition:
        return conditions.Byte(network=self.network, slot=self.slot)

    def exactly(self) -> Condition | None:
        return conditions.Byte(network=self.network, slot=self.slot, value=self.byte)

    def fits(self, event: Event, robots: int) -> bool:
        return self.byte in (None, event.value)


class Transmitted(AtRobot, frozen=True, kw_only=True, tag="transmitted"):
    """A robot's serial port has sent a character."""

    byte: Byte | None = None

    def kind(self) -> Condition:
        return conditions.Byte(network=self.network, slot=self.slot, sent=True)

    def exactly(self) -> Condition | None:
        return conditions.Byte(network=self.network, slot=self.slot, value=self.byte, sent=True)

    def fits(self, event: Event, robots: int) -> bool:
        return self.byte in (None, event.value)


class Command(AtRobot, frozen=True, kw_only=True, tag="command"):
    """An LM629 has taken a command: that of `side`, or either; by its `name` in the data sheet (STT, LTRJ, ..)."""

    side: Side | None = None
    name_: str | None = msgspec.field(default=None, name="name")
    hex: str | None = None

    def problem(self) -> str:
        if self.name_ is not None and self.name_ not in BY_NAME:
            return f"name: {self.name_!r} is no LM629 command; there are {', '.join(BY_NAME)}"
        try:
            bytes.fromhex(self.hex or "")
        except ValueError:
            return f"hex: {self.hex!r} are no bytes; write pairs of hex digits, as in '00 05'"
        return ""

    def kind(self) -> Condition:
        return conditions.Command(network=self.network, slot=self.slot, side=self.side)

    def exactly(self) -> Condition | None:
        if self.hex is not None:
            return None
        return conditions.Command(network=self.network, slot=self.slot, side=self.side, name=self.name_)

    def fits(self, event: Event, robots: int) -> bool:
        named = self.name_ is None or event.opcode == BY_NAME[self.name_].opcode
        return named and (self.hex is None or event.data == bytes.fromhex(self.hex))


class Edge(AtRobot, frozen=True, kw_only=True, tag="edge"):
    """A `pin` of a robot's board changes, to `level` if given."""

    pin: str
    level: Literal[0, 1] | None = None

    def problem(self) -> str:
        if self.pin in PINS:
            return ""
        shown = ", ".join(pin for pin in PINS if not pin.startswith("P"))
        return f"pin: {self.pin!r} is no pin; there are {shown} and P0.0 to P3.7"

    def kind(self) -> Condition:
        return conditions.Edge(network=self.network, slot=self.slot, pin=self.pin)

    def exactly(self) -> Condition | None:
        return conditions.Edge(network=self.network, slot=self.slot, pin=self.pin, level=self.level)

    def fits(self, event: Event, robots: int) -> bool:
        return self.level in (None, event.value)


class Reached(AtRobot, frozen=True, kw_only=True, tag="reached"):
    """The instruction at a `symbol` of the image, or at an `address`, is next."""

    symbol: str | None = None
    address: Word | None = None

    def problem(self) -> str:
        both = (self.symbol is None) == (self.address is None)
        return "reached: takes a symbol or an address; give one of the two" if both else ""

    def kind(self) -> Condition:
        place = self.symbol if self.address is None else self.address
        assert place is not None
        return conditions.Reached(network=self.network, slot=self.slot, place=place)


class Fault(AtRobot, frozen=True, kw_only=True, tag="fault"):
    """The firmware does what it must not."""

    def kind(self) -> Condition:
        return conditions.Fault(network=self.network, slot=self.slot)


class Touch(Happening, frozen=True, kw_only=True, tag="touch"):
    """A robot of the network touches another one."""

    AT_ROBOT: ClassVar[bool] = False

    def kind(self) -> Condition:
        return conditions.Touch(network=self.network)


class WheelsAt(AtRobot, frozen=True, kw_only=True, tag="wheels"):
    """The wheels turn as fast as this, by the truth of the drive: the rim's speed, a sample of 341 us after the other.

    A state rather than an event: asked at each sample of the left LM629.
    """

    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    tolerance_m_s: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.02

    def problem(self) -> str:
        none = self.left_m_s is None and self.right_m_s is None
        return "wheels: no speed is given; give left_m_s, right_m_s or both" if none else ""

    def kind(self) -> Condition:
        return conditions.When(network=self.network, slot=self.slot, predicate=self.holds)

    def opposite(self) -> Condition:
        """True as soon as it is not so."""
        return conditions.When(
            network=self.network, slot=self.slot, predicate=lambda robot: not self.holds(robot)
        )

    def holds(self, robot: Robot) -> bool:
        """Whether both wheels are so fast now."""
        for wanted, found in zip((self.left_m_s, self.right_m_s), speeds_of(robot), strict=True):
            if wanted is not None and abs(found - wanted) > self.tolerance_m_s:
                return False
        return True


def speeds_of(robot: Robot) -> tuple[float, float]:
    """(left, right) in m/s, as the chassis moves."""
    v_m_s, w_rad_s = robot.drive.velocity_at(robot.board.left.sample_tick)
    return Wheels(track_m=robot.spec.drive.chassis.track_m).split(v_m_s, w_rad_s)


HAPPENINGS: dict[str, type[Happening]] = {
    str(struct.__struct_config__.tag): struct
    for struct in (
        *(Answer, Heard, Frame, Command, WheelsAt, Edge, Reached),
        *(Received, Transmitted, Sent, Fault, Touch),
    )
}
