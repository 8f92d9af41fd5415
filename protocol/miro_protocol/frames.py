"""Messages and their bytes: what is said, and how it is written down.

Every size, range and offset comes from `table.py`.

Two error types: `EncodeError` for a message that must not be sent; `ContentError` for bytes whose CRC is good but
whose content no correct sender makes.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterable, Mapping, Set
from operator import index
from reprlib import repr as brief
from typing import Any

import msgspec

from miro_protocol.crc import crc16
from miro_protocol.table import (
    ROBOT_COUNTS,
    SEQ,
    SEQ_MODULUS,
    SERVICE,
    SERVICE_DATA,
    SLOT_MASK,
    TELEMETRY,
    TELEMETRY_FIELDS,
    VELOCITY,
    Field,
    Flags,
    Format,
    FrameType,
    Opcode,
    downlink,
)
from miro_protocol.whitening import whiten

_LOW = max(field.low for field in VELOCITY)
_CODES = {1: "b", 2: "h", 4: "i"}
_VELOCITIES = {
    n: struct.Struct("<" + n * "".join(_CODES[field.size] for field in VELOCITY)) for n in ROBOT_COUNTS
}


_TELEMETRY_TYPE = int(FrameType.TELEMETRY)
_TELEMETRY = struct.Struct("<" + "".join(_CODES[field.size].upper() for field in TELEMETRY_FIELDS))
assert all((field.low, field.high + 1) == (0, 1 << 8 * field.size) for field in TELEMETRY_FIELDS)
_FLAGS = sum(Flags)


class EncodeError(ValueError):
    """A message that may not be sent, the caller's mistake: the field, its value, and what is allowed."""


class ContentError(Exception):
    """A frame with a good CRC that says nothing the table knows: the sender, not the link, is wrong."""


class TeamFrame(msgspec.Struct, frozen=True):
    """Velocities of all robots, slot 0 first: (left, right) in 1/256 count per LM629 sample.

    With `type` TEAM_ASK, robot (seq mod N) answers with telemetry.
    """

    type: int
    seq: int
    velocities: tuple[tuple[int, int], ...]


class ServiceFrame(msgspec.Struct, frozen=True):
    """One setting of one robot; `values` in the order of `table.SERVICE_DATA[opcode]`."""

    seq: int
    slot: int
    opcode: int
    values: tuple[int, ...] = ()

    @classmethod
    def ping(cls, seq: int, slot: int) -> ServiceFrame:
        return cls(seq, slot, Opcode.PING)

    @classmethod
    def filter(cls, seq: int, slot: int, kp: int, ki: int, kd: int, il: int) -> ServiceFrame:
        """LM629 filter words of both wheels, 0..32767 each."""
        return cls(seq, slot, Opcode.FILTER, (kp, ki, kd, il))

    @classmethod
    def acceleration(cls, seq: int, slot: int, value: int) -> ServiceFrame:
        """Acceleration of both wheels in 1/65536 count per sample^2; in motion it waits for standstill."""
        return cls(seq, slot, Opcode.ACCELERATION, (value,))


class TelemetryFrame(msgspec.Struct, frozen=True):
    """One robot's answer. Positions are the low 16 bits of counts, the counters wrap at 256."""

    seq: int
    slot: int
    flags: int = 0
    status_left: int = 0
    status_right: int = 0
    position_left: int = 0
    position_right: int = 0
    accepted: int = 0
    rejected: int = 0


Message = TeamFrame | ServiceFrame | TelemetryFrame


def checked(field: Field, value: int, where: str = "", high: int | None = None) -> int:
    """`value` as a plain int; EncodeError naming field, value and limits when it may not be sent."""
    limit = field.high if high is None else high
    number = value if type(value) is int else _whole(f"{where}{field.name}", value, f"{field.low}..{limit}")
    if not field.low <= number <= limit:
        unit = f" ({field.unit})" if field.unit else ""
        raise EncodeError(f"{where}{field.name} = {_shown(value)}: must be {field.low}..{limit}{unit}")
    return number


def _whole(name: str, value: Any, allowed: str) -> int:
    """`value` as a plain int. A truth value is none: it would be sent as 0 or 1."""
    try:
        if not isinstance(value, bool):
            return index(value)
    except TypeError:
        pass
    raise EncodeError(f"{name} = {_shown(value)}: must be a whole number {allowed}")


def _items(name: str, value: Any, count: int, content: str) -> tuple[Any, ...]:
    """The `count` items of `value`, anything of a length and an order."""
    ordered = type(value) is tuple or (isinstance(value, Collection) and not isinstance(value, Set | Mapping))
    if not ordered or len(value) != count:
        raise EncodeError(f"{name.strip()} = {_shown(value)}: must be {count} {content}")
    return tuple(value)


def _shown(value: Any) -> str:
    """`value` in a few words, however long it is."""
    if isinstance(value, int) and value.bit_length() > 64:
        return f"an int of {value.bit_length()} bits"
    return brief(value)


def pack(field: Field, value: int, where: str = "", high: int | None = None) -> bytes:
    return checked(field, value, where, high).to_bytes(field.size, "little", signed=field.signed)


def unpack(fields: Iterable[Field], payload: bytes, offset: int = 0) -> list[int]:
    """The numbers of `fields`, which follow each other from `offset` on, unchecked."""
    values = []
    for field in fields:
        raw = payload[offset : offset + field.size]
        values.append(int.from_bytes(raw, "little", signed=field.signed))
        offset += field.size
    return values


def format_of(message: Message, n: int) -> Format:
    """The wire format `message` travels in on a network of `n` robots."""
    try:
        below = downlink(n)
    except ValueError as error:
        raise EncodeError(str(error)) from None
    return TELEMETRY if isinstance(message, TelemetryFrame) else below


def encode(message: Message, n: int) -> bytes:
    """All characters of the frame as they are sent, preamble first, in a network of `n` robots (3 or 5).

    Raises EncodeError naming field, value and what is allowed for whatever may not be sent.
    """
    form = format_of(message, n)
    return seal(form, _body(message, n, form))


def _body(message: Any, n: int, form: Format) -> bytes:
    """HDR and payload in clear."""
    if isinstance(message, TeamFrame):
        kind, payload = _team_type(message.type), _team_payload(message, n)
    elif isinstance(message, ServiceFrame):
        kind, payload = FrameType.SERVICE, _service_payload(message, n)
    elif isinstance(message, TelemetryFrame):
        kind, payload = FrameType.TELEMETRY, _telemetry_payload(message, n)
    else:
        problem = "must be a TeamFrame, ServiceFrame or TelemetryFrame"
        raise EncodeError(f"message = {_shown(message)}: {problem}")
    header = kind * SEQ_MODULUS + checked(SEQ, message.seq)
    return bytes([header]) + payload.ljust(form.payload_size, b"\0")


def seal(form: Format, body: bytes) -> bytes:
    """Wire bytes around any `body` (HDR and payload in clear): CRC, whitening, sync and preamble."""
    crc = crc16(bytes([form.layout]) + body)
    return form.lead + form.sync + whiten(body + crc.to_bytes(2, "little"))


def decode_fields(body: bytes, n: int) -> Message:
    """The message in `body`: HDR and payload in clear, CRC already checked and taken off.

    Raises ContentError when the bytes are not what `encode` would have made of any message.
    """
    if not body:
        raise ContentError("the body is empty: it has a header and a payload")
    kind, seq = divmod(body[0], SEQ_MODULUS)
    payload = bytes(body[1:])
    if kind == _TELEMETRY_TYPE:
        size = _TELEMETRY.size
        first, *rest = _TELEMETRY.unpack(payload[:size].ljust(size, b"\0"))
        slot, flags = first & SLOT_MASK, first & ~SLOT_MASK
        message: Message = TelemetryFrame(seq, slot, flags, *rest)
        if len(payload) == size and slot < n and n in ROBOT_COUNTS and not flags & ~_FLAGS:
            return message  # the other fields may have any value
    elif kind == FrameType.SERVICE:
        message = _service_message(seq, payload)
    else:
        known = n in ROBOT_COUNTS and len(payload) == _VELOCITIES[n].size
        values = _VELOCITIES[n].unpack(payload) if known else unpack(VELOCITY * n, payload)
        message = TeamFrame(kind, seq, tuple(zip(values[::2], values[1::2], strict=True)))
        if known and min(values) >= _LOW:
            return message
    _require_sendable(message, body, n)
    return message


def asking_step(seq: int, slot: int, n: int) -> int:
    """Steps from `seq` to the next number with which a frame of type 3 requests an answer of the robot in `slot` of
    `n`.
    """
    return next(step for step in range(1, SEQ_MODULUS) if (seq + step) % SEQ_MODULUS % n == slot)


def describe(message: Message) -> str:
    """One line for people, the comment in a stream file: `team seq=3`."""
    if isinstance(message, TeamFrame):
        return f"{FrameType(message.type).name.lower()} seq={message.seq}"
    if isinstance(message, ServiceFrame):
        name, fields, values = Opcode(message.opcode).name, SERVICE_DATA[message.opcode], message.values
        numbers = [f" {field.name}={value}" for field, value in zip(fields, values, strict=True)]
        return f"{name.lower()} seq={message.seq} slot={message.slot}" + "".join(numbers)
    numbers = [f" {name}={getattr(message, name)}" for name in ("accepted", "rejected")]
    return f"telemetry seq={message.seq} slot={message.slot} flags={message.flags:02x}h" + "".join(numbers)


def _require_sendable(message: Message, body: bytes, n: int) -> None:
    try:
        same = _body(message, n, format_of(message, n)) == body
    except EncodeError as error:
        raise ContentError(str(error)) from None
    if not same:
        raise ContentError(f"{message!r} does not account for all of {bytes(body).hex(' ')}")


def _team_type(kind: int) -> int:
    choices = f"{FrameType.TEAM:d} or {FrameType.TEAM_ASK:d}"
    number = _whole("type", kind, choices)
    if number not in (FrameType.TEAM, FrameType.TEAM_ASK):
        raise EncodeError(f"type = {_shown(kind)}: a team frame has type {choices}")
    return number


def _team_payload(message: TeamFrame, n: int) -> bytes:
    pairs = _items("velocities", message.velocities, n, "pairs of (left, right), one a robot")
    return _VELOCITIES[n].pack(*(number for slot, pair in enumerate(pairs) for number in _pair(slot, pair)))


def _pair(slot: int, pair: Any) -> tuple[int, int]:
    where = f"slot {slot} "
    left, right = _items(where, pair, 2, "numbers (left, right)")
    return checked(VELOCITY[0], left, where), checked(VELOCITY[1], right, where)


def _service_payload(message: ServiceFrame, n: int) -> bytes:
    slot, opcode = SERVICE
    number = Opcode(checked(opcode, message.opcode))
    head = pack(slot, message.slot, high=n - 1) + pack(opcode, number)
    fields = SERVICE_DATA[number]
    content = f"numbers ({', '.join(field.name for field in fields)})" if fields else "numbers"
    values = _items(f"{number.name.lower()} values", message.values, len(fields), content)
    return head + b"".join(pack(*pair) for pair in zip(fields, values, strict=True))


def _service_message(seq: int, payload: bytes) -> ServiceFrame:
    slot, opcode = unpack(SERVICE, payload)
    fields = SERVICE_DATA.get(opcode)
    if fields is None:
        raise ContentError(f"service opcode {opcode} is not known")
    return ServiceFrame(seq, slot, opcode, tuple(unpack(fields, payload, sum(f.size for f in SERVICE))))


def _telemetry_payload(message: TelemetryFrame, n: int) -> bytes:
    slot = checked(SERVICE[0], message.slot, high=n - 1)
    flags = _whole("flags", message.flags, f"of bits of {_FLAGS:#04x}")
    if flags & ~_FLAGS:
        raise EncodeError(f"flags = {flags:#04x}: only bits of {_FLAGS:#04x} are defined")
    values = (slot | flags, *(getattr(message, field.name) for field in TELEMETRY_FIELDS[1:]))
    return b"".join(pack(*pair) for pair in zip(TELEMETRY_FIELDS, values, strict=True))
