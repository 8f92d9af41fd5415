"""The channels of a recording: the messages, and their conversion to and from records.

Every message carries its tick; a period's messages are closed by its `/period` message. The topics:

/period                  a control period of the whole world
/net0/wire               the characters on the air of network 0
/net0/actions            actions on its robots and its radio
/net0/puts               values put into the parts of its board by a test
/net0/values             the values of these parts, once a period
/net0/fault              firmware faults of its board
/net0/camera/image       the frames of its camera
/net0/robot2/lm629       a channel of the robot in slot 2 of network 0
"""

import re
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from msgspec import Meta
from msgspec.structs import astuple

from miro_exact.clock import nanoseconds
from miro_exact.domain import MAX_SEED
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_protocol.actions import (
    PUT_PATH,
    Action,
    Fault,
    Power,
    Put,
    PutValue,
    RadioState,
    Reseed,
    Reset,
    fault_text,
)
from miro_protocol.stream import MAX_TICK
from miro_protocol.transmission import DIRECTIONS, Transmission, check_bad_stop
from miro_sim.periods import Axis, Control, RobotPeriod

PERIOD = "/period"
WIRE = "wire"
ACTIONS = "actions"
PUTS = "puts"
HARDWARE = "hardware"
VALUES = "values"
FAULT = "fault"
IMAGE = "camera/image"
_TOPIC = re.compile(rf"/net([0-9]{{1,9}})(?:/robot([0-9]{{1,9}}))?/([a-z0-9_]+|{IMAGE})")


class Topic(NamedTuple):
    """The parts of a topic. `network`, `slot`: -1 where it is of the world, or of a whole network."""

    channel: str
    network: int = -1
    slot: int = -1


def topic_name(channel: str, network: int, slot: int = -1) -> str:
    """The topic of a channel of a network, or of the robot in a slot of it."""
    return f"/net{network}/{channel}" if slot < 0 else f"/net{network}/robot{slot}/{channel}"


def topic_of(topic: str) -> Topic | None:
    """The parts of `topic`; None if it has not the form of one of ours."""
    if topic == PERIOD:
        return Topic(PERIOD)
    match = _TOPIC.fullmatch(topic)
    if match is None:
        return None
    network, slot, channel = match.groups()
    return Topic(channel, int(network), -1 if slot is None else int(slot))


IMAGE_SCHEMA_NAME = "foxglove.CompressedImage"
SECOND_NS = 1_000_000_000

_WHOLE = {"type": "integer", "minimum": 0}
IMAGE_SCHEMA: dict[str, Any] = {
    "title": IMAGE_SCHEMA_NAME,
    "description": "A compressed image",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "properties": {"sec": _WHOLE, "nsec": {**_WHOLE, "maximum": SECOND_NS - 1}},
            "description": "Timestamp of image",
        },
        "frame_id": {"type": "string", "description": "Frame of reference for the image"},
        "data": {"type": "string", "contentEncoding": "base64", "description": "Compressed image data"},
        "format": {"type": "string", "description": "Image format"},
        "tick": {**_WHOLE, "description": "Of the middle of the exposure"},
    },
}


class TimeMessage(msgspec.Struct, frozen=True, gc=False):
    """Simulated time, rounded down to nanoseconds."""

    sec: int
    nsec: int


def time_of(tick: int) -> TimeMessage:
    """The time of a tick."""
    return TimeMessage(*divmod(nanoseconds(tick), SECOND_NS))


class ImageMessage(msgspec.Struct, frozen=True, gc=False):
    """`camera/image`: a plain frame as the PC gets it; `data` is a file of this `format`, in base64 as JSON."""

    timestamp: TimeMessage
    frame_id: str
    data: bytes
    format: str
    tick: Annotated[int, Meta(ge=0, le=MAX_TICK)]


# The docstrings of messages are the descriptions in the schemas of every recording: a changed word changes its bytes.
class TheoryMessage(msgspec.Struct, frozen=True, gc=False):
    """`theory`: terms of the paper's theory.

    f of equation (15) over the period that ends at `tick` (null without a command), rho_c, the angle between heading
    and the perpendicular of the line of sight (equation 12, negative if the cosine is), and the assumptions that hold
    (`recording.theory`).
    """

    tick: int
    f1_m_s2: float | None
    f2_rad_s2: float | None
    rho_c_m: float
    across_rad: float
    holds_1: bool
    holds_2: bool
    holds_3: bool


class PostureMessage(msgspec.Struct, frozen=True, gc=False):
    """`reference`: a posture in world axes."""

    tick: int
    x_m: float
    y_m: float
    theta_rad: float


class MeasurementMessage(PostureMessage, frozen=True, gc=False):
    """`measurement`: a posture as the PC gets it at `tick`, of the picture that was exposed at `exposed_tick`.

    `confidence` from 0 to 1 is the tracker's; both are null where a camera without pictures made the measurement.
    """

    exposed_tick: int | None = None
    confidence: float | None = None


class TruthMessage(PostureMessage, frozen=True, gc=False):
    """`truth`: posture (heading unwrapped) and velocity of the robot."""

    v_m_s: float
    w_rad_s: float


class ControlMessage(msgspec.Struct, frozen=True, gc=False):
    """`control`: the controller's output, see `periods.Control`.

    `inner`: the inner values that the law names; `estimate`: those of the estimator.
    """

    tick: int
    v_m_s: float
    w_rad_s: float
    left: int
    right: int
    inner: dict[str, float]
    estimate: dict[str, float] = {}


class FirmwareMessage(msgspec.Struct, frozen=True, gc=False):
    """`firmware`: the robot's own frame counters, modulo 2^16; absent if its image exports none."""

    tick: int
    accepted: int
    rejected: int
    stale: int


class CommandMessage(msgspec.Struct, frozen=True, gc=False):
    """A complete LM629 command; `data` in hex."""

    tick: int
    opcode: int
    data: str


class RegistersMessage(msgspec.Struct, frozen=True, gc=False):
    """One LM629: counts, counts per sample with 16 fraction bits, status byte, commands since the last
    message.
    """

    desired_position: int
    real_position: int
    desired_velocity: int
    status: int
    commands: tuple[CommandMessage, ...]


class Lm629Message(msgspec.Struct, frozen=True, gc=False):
    """`lm629`: both motion controllers."""

    tick: int
    left: RegistersMessage
    right: RegistersMessage


class DutyMessage(msgspec.Struct, frozen=True, gc=False):
    """Sign pin (1 = negative) and magnitude 0..127 of one LM629."""

    sign: int
    magnitude: int


class PwmMessage(msgspec.Struct, frozen=True, gc=False):
    """`pwm`: the inputs of both L298 bridges."""

    tick: int
    left: DutyMessage
    right: DutyMessage


class SampleMessage(msgspec.Struct, frozen=True, gc=False):
    """`samples`, in full recordings only: both LM629 once a sample (8192 ticks)."""

    tick: int
    left_desired_position: int
    left_real_position: int
    left_desired_velocity: int
    left_duty: int
    right_desired_position: int
    right_real_position: int
    right_desired_velocity: int
    right_duty: int


class FaultMessage(msgspec.Struct, frozen=True, gc=False):
    """`fault`: a firmware fault."""

    tick: int
    kind: int
    pc: int
    symbol: str
    text: str


class WireMessage(msgspec.Struct, frozen=True, gc=False):
    """`wire`: characters without a pause; `>` host to robot, as sent; `<` robot to host, as received by the PC.

    `data` in hex; `bad_stop`: indices of the characters whose stop bit is bad.
    """

    tick: int
    direction: str
    data: str
    bad_stop: tuple[int, ...]


class ActionMessage(msgspec.Struct, frozen=True, gc=False):
    """`actions`: an action on a robot, or (`slot` -1) on the radio or the noise of the network. `what`: "reset" or
    "power" with `value` 0 or 1; "up", "down" or "noise" for the radio; or "reseed": from then on the noise has the seed
    `value`.
    """

    tick: int
    slot: int
    what: Literal["reset", "power", "up", "down", "noise", "reseed"]
    value: Annotated[int, Meta(ge=0)] = 1


class PutMessage(msgspec.Struct, frozen=True, gc=False):
    """`puts`: a value that a test put into a part of a board; `path` is PART.KEY."""

    tick: int
    slot: int
    path: str
    value: PutValue


class HardwareMessage(msgspec.Struct, frozen=True, gc=False):
    """`hardware`: a break or repair of a robot's hardware; `what` as in a stream file."""

    tick: int
    slot: int
    what: str


class ValuesMessage(msgspec.Struct, frozen=True, gc=False):
    """`values`: the values of the parts of a board at `tick`, by PART.KEY."""

    tick: int
    slot: int
    values: dict[str, PutValue]


class PeriodMessage(msgspec.Struct, frozen=True, gc=False):
    """`/period`: the end of a control period, with the digest of all states at its end."""

    tick: int
    index: int
    digest: str


ROBOT_CHANNELS: dict[str, type[msgspec.Struct]] = {
    "reference": PostureMessage,
    "truth": TruthMessage,
    "measurement": MeasurementMessage,
    "control": ControlMessage,
    "theory": TheoryMessage,
    "firmware": FirmwareMessage,
    "lm629": Lm629Message,
    "pwm": PwmMessage,
    "samples": SampleMessage,
    FAULT: FaultMessage,
}


OTHER_CHANNELS: dict[str, type[msgspec.Struct]] = {
    PERIOD: PeriodMessage,
    WIRE: WireMessage,
    ACTIONS: ActionMessage,
    PUTS: PutMessage,
    HARDWARE: HardwareMessage,
    VALUES: ValuesMessage,
    FAULT: FaultMessage,
    IMAGE: ImageMessage,
}


def message_type(topic: Topic) -> type[msgspec.Struct] | None:
    """The struct of the messages there, or None if there is no such channel."""
    if topic.slot >= 0:
        return ROBOT_CHANNELS.get(topic.channel)
    return OTHER_CHANNELS.get(topic.channel)


def action_message(action: Action) -> tuple[str, ActionMessage | PutMessage | HardwareMessage]:
    """The message about an action, after its channel."""
    if isinstance(action, Put):
        return PUTS, PutMessage(action.tick, action.slot, action.path, action.value)
    if isinstance(action, Fault):
        return HARDWARE, HardwareMessage(action.tick, action.slot, action.what)
    if isinstance(action, RadioState):
        return ACTIONS, ActionMessage(action.tick, -1, action.state)
    if isinstance(action, Reseed):
        return ACTIONS, ActionMessage(action.tick, -1, "reseed", action.seed)
    if isinstance(action, Reset):
        return ACTIONS, ActionMessage(action.tick, action.slot, "reset", action.level)
    return ACTIONS, ActionMessage(action.tick, action.slot, "power", action.on)


def action(network: int, message: ActionMessage) -> Action:
    """The action of a message. Raises ValueError for a message that cannot be."""
    highest = MAX_SEED if message.what == "reseed" else 1
    if not 0 <= message.tick <= MAX_TICK or message.slot < -1 or message.value > highest:
        raise ValueError(f"{message.what} {message.value} of robot {message.slot} at tick {message.tick}")
    if message.what == "reset":
        return Reset(message.tick, network, message.slot, message.value)
    if message.what == "power":
        return Power(message.tick, network, message.slot, message.value)
    if message.what == "reseed":
        return Reseed(message.tick, network, message.value)
    return RadioState(message.tick, network, message.what)


def put(network: int, message: PutMessage) -> Put:
    """The put of a message. Raises ValueError for a message that cannot be."""
    action = Put(message.tick, network, message.slot, message.path, message.value)
    if not 0 <= message.tick <= MAX_TICK or message.slot < 0 or not PUT_PATH.fullmatch(message.path):
        raise ValueError(f"{action.text} at tick {message.tick}")
    return action


def fault(network: int, message: HardwareMessage) -> Fault:
    """The fault of a message. Raises ValueError for a message that cannot be."""
    if not 0 <= message.tick <= MAX_TICK or message.slot < 0 or fault_text(message.what) != message.what:
        raise ValueError(f"{message.what} of robot {message.slot} at tick {message.tick}")
    return Fault(message.tick, network, message.slot, message.what)


def transmission(network: int, message: WireMessage) -> Transmission:
    """The transmission of a wire message. Raises ValueError for a message that cannot be."""
    data = bytes.fromhex(message.data)
    if not 0 <= message.tick <= MAX_TICK or message.direction not in DIRECTIONS or not data:
        raise ValueError(f"{len(data)} characters {message.direction!r} at tick {message.tick}")
    check_bad_stop(message.bad_stop, len(data))
    return Transmission(message.tick, message.direction, data, network, message.bad_stop)


def robot_period(network: int, slot: int, messages: dict[str, Any]) -> RobotPeriod:
    """The record of one robot from its messages by channel. Raises KeyError when one is missing."""
    truth, firmware, lm629, pwm = (
        messages["truth"],
        messages.get("firmware"),
        messages["lm629"],
        messages["pwm"],
    )
    reference, measured, control = messages["reference"], messages.get("measurement"), messages.get("control")
    accepted, rejected, stale = (None, None, None) if firmware is None else astuple(firmware)[1:]
    return RobotPeriod(
        network,
        slot,
        _posture(reference),
        _posture(truth),
        truth.v_m_s,
        truth.w_rad_s,
        None if measured is None else _measurement(measured),
        None if control is None else Control(*astuple(control)[1:]),
        accepted,
        rejected,
        stale,
        _axis(lm629.left, pwm.left),
        _axis(lm629.right, pwm.right),
    )


def _measurement(message: MeasurementMessage) -> Posture:
    if message.exposed_tick is None or message.confidence is None:
        return _posture(message)
    return Sighting(message.x_m, message.y_m, message.theta_rad, message.exposed_tick, message.confidence)


def _posture(message: PostureMessage) -> Posture:
    return Posture(message.x_m, message.y_m, message.theta_rad)


def _axis(registers: RegistersMessage, duty: DutyMessage) -> Axis:
    *values, commands = astuple(registers)
    return Axis(*(*values, *astuple(duty), tuple(map(astuple, commands))))


Named = tuple[tuple[str, str], ...]
"""The keys of a map in a message, each with the JSON type of its values."""


@cache
def schema_text(kind: type[msgspec.Struct], inner: Named | None = None) -> bytes:
    """The JSON schema of messages of a kind, as text; `inner`: the type of the map in it.

    Cached: making it takes longer than some control periods, and many robots have the same channels.
    """
    return msgspec.json.encode(IMAGE_SCHEMA if kind is ImageMessage else _schema(kind, inner))


def inner_of(message: msgspec.Struct) -> Named | None:
    """The keys of the map in a message, of a kind that has one: those of a law, or of a board's parts."""
    if isinstance(message, ControlMessage):
        return tuple((name, "number") for name in message.inner)
    if isinstance(message, ValuesMessage):
        return tuple((name, _JSON_TYPES.get(type(value), "number")) for name, value in message.values.items())
    return None


_JSON_TYPES = {str: "string", bool: "boolean"}


def _schema(kind: type[msgspec.Struct], inner: Named | None) -> dict[str, object]:
    """The schema with references resolved, because viewers want one plain tree.

    The keys of a map become properties, because viewers list nothing else.
    """
    (tree,), parts = msgspec.json.schema_components([kind], ref_template="{name}")
    resolved: dict[str, object] = _resolved(tree, parts)
    if inner is not None:
        names = {name: {"type": of} for name, of in inner}
        named = {"type": "object", "properties": names, "required": list(names)}
        place = "values" if kind is ValuesMessage else "inner"
        resolved["properties"] = {**resolved["properties"], place: named}  # type: ignore[dict-item]
    return resolved


def _resolved(node: Any, parts: dict[str, Any]) -> Any:
    if isinstance(node, dict):
        if "$ref" in node:
            beside = {key: value for key, value in node.items() if key != "$ref"}  # title, default
            return {**_resolved(parts[node["$ref"]], parts), **beside}
        return {key: _resolved(value, parts) for key, value in node.items()}
    return [_resolved(item, parts) for item in node] if isinstance(node, list) else node


def schema_name(kind: type[msgspec.Struct]) -> str:
    """The name of the schema of messages of a kind."""
    if kind is ImageMessage:
        return IMAGE_SCHEMA_NAME
    return f"mirotwin.{kind.__name__.removesuffix('Message')}"
