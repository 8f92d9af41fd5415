"""Converts transmissions to inputs that a target reads back as the same, and defines a campaign's first inputs.

In `session` pauses keep their length to within a step, and frames become operations, so that a fuzzer changes their
content and not their CRC. Characters outside a frame stay characters. Telemetry, robots' answers, hardware faults,
switched supplies and radios, and bad stop bits of characters outside a frame are left out: no operation is made for
them. `frames` contains frames only, `bytes` no pauses.

Eight random bytes alone never get past the synchronisation, so a campaign begins with frames: each kind of frame that a
host may send, once. A seed is short, and each makes a robot react differently. Tokens are words for AFL++.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import Message, ServiceFrame, TeamFrame, encode
from miro_protocol.table import (
    DEFAULT_ACCELERATION,
    SEQ_MODULUS,
    SERVICE_DATA,
    VELOCITY,
    VELOCITY_SATURATION,
    FrameType,
    Opcode,
    downlink,
)
from miro_protocol.transmission import DOWN, Transmission

SERVICE, FULL, FRAME, AGAIN, RAW, PAUSE, SILENCE, RESET = 5, 6, 7, 8, 9, 10, 11, 15
"""Operations of a session, by nibble."""
PUT, PIN = b"\x01", b"\x04"
"""Operations that put a value of a part, and a level on a pin, on a board with parts."""
PAUSE_TICKS, SILENCE_TICKS = 2_400, 72_000
_STEPS = 256
_RAW_CHARACTERS = 32
TOGETHER = 12
"""Transmissions that make one input: a long recording becomes many short inputs, which fuzzers like better."""

Frame = tuple[int, bytes]
"""HDR and payload."""


def inputs_of(kind: str, happened: Iterable[ScriptItem], robots: int) -> list[bytes]:
    """The distinct inputs of that kind made from `happened`, each with a limited number of transmissions."""
    items = [
        item
        for item in happened
        if not isinstance(item, Transmission) or (item.direction == DOWN and item.data)
    ]
    pieces = [items[first : first + TOGETHER] for first in range(0, len(items), TOGETHER)]
    return list(dict.fromkeys(filter(None, (input_of(kind, piece, robots) for piece in pieces))))


def input_of(kind: str, items: Sequence[ScriptItem], robots: int) -> bytes:
    """One input of that kind; empty if that kind cannot express any of the items."""
    if kind == "bytes":
        return b"".join(item.data for item in items if isinstance(item, Transmission))
    data = bytearray()
    last_seq = 0
    end_tick = items[0].tick if items else 0
    for item in items:
        if not isinstance(item, Transmission):
            if kind == "session" and isinstance(item, Reset) and item.level:
                data.append(RESET)
            continue
        if kind == "session":
            data += waited(item.tick - end_tick)
        for part in _parts(item, robots):
            if isinstance(part, bytes):
                data += raw(part) if kind == "session" else b""
                continue
            seq = part[0] % SEQ_MODULUS
            step = (seq - last_seq) % SEQ_MODULUS
            written = _operation(part, step) if kind == "session" else _frame(part, step)
            if kind != "session" or written[0] != FRAME:
                last_seq = seq
            data += written
        end_tick = item.end_tick
    return bytes(data)


def waited(ticks: int) -> bytes:
    """Operations that wait so long: silences, then a pause."""
    data = bytearray()
    while ticks >= _STEPS * PAUSE_TICKS:
        steps = min(_STEPS, ticks // SILENCE_TICKS)
        data += bytes([SILENCE, steps - 1])
        ticks -= steps * SILENCE_TICKS
    steps = (ticks + PAUSE_TICKS // 2) // PAUSE_TICKS
    if steps > 0:
        data += bytes([PAUSE, min(steps, _STEPS) - 1])
    return bytes(data)


def _parts(transmission: Transmission, robots: int) -> list[Frame | bytes]:
    """The frames in a transmission that a target can make, and the characters between them."""
    parts: list[Frame | bytes] = []
    rest = transmission.data
    for event in Decoder(robots).hear(transmission):
        if not isinstance(event, Received) or event.type == FrameType.TELEMETRY:
            continue
        before, here, behind = rest.partition(event.data)
        if here:
            parts += [*([before] if before else []), (event.body[0], event.body[1:])]
            rest = behind
    return [*parts, *([rest] if rest else [])]


def raw(data: bytes) -> bytes:
    pieces = [data[first : first + _RAW_CHARACTERS] for first in range(0, len(data), _RAW_CHARACTERS)]
    return b"".join(bytes([RAW, len(piece) - 1]) + piece for piece in pieces)


def _operation(frame: Frame, step: int) -> bytes:
    hdr, payload = frame
    kind = hdr >> 6
    if step == 1 and kind in (FrameType.TEAM, FrameType.SERVICE):
        return bytes([FULL if kind == FrameType.TEAM else SERVICE]) + payload
    return bytes([FRAME, hdr]) + payload


def _frame(frame: Frame, step: int) -> bytes:
    hdr, payload = frame
    return bytes([(hdr & 0xC0) | ((step - 1) & 7)]) + payload


MS = 24_000
_BETWEEN_MS = 12
_FILTER = (100, 10, 20, 100)

TimedMessage = tuple[Message, int]
"""A frame, and the milliseconds of silence before it."""


def talks(robots: int, slot: int) -> list[list[TimedMessage]]:
    """Messages of a host, one list a seed."""

    def team(seq: int, speed: int, kind: int = FrameType.TEAM) -> TeamFrame:
        return TeamFrame(kind, seq, ((speed, speed),) * robots)

    def question_seq(first: int) -> int:
        """The number from `first` on with which a question goes to this robot."""
        return next(seq for seq in range(first, first + robots) if seq % robots == slot)

    poll = question_seq(1)
    return [
        [(team(1, 900), 0)],
        [(team(1, 16_633), 0), (team(2, -16_633), _BETWEEN_MS), (team(3, 0), _BETWEEN_MS)],
        [(team(poll, 300, FrameType.TEAM_ASK), 0)],
        [(team(1, 300, FrameType.TEAM_ASK), 0), (team(2, 300, FrameType.TEAM_ASK), 40)],
        [(ServiceFrame.ping(1, slot), 0)],
        [(ServiceFrame.filter(1, slot, *_FILTER), 0)],
        [(ServiceFrame.acceleration(1, slot, DEFAULT_ACCELERATION // 2), 0), (team(2, 900), _BETWEEN_MS)],
        [(team(1, 900), 0), (ServiceFrame.acceleration(2, slot, DEFAULT_ACCELERATION), _BETWEEN_MS)],
        [(team(1, 900), 0), (team(1, 100), 160)],  # the same number again: not fresh
        [(team(1, 900), 0), (team(2, 900), 120)],  # longer than the smooth stop's time
        [(team(1, 900), 0), (team(2, 900), 520)],  # longer than the time after which motors go off
        [(team(1, 900), 0), (team(poll + 6, 900, FrameType.TEAM_ASK), 120)],
    ]


def sent(talk: Sequence[TimedMessage], robots: int) -> list[Transmission]:
    """A talk as transmissions."""
    transmissions: list[Transmission] = []
    end_tick = 0
    for message, silence_ms in talk:
        transmissions.append(Transmission(end_tick + silence_ms * MS, DOWN, encode(message, robots)))
        end_tick = transmissions[-1].end_tick
    return transmissions


def seeds(kind: str, robots: int, slot: int) -> list[bytes]:
    """The built-in inputs of that kind."""
    inputs = [input_of(kind, sent(talk, robots), robots) for talk in talks(robots, slot)]
    if kind == "session":
        inputs += [seed + bytes([SILENCE, 39]) for seed in inputs[:1]]  # 120 ms of silence at the end
        inputs += [seed + bytes([SILENCE, 173]) for seed in inputs[:1]]  # 522 ms
    return list(dict.fromkeys(inputs))


def wire_tokens(robots: int) -> list[bytes]:
    """Tokens for inputs of characters: the begin of a frame, and one whole frame of each kind."""
    form = downlink(robots)
    still = ((0, 0),) * robots
    messages: list[Message] = [TeamFrame(kind, 1, still) for kind in (FrameType.TEAM, FrameType.TEAM_ASK)]
    messages += [
        ServiceFrame(1, 0, opcode, tuple(field.low for field in SERVICE_DATA[opcode])) for opcode in Opcode
    ]
    return [form.lead, form.sync, form.lead + form.sync, *(encode(message, robots) for message in messages)]


def message_tokens(robots: int) -> list[bytes]:
    """Tokens for inputs whose frames are sealed by the target: heads of service payloads, and limit values of
    numbers.
    """
    heads = [bytes([slot, op]) for op in Opcode for slot in range(robots)]
    speeds = [limit for field in VELOCITY for limit in (field.low, field.high, field.low - 1)]
    speeds += [VELOCITY_SATURATION, VELOCITY_SATURATION + 1, -VELOCITY_SATURATION, -VELOCITY_SATURATION - 1]
    limits = [struct.pack("<h", value) for value in speeds]
    for fields in SERVICE_DATA.values():
        for field in fields:
            for value in (field.low, field.high, min(field.high + 1, (1 << 8 * field.size) - 1)):
                limits.append(value.to_bytes(field.size, "little"))
    return heads + limits
