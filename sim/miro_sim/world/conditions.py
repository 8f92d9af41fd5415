"""The conditions of a wait: one struct a kind, for `World.run_until`, for steps, checks and cases.

A file names them by `event = "answer"`, or as a step does: `wait_for = "answer"`. Fields that are left out may be
anything; `slot` None is the network's first robot, but for `Answer`. Only code can give a predicate (`When`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import msgspec
from msgspec import Meta

from miro_host.wheels import Wheels
from miro_protocol import events
from miro_protocol.frames import ContentError, TelemetryFrame
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, Flags
from miro_robot.lm629.commands import BY_NAME
from miro_sim.world import followers
from miro_sim.world.events import PC, Event
from miro_sim.world.machine import Feature

if TYPE_CHECKING:
    from miro_sim.world.robot import Robot

Slot = Annotated[int, Meta(ge=0, le=4)]
Network = Annotated[int, Meta(ge=0, le=31)]
Seq = Annotated[int, Meta(ge=0, lt=SEQ_MODULUS)]
Byte = Annotated[int, Meta(ge=0, le=0xFF)]
Word = Annotated[int, Meta(ge=0, le=0xFFFF)]
SpeedMS = Annotated[float, Meta(ge=-2.876, le=2.876)]
"""Speeds that a 16-bit word can carry."""
_CHIP_PINS = ("cs", "rd", "wr", "ps", "rst", "hi", "pwm", "sign")
_WIRES = ("rxd", "txd", *(f"{side}.{pin}" for side in ("left", "right") for pin in _CHIP_PINS))
PORT_PINS = {f"P{port}.{bit}": (port, bit) for port in range(4) for bit in range(8)}
PINS = (*_WIRES, *PORT_PINS)
"""The pins of a robot's board that one can wait for. Encoder channels and busy bits are not among them: the board
learns of their edges late."""
LONGEST_US = 1e12
FASTEST_HZ = 1e8
Us = Annotated[float, Meta(ge=0.0, le=LONGEST_US)]
Hz = Annotated[float, Meta(gt=0.0, le=FASTEST_HZ)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Ms = Annotated[float, Meta(ge=0.0, le=86_400_000.0)]
TextValue = Annotated[str, Meta(min_length=1, max_length=1024)]
Kind = Literal["robot", "board"]
BOTH: tuple[Kind, ...] = ("robot", "board")


class Condition(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="event",
    omit_defaults=True,
):
    """Something that becomes true at a tick, at the PC of `network`. Raises ValueError for what can never be."""

    OF_EVENT: ClassVar[Mapping[str, Callable[[Event], object]]] = {}
    """Field -> function that reads its value from an event."""
    DETAILS: ClassVar[tuple[str, ...]] = ()
    """The fields in which events of one kind at one place differ."""
    needs: ClassVar[Feature | None] = None
    """The feature of a machine that the condition needs; a PC can send and receive without one."""
    SUBJECTS: ClassVar[tuple[Kind, ...]] = ("robot",)
    """The kinds of device for which a file may name it: robots, a single board."""

    network: Network = 0

    @property
    def what(self) -> str:
        """The kind, as files and events name it."""
        return str(self.__struct_config__.tag)

    def at_slot(self, first_slot: int) -> int:
        """The slot at which it happens, where `first_slot` is the network's first robot; -1 for the PC."""
        return PC

    def met_by(self, event: Event) -> bool:
        """True if this event, of the network and slot that are meant, fulfils the condition."""
        return event.what == self.what and all(
            getattr(self, field) in (None, value_of(event)) for field, value_of in self.OF_EVENT.items()
        )

    def any_of_its_kind(self) -> Self:
        """The condition that every event of this kind fulfils, at the same place."""
        return msgspec.structs.replace(self, **dict.fromkeys(self.DETAILS))

    def __str__(self) -> str:
        given = msgspec.to_builtins(self, enc_hook=_name_of)
        keys = [
            f"{key} = {msgspec.json.encode(value).decode()}" for key, value in given.items() if key != "event"
        ]
        return f"{self.what}{' with ' * bool(keys)}{', '.join(keys)}"


class AtRobot(Condition, frozen=True, kw_only=True):
    """Base of what happens at the robot in `slot`."""

    needs: ClassVar[Feature | None] = "inside"

    slot: Slot | None = None

    def at_slot(self, first_slot: int) -> int:
        return first_slot if self.slot is None else self.slot


class Answer(Condition, frozen=True, kw_only=True, tag="answer"):
    """The PC hears a valid answer: of the robot in `slot` or of any, with these fields."""

    OF_EVENT = {"slot": attrgetter("value")}
    DETAILS = (
        "seq",
        *(str(flag.name).lower() for flag in Flags),
        *("status_left", "status_right", "position_left", "position_right", "accepted", "rejected"),
    )

    slot: Slot | None = None
    seq: Seq | None = None
    stopped: bool | None = None
    motors_off: bool | None = None
    init_failed: bool | None = None
    status_left: Byte | None = None
    status_right: Byte | None = None
    position_left: Word | None = None
    position_right: Word | None = None
    accepted: Byte | None = None
    rejected: Byte | None = None

    def met_by(self, event: Event) -> bool:
        wanted = {key: value for key in self.DETAILS if (value := getattr(self, key)) is not None}
        return super().met_by(event) and wanted.items() <= answer_fields(event).items()


def answer_of(frame: events.Received) -> TelemetryFrame | None:
    """The content of an answer; None for content that no robot may send."""
    try:
        message = frame.message(max(ROBOT_COUNTS))
    except ContentError:
        return None
    return message if isinstance(message, TelemetryFrame) else None


def answer_fields(event: Event) -> dict[str, int | bool]:
    """The content of an answer, under the keys of `Answer`; empty for content that no robot may send."""
    answer = None if event.frame is None else answer_of(event.frame)
    if answer is None:
        return {}
    flags = {str(flag.name).lower(): bool(answer.flags & flag) for flag in Flags}
    return flags | {key: getattr(answer, key) for key in ("slot", *Answer.DETAILS) if key not in flags}


class Heard(Condition, frozen=True, kw_only=True, tag="heard"):
    """The PC hears a character (`byte`: this one) from a robot."""

    SUBJECTS = BOTH

    OF_EVENT = {"byte": attrgetter("value")}
    DETAILS = ("byte",)

    byte: Byte | None = None


class Sent(Condition, frozen=True, kw_only=True, tag="sent"):
    """The network's host begins a transmission."""

    SUBJECTS = BOTH


class Frame(AtRobot, frozen=True, kw_only=True, tag="frame"):
    """A robot's serial port has received the last character of a valid frame, fresh or not."""

    OF_EVENT = {"seq": attrgetter("frame.seq")}
    DETAILS = ("seq",)

    seq: Seq | None = None


class Received(AtRobot, frozen=True, kw_only=True, tag="received"):
    """A robot's serial port has received a character (`byte`: this one)."""

    SUBJECTS = BOTH

    OF_EVENT = {"byte": attrgetter("value")}
    DETAILS = ("byte",)

    byte: Byte | None = None


class Transmitted(Received, frozen=True, kw_only=True, tag="transmitted"):
    """A robot's serial port has sent a character (`byte`: this one)."""


class Command(AtRobot, frozen=True, kw_only=True, tag="command"):
    """An LM629 has completed a command: of one `side` or either, of this `name` (`STT`, ..), with the data `hex`."""

    OF_EVENT = {"side": attrgetter("side"), "name": attrgetter("command")}
    DETAILS = ("name", "hex")

    side: Literal["left", "right"] | None = None
    name: str | None = None
    hex: str | None = None

    def __post_init__(self) -> None:
        if self.name is not None and self.name not in BY_NAME:
            raise ValueError(f"name: {self.name!r} is not an LM629 command; there are {', '.join(BY_NAME)}")
        if self.side not in (None, "left", "right"):
            raise ValueError(f"side: {self.side!r} is not a side; give left or right")
        try:
            bytes.fromhex(self.hex or "")
        except ValueError:
            problem = f"hex: {self.hex!r} are not bytes; write pairs of hex digits, as in '00 05'"
            raise ValueError(problem) from None

    def met_by(self, event: Event) -> bool:
        return super().met_by(event) and (self.hex is None or event.data == bytes.fromhex(self.hex))


class WheelSpeeds(AtRobot, frozen=True, kw_only=True, tag="wheels"):
    """The wheels turn as fast as this, by the truth of the drive: the rim's speed.

    A state rather than an event: evaluated at each sample of the robot's left LM629, every 341 us.
    """

    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    tolerance_m_s: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.02

    at: ClassVar[Literal["sample"]] = "sample"

    def __post_init__(self) -> None:
        if self.left_m_s is None and self.right_m_s is None:
            raise ValueError("wheels: no speed is given; give left_m_s, right_m_s or both")

    def met_by(self, event: Event) -> bool:
        return event.what == "true"

    def predicate(self, robot: Any) -> bool:
        """True if the wheels are so fast now."""
        sides = zip((self.left_m_s, self.right_m_s), speeds_of(robot), strict=True)
        return all(wanted is None or abs(speed - wanted) <= self.tolerance_m_s for wanted, speed in sides)


def speeds_of(robot: Robot) -> tuple[float, float]:
    """(left, right) in m/s, as the chassis moves."""
    v_m_s, w_rad_s = robot.drive.velocity_at(robot.board.left.sample_tick)
    return Wheels(track_m=robot.spec.drive.chassis.track_m).split(v_m_s, w_rad_s)


class Followed(AtRobot, frozen=True, kw_only=True):
    """Base of what a `Follower` works out from the changes of a `source`: a pin, a value of a part."""

    SUBJECTS: ClassVar[tuple[Kind, ...]] = ("board",)
    LASTS: ClassVar[bool] = False
    """True if it is true for a time: then a step may `hold` it."""
    FOLLOWER: ClassVar[Any]

    @property
    def source(self) -> str:
        raise NotImplementedError

    def fits(self, measured: Any) -> bool:
        """True if a measurement is one that is wanted. Raises ValueError for one that it cannot be compared with."""
        raise NotImplementedError

    def follower(self, source: object, flip: int, clock: int, tick: int, level: Any) -> followers.Follower:
        """From `tick` on, at which the source is at `level`. Raises ValueError for a value of another type."""
        made: followers.Follower = self.FOLLOWER(self, source, flip, clock, tick, level)
        return made

    def opposite(self) -> Self:
        """True exactly while this one is not. Of one that `LASTS`. Raises ValueError where it always is."""
        if self.DETAILS and not any(getattr(self, key) is not None for key in self.DETAILS):
            first, last = self.DETAILS
            raise ValueError(f"{self.what}: no limit is given; give {first}, {last} or both")
        return msgspec.structs.replace(self, outside=not getattr(self, "outside", False))

    def any_of_its_kind(self) -> Self:
        kind = super().any_of_its_kind()
        return msgspec.structs.replace(kind, outside=False) if self.LASTS and self.DETAILS else kind

    def met_by(self, event: Event) -> bool:
        return event.what == self.what and event.pin == self.source and self.fits(event.measured)


class OfPin(Followed, frozen=True, kw_only=True):
    """Base of what a pin does. Of a robot: one of `PINS`; of a board: a port pin, a net, a part's pin.

    It looks from the begin of the wait on; what was before is not known.
    """

    pin: str

    @property
    def source(self) -> str:
        return self.pin


class Edge(OfPin, frozen=True, kw_only=True, tag="edge"):
    """A `pin` changes (to `level`): `rxd`, `txd`, `P1.0`, `left.hi`, .. (`PINS`) of a robot's board."""

    FOLLOWER = followers.EdgeFollower
    SUBJECTS = BOTH
    DETAILS = ("level",)

    level: Literal[0, 1] | None = None

    def met_by(self, event: Event) -> bool:
        return event.what == "edge" and event.pin == self.pin and self.level in (None, event.value)


class Level(OfPin, frozen=True, kw_only=True, tag="level"):
    """A `pin` has had a `level` for `steady_ms` (0), counted from its last edge, or from the begin of the wait."""

    FOLLOWER = followers.LevelFollower
    LASTS = True

    level: Literal[0, 1]
    steady_ms: Ms = 0.0

    def fits(self, measured: Any) -> bool:
        return bool(measured >= self.steady_ms)

    def opposite(self) -> Self:
        return msgspec.structs.replace(self, level=1 - self.level, steady_ms=0.0)


class Pulse(OfPin, frozen=True, kw_only=True, tag="pulse"):
    """A pulse of a `pin` to `level` (1) ends, with a width from `at_least_us` to `at_most_us`. It began in the wait."""

    FOLLOWER = followers.PulseFollower
    DETAILS = ("at_least_us", "at_most_us")

    level: Literal[0, 1] = 1
    at_least_us: Us | None = None
    at_most_us: Us | None = None

    def __post_init__(self) -> None:
        check_range(self, *self.DETAILS)

    def fits(self, measured: Any) -> bool:
        return within(measured, self.at_least_us, self.at_most_us)


class Frequency(OfPin, frozen=True, kw_only=True, tag="frequency"):
    """A period of a `pin`, from one rising edge to the next, ends: its frequency is `at_least_hz`, `at_most_hz`.

    `outside`: it is not. A signal that has no rising edge for longer than the period of `at_least_hz` is outside, too.
    """

    FOLLOWER = followers.PeriodFollower
    DETAILS = ("at_least_hz", "at_most_hz")
    LASTS = True

    at_least_hz: Hz | None = None
    at_most_hz: Hz | None = None
    outside: bool = False

    def __post_init__(self) -> None:
        check_range(self, "at_least_hz", "at_most_hz")

    def fits(self, measured: Any) -> bool:
        return within(measured, self.at_least_hz, self.at_most_hz) != self.outside


class Duty(OfPin, frozen=True, kw_only=True, tag="duty"):
    """A period of a `pin` ends, of which it was high for a share of `at_least` to `at_most` (0 to 1).

    `outside`: it was not. A pin that stands has no period: see `Level`.
    """

    FOLLOWER = followers.DutyFollower
    DETAILS = ("at_least", "at_most")
    LASTS = True

    at_least: Share | None = None
    at_most: Share | None = None
    outside: bool = False

    def __post_init__(self) -> None:
        check_range(self, "at_least", "at_most")

    def fits(self, measured: Any) -> bool:
        return within(measured, self.at_least, self.at_most) != self.outside


class Value(Followed, frozen=True, kw_only=True, tag="value"):
    """A value `of` a part (`bridge.a.duty`): above, below, equal to a number within `tolerance`; of a text: equal, or
    contains. `outside`: it is not.

    It is looked at when the wait begins, every 1 / 1000 s of whole ticks from power-on, and right after each put: what
    comes and goes between two looks is not seen.
    """

    FOLLOWER = followers.ValueFollower
    LASTS = True

    of: str
    above: float | None = None
    below: float | None = None
    equals: bool | float | str | None = None
    contains: TextValue | None = None
    tolerance: Annotated[float, Meta(ge=0.0)] = 0.0
    outside: bool = False

    def __post_init__(self) -> None:
        if (self.above, self.below, self.equals, self.contains) == (None, None, None, None):
            raise ValueError("value: says nothing of it; give above, below, equals or contains")
        if self.tolerance and (self.equals is None or isinstance(self.equals, str)):
            raise ValueError("tolerance: goes with equals and a number; leave it out")
        if None not in (self.above, self.below) and not self.above < self.below:  # type: ignore[operator]
            raise ValueError(f"above: {self.above:g} leaves nothing below {self.below:g}; give a smaller one")

    @property
    def source(self) -> str:
        return self.of

    def fits(self, measured: Any) -> bool:
        is_text = isinstance(measured, str)
        asks_text = self.contains is not None or isinstance(self.equals, str)
        asks_number = self.above is not None or self.below is not None
        if (asks_text and not is_text) or (is_text and (asks_number or not asks_text)):
            kind = "a text; use equals or contains" if is_text else "no text; use above, below or equals"
            raise ValueError(f"of: {self.of} is {kind}")
        return self._fits(measured) != self.outside

    def _fits(self, measured: Any) -> bool:
        if isinstance(measured, str):
            return self.equals in (None, measured) and (self.contains or "") in measured
        if self.above is not None and not measured > self.above:
            return False
        if self.below is not None and not measured < self.below:
            return False
        if self.equals is None:
            return True
        assert not isinstance(self.equals, str)  # `fits` refuses it
        return bool(abs(measured - self.equals) <= self.tolerance)


def unknown_robot_pin(name: str) -> str:
    """Why a robot's board does not have a pin, or the empty string."""
    if name in PINS:
        return ""
    wired = ", ".join(pin for pin in PINS if not pin.startswith("P"))
    return f"pin: {name!r} is not a pin; there are {wired} and P0.0 to P3.7"


def within(measured: Any, least: float | None, most: float | None) -> bool:
    """True if a number is in a range that may be open."""
    return (least is None or measured >= least) and (most is None or measured <= most)


def check_range(condition: Condition, least: str, most: str) -> None:
    """Raises ValueError for a range that is empty."""
    first, last = getattr(condition, least), getattr(condition, most)
    if None not in (first, last) and first > last:
        raise ValueError(f"{least}: {first:g} is more than {most}, {last:g}; exchange them")


class Text(Condition, frozen=True, kw_only=True, tag="text"):
    """The PC has received a `text` from the board, or bytes that match the regular expression `pattern`.

    It looks at all that was sent since the last wait ended, at each character: a pattern ends as early as it can.
    """

    SUBJECTS = ("board",)
    DETAILS = ("text", "pattern")

    text: TextValue | None = None
    pattern: TextValue | None = None

    def __post_init__(self) -> None:
        if (self.text is None) == (self.pattern is None):
            raise ValueError("text: takes a text or a pattern; give one of the two")
        try:
            re.compile((self.pattern or "").encode())
        except (re.error, OverflowError) as error:
            raise ValueError(
                f"pattern: {self.pattern!r} is no regular expression: {error}; repair it"
            ) from None

    def any_of_its_kind(self) -> Self:
        return self

    def met_by(self, event: Event) -> bool:
        return event.what == "text" and event.data == self.key

    @property
    def key(self) -> bytes:
        """The event's key for the condition that it fulfils."""
        return f"{self.text!r} {self.pattern!r}".encode()


class Reached(AtRobot, frozen=True, kw_only=True, tag="reached"):
    """The instruction at a `symbol` of the image, or at an `address`, is the next to be executed."""

    SUBJECTS = BOTH

    OF_EVENT = {"address": attrgetter("address")}

    symbol: str | None = None
    address: Word | None = None

    def __post_init__(self) -> None:
        if (self.symbol is None) == (self.address is None):
            raise ValueError("reached: takes a symbol or an address; give one of the two")
        if self.address is not None and not 0 <= self.address <= 0xFFFF:
            raise ValueError(f"address: {self.address} is not an address; give 0 to 0xffff")


class Fault(AtRobot, frozen=True, kw_only=True, tag="fault"):
    """The firmware does what it must not."""

    SUBJECTS = BOTH


class Ended(AtRobot, frozen=True, kw_only=True, tag="ended"):
    """The program of a board alone has ended: no input can make it do anything more, and all is sent."""


class Touch(Condition, frozen=True, kw_only=True, tag="touch"):
    """A robot of the network touches another robot on the pitch, checked on the contact grid of 1 ms."""

    needs: ClassVar[Feature | None] = "inside"


class When(AtRobot, frozen=True, kw_only=True, tag="when"):
    """`predicate(device)` is true, evaluated at each sample of the robot's left LM629, or after each instruction.

    For a board alone it is evaluated each millisecond.

    `at = "instruction"` is some 70 times slower. The predicate reads the device and changes nothing.
    """

    predicate: Callable[[Any], object]
    at: Literal["sample", "instruction"] = "sample"

    def met_by(self, event: Event) -> bool:
        return event.what == "true"


def _name_of(predicate: Any) -> str:
    return str(getattr(predicate, "__qualname__", predicate))


Recorded = Answer | Heard | Frame | Command | Received | Transmitted | Sent | Fault | Touch
"""The conditions that are logged whether somebody waits for them or not, so that a check can judge them."""
OnBoard = Edge | Level | Pulse | Frequency | Duty | Text | Value
"""Conditions that a check of a board can judge, because it follows them."""
CONDITIONS: dict[str, type[Condition]] = {
    str(struct.__struct_config__.tag): struct
    for struct in (
        *(Answer, Heard, Frame, Command, WheelSpeeds, Edge, Reached),
        *(Received, Transmitted, Sent, Fault, Touch),
        *(Level, Pulse, Frequency, Duty, Text, Value),
    )
}
"""By the name that a file gives them: each has a row on the page of the steps, too."""
