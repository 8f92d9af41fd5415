"""Hypothesis strategies for frames and for what a receiver hears, drawn from the same table as the codec.

Needs the extra `hypothesis` (`pip install '.[hypothesis]'` in a checkout). What belongs here: inputs for tests
of any sender or receiver of this wire. What does not: assertions, the radio and the robot
(`mirotwin.testing`).

* `host_frames`, `telemetry_frames`: messages
* `valid_streams`, `damaged_streams`: characters as a receiver hears them, damaged by wrong bits, lost and added
  characters, wrong stop bits, pauses, slips (wrong start and stop bits) and noise
* `transmissions`: what a host sends at which tick, as a stream file holds it
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hypothesis import strategies as st

from miro_protocol.decoder import Symbol
from miro_protocol.frames import Message, ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.table import (
    BITS_PER_CHARACTER,
    FLAG_MEANINGS,
    HOST_BIT_TICKS,
    ROBOT_COUNTS,
    SEQ,
    SERVICE_DATA,
    TELEMETRY,
    TELEMETRY_FIELDS,
    TICKS_PER_MS,
    TICKS_PER_US,
    VELOCITY,
    Field,
    FrameType,
    Opcode,
    downlink,
)
from miro_protocol.transmission import DOWN, Transmission

NEAR_TICKS = 20 * TICKS_PER_US  # pauses that any receiver takes for none ...
FAR_TICKS = 80 * TICKS_PER_US  # ... and for one: in between, two right receivers may differ


def robot_counts() -> st.SearchStrategy[int]:
    return st.sampled_from(ROBOT_COUNTS)


def numbers(field: Field) -> st.SearchStrategy[int]:
    """Valid values of `field`."""
    return st.integers(field.low, field.high)


def team_frames(n: int) -> st.SearchStrategy[TeamFrame]:
    pair = st.tuples(*(numbers(field) for field in VELOCITY))
    return st.builds(
        TeamFrame,
        type=st.sampled_from([int(FrameType.TEAM), int(FrameType.TEAM_ASK)]),
        seq=numbers(SEQ),
        velocities=st.tuples(*[pair] * n),
    )


def service_frames(n: int) -> st.SearchStrategy[ServiceFrame]:
    def of_opcode(opcode: Opcode) -> st.SearchStrategy[ServiceFrame]:
        values = st.tuples(*(numbers(field) for field in SERVICE_DATA[opcode]))
        return st.builds(ServiceFrame, numbers(SEQ), st.integers(0, n - 1), st.just(int(opcode)), values)

    return st.sampled_from(Opcode).flatmap(of_opcode)


def telemetry_frames(n: int) -> st.SearchStrategy[TelemetryFrame]:
    flags = st.sets(st.sampled_from(sorted(FLAG_MEANINGS))).map(lambda some: sum(int(flag) for flag in some))
    rest = {field.name: numbers(field) for field in TELEMETRY_FIELDS[1:]}
    return st.builds(TelemetryFrame, seq=numbers(SEQ), slot=st.integers(0, n - 1), flags=flags, **rest)


def host_frames(n: int) -> st.SearchStrategy[Message]:
    """Messages that a host may send."""
    return st.one_of(team_frames(n), service_frames(n))


@dataclass(frozen=True)
class ReceivedStream:
    """Received characters with stop bit and time, and the messages that were sent undamaged."""

    n: int
    symbols: tuple[Symbol, ...]
    sent: tuple[Message, ...]


@dataclass(frozen=True)
class _Piece:
    """Characters to be sent after a pause; `stop_bits` and `pauses` one for each."""

    data: bytes
    stop_bits: tuple[bool, ...]
    pauses: tuple[int, ...]
    message: Message | None = None


def _pauses() -> st.SearchStrategy[int]:
    return st.one_of(st.integers(0, NEAR_TICKS), st.integers(FAR_TICKS, 10 * FAR_TICKS))


def _whole(wire: bytes, message: Message) -> st.SearchStrategy[_Piece]:
    near = st.lists(st.integers(0, NEAR_TICKS), min_size=len(wire), max_size=len(wire))
    return near.map(lambda pauses: _Piece(wire, (True,) * len(wire), tuple(pauses), message))


@st.composite
def _damaged(draw: st.DrawFn, wire: bytes) -> _Piece:
    """The frame with wrong bits, lost or added characters, bad stop bits or pauses inside."""
    data = bytearray(wire)
    place = st.integers(0, len(wire) - 1)
    for bit in draw(st.lists(st.integers(0, 8 * len(wire) - 1), max_size=3)):
        data[bit // 8] ^= 1 << bit % 8
    if draw(st.booleans()):
        at = draw(place)
        data[at : at + draw(st.integers(0, 2))] = draw(st.binary(max_size=2))
    stop_bits, pauses = [True] * len(data), [0] * len(data)
    if draw(st.booleans()):
        stop_bits[draw(place) % len(data)] = False
    if draw(st.booleans()):
        pauses[draw(place) % len(data)] = draw(_pauses())
    return _Piece(bytes(data), tuple(stop_bits), tuple(pauses))


def uart(bits: Sequence[int]) -> list[Symbol]:
    """The characters that a UART receives on a line that is mark, carries these bits of a host from tick 0 on, and is
    mark again. Each bit is sampled in its middle; the next falling edge is searched from the end of the stop bit on.
    """
    line, place = [1, *bits, *[1] * 10], 1
    symbols: list[Symbol] = []
    while place <= len(bits):
        if line[place - 1] == 1 and line[place] == 0:
            byte = sum(level << bit for bit, level in enumerate(line[place + 1 : place + 9]))
            symbols.append((byte, line[place + 9] == 1, (place - 1) * HOST_BIT_TICKS))
            place += 9
        place += 1
    return symbols


@st.composite
def _slipped(draw: st.DrawFn, wire: bytes) -> _Piece:
    """The frame with bits of the line turned over, start and stop bits among them, as a UART hears it.

    Pauses are counted in characters of the host, as those of the other pieces are.
    """
    bits = [bit for byte in wire for bit in (0, *(byte >> place & 1 for place in range(8)), 1)]
    for place in draw(st.lists(st.integers(0, len(bits) - 1), min_size=1, max_size=4, unique=True)):
        bits[place] ^= 1
    symbols = uart(bits)
    data, stop_bits = bytes(byte for byte, _, _ in symbols), tuple(good for _, good, _ in symbols)
    free, pauses = 0, []
    for _, _, tick in symbols:
        pauses.append(tick - free)
        free = tick + BITS_PER_CHARACTER * HOST_BIT_TICKS
    return _Piece(data, stop_bits, tuple(pauses))


@st.composite
def _noise(draw: st.DrawFn) -> _Piece:
    """Random characters, with more than a fair share of those that frames begin with."""
    lookalike = st.sampled_from([b"\x55", b"\xff", b"\x2d", b"\xd4", b"\x2d\xd4"])
    data = b"".join(draw(st.lists(st.one_of(lookalike, st.binary(min_size=1, max_size=4)), max_size=20)))
    stop_bits = draw(st.lists(st.booleans(), min_size=len(data), max_size=len(data)))
    pauses = draw(st.lists(st.one_of(st.just(0), _pauses()), min_size=len(data), max_size=len(data)))
    return _Piece(data, tuple(stop_bits), tuple(pauses))


@st.composite
def _heard(draw: st.DrawFn, damaged: bool, telemetry: bool) -> ReceivedStream:
    n = draw(robot_counts())
    message = telemetry_frames(n) if telemetry else host_frames(n)
    step = (TELEMETRY if telemetry else downlink(n)).character_ticks
    whole = message.flatmap(lambda sent: _whole(encode(sent, n), sent))
    broken = message.flatmap(lambda sent: _damaged(encode(sent, n)))
    slipped = message.flatmap(lambda sent: _slipped(encode(sent, n)))
    piece = st.one_of(whole, broken, slipped, _noise()) if damaged else whole
    tick, symbols, sent = 0, [], []
    for part in draw(st.lists(piece, max_size=6)):
        if not part.data:  # two pauses with nothing between them would be one that is neither near nor far
            continue
        tick += draw(_pauses())
        for byte, stop_good, pause in zip(part.data, part.stop_bits, part.pauses, strict=True):
            tick += pause
            symbols.append((byte, stop_good, tick))
            tick += step
        if part.message is not None:
            sent.append(part.message)
    return ReceivedStream(n, tuple(symbols), tuple(sent))


def valid_streams(telemetry: bool = False) -> st.SearchStrategy[ReceivedStream]:
    """Undamaged frames with pauses between them: all of `sent` must come out, in order."""
    return _heard(damaged=False, telemetry=telemetry)


def damaged_streams(telemetry: bool = False) -> st.SearchStrategy[ReceivedStream]:
    """Whole, damaged and slipped frames and noise in any order. Pauses are at most 20 us or at least 80 us."""
    return _heard(damaged=True, telemetry=telemetry)


@st.composite
def transmissions(draw: st.DrawFn, n: int, most: int = 10) -> list[Transmission]:
    """Frames, damaged frames and garbage that a host sends to `n` robots: `stream.write` makes a file of them.

    They do not overlap and are up to 200 ms apart.
    """
    frame = host_frames(n).map(lambda message: encode(message, n))
    piece = st.one_of(frame, frame.flatmap(_damaged).map(lambda broken: broken.data), st.binary(max_size=20))
    tick, sent = 0, []
    for data in draw(st.lists(piece.filter(len), max_size=most)):
        tick += draw(st.integers(0, 200)) * TICKS_PER_MS
        sent.append(Transmission(tick, DOWN, data))
        tick += len(data) * BITS_PER_CHARACTER * HOST_BIT_TICKS
    return sent
