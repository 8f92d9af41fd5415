"""Describes the robot's wrong reaction in words, if one usual mistake explains all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from miro_exact.bad_input import amount
from miro_protocol.decoder import TelemetryDecoder
from miro_protocol.events import Damaged
from miro_protocol.table import SEQ_MODULUS, SYNC, TELEMETRY, TICKS_PER_MS, VELOCITY_SATURATION, FrameType
from miro_protocol.transmission import follows
from mirotwin.conform.sealing import mistake_in
from mirotwin.verify.checks.orders import Order, saturated

if TYPE_CHECKING:
    from miro_sim.world.events import Event
    from mirotwin.conform.trial_script import Frame

Pair = tuple[int, int]
_SHIFTS = range(1, 17)
_PLAIN = 16 << 8


def number(value: int, digits: int = 4) -> str:
    """Decimal and hexadecimal, a negative one as its two's complement."""
    return f"{value} ({value & (1 << 4 * digits) - 1:0{digits}X}h)"


def in_words(order: Order) -> str:
    """An order for people: `off`, `stop`, or the velocity as the radio carries it."""
    if order.what != "drive":
        return f"abrupt {order.what}" if order.abrupt else order.what
    if order.word is None or not -0x8000 <= order.word <= 0x7FFF:
        return f"{order.velocity / 256:.7g} ({order.velocity & 0xFFFF_FFFF:08X}h in the LM629)"
    return number(order.word)


def payload_of(words: Iterable[Pair]) -> bytes:
    """The payload of a team frame."""
    return b"".join(word.to_bytes(2, "little", signed=True) for pair in words for word in pair)


def wheels_instead(orders: Sequence[Order], frame: Frame, slot: int) -> str:
    """Names the one mistake that explains both orders after this frame; "" if none does."""
    velocities = (orders[0].velocity, orders[1].velocity)
    left, right = frame.for_robot(slot)
    wanted = (left << 8, right << 8)
    at_limit = max(map(abs, frame.words[slot])) >= VELOCITY_SATURATION  # where one mistake looks like another
    if at_limit or any(order.what != "drive" for order in orders) or velocities == wanted:
        return ""
    for mistake, pair in _mistakes(frame, slot):
        # firmware may cut off before or after its mistake
        for left_word, right_word in (pair, (saturated(pair[0]), saturated(pair[1]))):
            if (left_word << 8, right_word << 8) == velocities:
                return mistake
    for shift in _SHIFTS:
        if velocities == (wanted[0] << shift, wanted[1] << shift):
            return f"{1 << shift} times as fast"
        if all(_is_slower(*ends, shift) for ends in zip(velocities, wanted, strict=True)):
            return f"{1 << shift} times as slow"
    return ""


def _is_slower(velocity: int, wanted: int, shift: int) -> bool:
    """By a power of two, exactly or as a number that was shifted as the radio carries it and is not all gone."""
    off = abs((velocity << shift) - wanted)
    return (off == 0 and velocity != 0) or (off < 256 << shift and abs(velocity) >= _PLAIN)


def _mistakes(frame: Frame, slot: int) -> Iterator[tuple[str, Pair]]:
    # the likelier one first: several may explain the same two velocities
    left, right = frame.words[slot]
    yield "the signs of both are turned over", (-left, -right)
    yield "the left one goes the wrong way", (-left, right)
    yield "the right one goes the wrong way", (left, -right)
    yield "left and right are exchanged", (right, left)
    yield "left and right are exchanged, and both signs turned over", (-right, -left)
    yield "the bytes of each are exchanged: the low one comes first", (_exchanged(left), _exchanged(right))
    yield "the test of the sign is the wrong way round", (_wrong_way(left), _wrong_way(right))
    yield "the low bytes are lost", (left & ~0xFF, right & ~0xFF)
    yield "the low bits are lost", (left & ~1, right & ~1)
    for which, high in (("low", 0), ("high", 8)):
        yield f"they are the {which} bytes alone", (left >> high & 0xFF, right >> high & 0xFF)
        yield f"they are the {which} bytes alone, with sign", (_signed(left >> high), _signed(right >> high))
    yield "they are taken as numbers without sign", (left & 0xFFFF, right & 0xFFFF)
    for other, pair in enumerate(frame.words):
        yield f"these are the velocities of robot {other}", pair
    payload = payload_of(frame.words)
    for offset in range(len(payload) - 3):
        pair = (_word(payload, offset), _word(payload, offset + 2))
        yield (
            f"these are bytes {offset} to {offset + 3} of the payload and not {4 * slot} to {4 * slot + 3}",
            pair,
        )
    if frame.before:
        yield "these are the velocities of the frame before", frame.before[slot]


def _wrong_way(word: int) -> int:
    """The result in 16 bits of code that mistakes backward for forward before it takes the magnitude."""
    return -(-word & 0xFFFF) if word > 0 else word & 0xFFFF


def _word(payload: bytes, offset: int) -> int:
    return int.from_bytes(payload[offset : offset + 2], "little", signed=True)


def _exchanged(word: int) -> int:
    return int.from_bytes(word.to_bytes(2, "little", signed=True), "big", signed=True)


def _signed(byte: int) -> int:
    return (byte & 0xFF ^ 0x80) - 0x80


def characters(received: Sequence[Event]) -> str:
    """Characters that the PC received: how many, which, from when to when."""
    shown = " ".join(
        f"{character.value:02X}" + ("" if character.good_stop else "!") for character in received[:24]
    )
    more = " .." if len(received) > 24 else ""
    count = amount(len(received), "character")
    return f"{count}, {shown}{more} ({between(received[0].tick, received[-1].tick)})"


def in_a_row(received: Sequence[Event]) -> Sequence[Event]:
    """The first characters, up to a pause."""
    for count, (character, other) in enumerate(pairwise(received), 1):
        if not follows(character.tick, other.tick):
            return received[:count]
    return received


def between(begin_tick: int, end_tick: int) -> str:
    times = f"{begin_tick / TICKS_PER_MS:.3f} to {end_tick / TICKS_PER_MS:.3f} ms"
    return f"ticks {begin_tick} to {end_tick}, {times}"


def no_answer(received: Sequence[Event], seq: int) -> str:
    """Why these characters are no answer to the question with this number."""
    data = bytes(character.value for character in received)
    begin = data.find(SYNC)
    if begin < 0:
        return "no sync 2D D4"
    window = data[begin : begin + TELEMETRY.size]
    if len(window) < TELEMETRY.size:
        return f"{amount(len(window), 'character')} from the sync on and not {TELEMETRY.size}"
    begins = FrameType.TELEMETRY * SEQ_MODULUS + seq
    mistake = mistake_in(TELEMETRY, window, begins)
    if mistake:
        return f"it has {mistake}"
    if window[len(SYNC)] == begins:
        return f"its HDR {begins:02X}h is not whitened"
    decoder = TelemetryDecoder()
    events = (
        decoder.feed_symbols(
            [(character.value, character.good_stop, character.tick) for character in received]
        )
        + decoder.flush()
    )
    reasons = [event.reason for event in events if isinstance(event, Damaged)]
    return max(reasons).name.lower().replace("_", " ") if reasons else ""
