"""What was sent, written down as inputs that the target reads back as the same.

In `session` pauses keep their length to within a step, and frames become operations, so that a fuzzer changes what they
say and not their CRC. What is no frame becomes characters. Left out are telemetry, what robots say, switched supplies
and radios, and bad stop bits of characters outside a frame, for which a session has no operation. `frames` has frames
alone, `bytes` no pauses.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.table import SEQ_MODULUS, FrameType
from miro_protocol.transmission import DOWN, Transmission

SERVICE, FULL, FRAME, AGAIN, RAW, PAUSE, SILENCE, RESET = 5, 6, 7, 8, 9, 10, 11, 15
"""Operations of a session, by nibble."""
PAUSE_TICKS, SILENCE_TICKS = 2_400, 72_000
_STEPS = 256
_RAW_CHARACTERS = 32
TOGETHER = 12
"""Transmissions that make one input: a long recording becomes many short inputs, which fuzzers like better."""

Frame = tuple[int, bytes]
"""HDR and payload."""


def inputs_of(kind: str, happened: Iterable[ScriptItem], robots: int) -> list[bytes]:
    """The inputs of that kind that this becomes, at most so many transmissions each, no two the same."""
    heard = [
        one for one in happened if not isinstance(one, Transmission) or (one.direction == DOWN and one.data)
    ]
    pieces = [heard[first : first + TOGETHER] for first in range(0, len(heard), TOGETHER)]
    return list(dict.fromkeys(filter(None, (input_of(kind, piece, robots) for piece in pieces))))


def input_of(kind: str, heard: Sequence[ScriptItem], robots: int) -> bytes:
    """One input of that kind; empty where there is nothing that it could say."""
    if kind == "bytes":
        return b"".join(one.data for one in heard if isinstance(one, Transmission))
    found = bytearray()
    last_seq = 0
    end_tick = heard[0].tick if heard else 0
    for one in heard:
        if not isinstance(one, Transmission):
            if kind == "session" and isinstance(one, Reset) and one.level:
                found.append(RESET)
            continue
        if kind == "session":
            found += _waited(one.tick - end_tick)
        for part in _parts(one, robots):
            if isinstance(part, bytes):
                found += _raw(part) if kind == "session" else b""
                continue
            seq = part[0] % SEQ_MODULUS
            step = (seq - last_seq) % SEQ_MODULUS
            written = _operation(part, step) if kind == "session" else _frame(part, step)
            if kind != "session" or written[0] != FRAME:
                last_seq = seq
            found += written
        end_tick = one.end_tick
    return bytes(found)


def _waited(ticks: int) -> bytes:
    """Operations that wait so long: silences, then a pause."""
    found = bytearray()
    while ticks >= _STEPS * PAUSE_TICKS:
        steps = min(_STEPS, ticks // SILENCE_TICKS)
        found += bytes([SILENCE, steps - 1])
        ticks -= steps * SILENCE_TICKS
    steps = (ticks + PAUSE_TICKS // 2) // PAUSE_TICKS
    if steps > 0:
        found += bytes([PAUSE, min(steps, _STEPS) - 1])
    return bytes(found)


def _parts(one: Transmission, robots: int) -> list[Frame | bytes]:
    """The frames in a transmission that a target can make, and the characters between them."""
    found: list[Frame | bytes] = []
    rest = one.data
    for event in Decoder(robots).hear(one):
        if not isinstance(event, Received) or event.type == FrameType.TELEMETRY:
            continue
        before, here, behind = rest.partition(event.data)
        if here:
            found += [*([before] if before else []), (event.body[0], event.body[1:])]
            rest = behind
    return [*found, *([rest] if rest else [])]


def _raw(data: bytes) -> bytes:
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
