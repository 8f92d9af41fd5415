"""Hypothesis strategies for fuzz inputs. They draw whole operations, so every drawn byte has a meaning. Each draw costs
Hypothesis some 20 us, as much as a short run of the target, so values are combined into one draw where possible.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from hypothesis import strategies as st

from miro_protocol.frames import encode
from miro_protocol.hypothesis_frames import host_frames
from miro_protocol.table import SERVICE_DATA, VELOCITY, VELOCITY_SATURATION, Opcode, downlink
from miro_robot.harness.program import OPERATIONS
from mirotwin.fuzz.inputs import PIN, PUT

MOST_OPERATIONS = 16
"""Half a second on the air, more or less."""
_LIMITS = (0, 1, -1, *(limit for field in VELOCITY for limit in (field.low, field.high)))
_SPEEDS = sorted({*_LIMITS, *(sign * VELOCITY_SATURATION + by for sign in (1, -1) for by in (-1, 0, 1))})
_PAIRS = [struct.pack("<hh", left, right) for left in _SPEEDS for right in _SPEEDS]
_BYTES = [bytes([value]) for value in range(256)]
Bytes = st.SearchStrategy[bytes]


def inputs(
    kind: str,
    robots: int = 3,
    slot: int = 0,
    foreign: bool = False,
    seeds: Sequence[bytes] = (),
    puts: bool = False,
) -> Bytes:
    """Inputs of that kind ("bytes", "frames", "session") for robot `slot` of `robots`.

    `foreign`: frames have a wire format unknown here: a byte with the count less one, and the bytes. `seeds`: half of
    the inputs begin with one of them. `puts`: a session may put values of parts and levels on pins.
    """
    if kind == "session" and puts:
        put, pin = (st.binary(min_size=3, max_size=3).map(code.__add__) for code in (PUT, PIN))
        drawn = _joined(put | put | pin | _session_operations(robots, slot, True))
    else:
        drawn = {"bytes": _characters, "frames": _frames, "session": _session}[kind](robots, slot, foreign)
    if not seeds:
        return drawn
    return drawn | st.tuples(st.sampled_from(seeds), drawn).map(b"".join)


def _session(robots: int, slot: int, foreign: bool) -> Bytes:
    return _joined(_session_operations(robots, slot, foreign))


def _session_operations(robots: int, slot: int, foreign: bool) -> Bytes:
    """A strategy for each operation; frequent operations have several."""
    form = downlink(robots)
    places = st.integers(0, 256 * form.wire_size - 1).map(lambda both: bytes([both >> 8, both & 0xFF]))
    place = st.sampled_from(_BYTES[: form.wire_size])
    operations = [
        *_frame_operations(form.payload_size, slot, foreign),
        _operation("again"),
        _operation("raw", _counted()),
        _operation("pause", st.sampled_from(_BYTES)),
        _operation("silence", st.sampled_from(_BYTES)),
        _operation("damage", places),
        _operation("cut", place),
        _operation("stop bit", place),
        _operation("reset"),
    ]
    return st.one_of(*operations)


def _frame_operations(size: int, slot: int, foreign: bool) -> list[Bytes]:
    if foreign:
        return [_operation("frame", _counted())]
    any_payload = _exactly(size)
    return [
        *(
            _operation(name, speeds)
            for name in ("team", "ask")
            for speeds in (_exactly(4), st.sampled_from(_PAIRS))
        ),
        *(
            _operation("service", payload)
            for payload in (_settings(size, slot), _unknown(size, slot), any_payload)
        ),
        _operation("full", any_payload),
        _operation("frame", _exactly(1 + size)),
    ]


def _frames(robots: int, slot: int, foreign: bool) -> Bytes:
    if foreign:
        return _joined(_counted())
    size = downlink(robots).payload_size
    header = st.sampled_from(_BYTES)
    services = (_settings(size, slot), _unknown(size, slot))
    return _joined(_exactly(1 + size) | st.tuples(header, st.one_of(services)).map(b"".join))


def _characters(robots: int, slot: int, foreign: bool) -> Bytes:
    noise = st.binary(min_size=1, max_size=64)
    return _joined(noise if foreign else noise | host_frames(robots).map(lambda frame: encode(frame, robots)))


def _joined(pieces: Bytes) -> Bytes:
    return st.lists(pieces, min_size=1, max_size=MOST_OPERATIONS).map(b"".join)


def _operation(name: str, arguments: Bytes | None = None) -> Bytes:
    code = bytes([OPERATIONS.index(name)])
    return st.just(code) if arguments is None else arguments.map(lambda some: code + some)


def _settings(size: int, slot: int) -> Bytes:
    """Payloads of service frames for this robot, with an opcode that there is."""
    heads = [bytes([slot, opcode]) for opcode in Opcode]
    longest = max(len(b"".join(bytes(field.size) for field in fields)) for fields in SERVICE_DATA.values())
    return st.tuples(st.sampled_from(heads), _exactly(longest)).map(
        lambda drawn: b"".join(drawn).ljust(size, b"\0")
    )


def _unknown(size: int, slot: int) -> Bytes:
    """Payloads of service frames for this robot, with any opcode and any bytes after it."""
    return _exactly(size - 1).map(lambda drawn: _BYTES[slot] + drawn)


def _exactly(size: int) -> Bytes:
    return st.binary(min_size=size, max_size=size)


def _counted() -> Bytes:
    """A byte with the count less one, and the bytes."""
    return st.binary(min_size=1, max_size=32).map(lambda some: bytes([len(some) - 1]) + some)
