"""Many frames on many lines at once: bits, a UART that samples them, and what a decoder makes of it.

Arrays are uint8 and hold one line a column, so that a step of all UARTs is a few numpy operations.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from miro_protocol import crc, whitening
from miro_protocol.decoder import Received, Scanner
from miro_protocol.table import BITS_PER_CHARACTER, HOST_BIT_TICKS, Format

WHITE = np.frombuffer(whitening.STRING, np.uint8)
CRC_TABLE = np.array(crc.table_of(8), np.uint16)


class Frames(NamedTuple):
    """`wire`: characters (count, wire size). `body`: HDR and payload in clear (count, body size)."""

    wire: np.ndarray
    body: np.ndarray


class Symbols(NamedTuple):
    """What UARTs received, line by line: character, stop bit bad, number of its start bit, line."""

    data: np.ndarray
    bad_stop: np.ndarray
    place: np.ndarray
    line: np.ndarray


def random_frames(rng: np.random.Generator, form: Format, count: int) -> Frames:
    """Frames with random HDR and payload."""
    body = rng.integers(0, 256, (count, form.body_size), np.uint8)
    register = np.full(count, crc.register(bytes([form.layout])), np.uint16)
    for column in body.T:
        register = register >> 8 ^ CRC_TABLE[(register ^ column) & 0xFF]
    check = (register ^ np.uint16(crc.XOR_OUT)).astype("<u2").view(np.uint8).reshape(count, 2)
    covered = np.concatenate([body, check], axis=1) ^ WHITE[: form.body_size + 2]
    head = np.frombuffer(form.lead + form.sync, np.uint8)
    return Frames(np.concatenate([np.tile(head, (count, 1)), covered], axis=1), body)


def line_bits(wire: np.ndarray) -> np.ndarray:
    """The characters as (10 * size, count) bits: start, 8 data bits low first, stop."""
    count, size = wire.shape
    bits = np.ones((count, size, BITS_PER_CHARACTER), np.uint8)
    bits[:, :, 0] = 0
    bits[:, :, 1:9] = np.unpackbits(wire.reshape(count, size, 1), axis=2, bitorder="little")
    return np.ascontiguousarray(bits.reshape(count, -1).T)


def flip(rng: np.random.Generator, bits: np.ndarray, bit_error_rate: float) -> None:
    """Turns each bit of a contiguous array over with the given probability."""
    flat = bits.reshape(-1)
    place = -1
    while place < flat.size:
        gaps = rng.geometric(bit_error_rate, 1 + int(flat.size * bit_error_rate))
        places = place + np.cumsum(gaps)
        place = int(places[-1])
        flat[places[places < flat.size]] ^= 1


def receive(bits: np.ndarray) -> Symbols:
    """UARTs on lines of (time, line) bits: a fall from 1 to 0 starts a character, good stop bit or not."""
    length, lines = bits.shape
    before = np.ones(lines, np.uint8)
    count = np.zeros(lines, np.uint8)  # bits of a character seen so far, 0 = waiting for a start bit
    shift = np.zeros(lines, np.uint8)
    data = np.zeros((length, lines), np.uint8)
    done = np.zeros((length, lines), np.uint8)  # 1 = a character with good stop bit ends here, 2 = with bad
    for time in range(length):
        bit = bits[time]
        start = (count == 0) & (before > bit)
        stop = count == 9
        np.copyto(data[time], shift, where=stop)
        done[time] = stop * (2 - bit)
        shift >>= 1
        shift |= bit << 7
        count += (count > 0) | start
        count *= ~stop
        before = bit
    line, end = np.nonzero(done.T)
    return Symbols(data[end, line], (done[end, line] == 2).view(np.uint8), end - 9, line)


class Verdict(NamedTuple):
    """Frames accepted as sent, and with another body: what must not happen."""

    right: int
    wrong: int


def decode_lines(
    form: Format, symbols: Symbols, length: int, body: np.ndarray, strict: bool = True
) -> Verdict:
    """Feeds all lines, far apart in time, to one decoder, and compares with what each line carried.

    Not `strict` leaves out the rules about stop bits and spacing.
    """
    spacing = (length + 100) * HOST_BIT_TICKS
    ticks = symbols.line * spacing + symbols.place * HOST_BIT_TICKS
    bad_stop = symbols.bad_stop if strict else np.zeros_like(symbols.bad_stop)
    scanner = Scanner(form) if strict else Scanner(form, tolerance_ticks=50 * HOST_BIT_TICKS)
    events = scanner.feed_symbols(rows(symbols.data, bad_stop, ticks))
    return compare(
        ((event.start_tick // spacing, event) for event in events if type(event) is Received), body
    )


def rows(data: np.ndarray, bad_stop: np.ndarray, ticks: np.ndarray) -> Iterable[tuple[int, bool, int]]:
    """Columns of characters one by one, as a decoder takes them."""
    return zip(data.tolist(), (bad_stop == 0).tolist(), ticks.tolist(), strict=True)


def compare(received: object, body: np.ndarray) -> Verdict:
    """Judges pairs of (line, frame)."""
    sent, size = body.tobytes(), body.shape[1]
    right = wrong = 0
    for line, event in received:  # type: ignore[attr-defined]
        if event.body == sent[line * size : line * size + size]:
            right += 1
        else:
            wrong += 1
    return Verdict(right, wrong)
