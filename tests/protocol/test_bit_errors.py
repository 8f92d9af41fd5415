"""The promise of the frame: any 1 to 4 wrong bits and any burst of 16 in HDR..CRC are refused, whatever it says."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.line import decode_lines, line_bits, random_frames, receive
from benchmarks.weights import covered_bits, syndromes
from miro_protocol.decoder import Received, WindowDecoder
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.hypothesis_frames import host_frames, telemetry_frames
from miro_protocol.table import DOWNLINK, TELEMETRY, downlink

FORMATS = (*DOWNLINK.values(), TELEMETRY)
BY_FORMAT = pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)


def every_type(n):
    yield downlink(n), TeamFrame(0, 5, ((16633, -16633),) * n)
    yield downlink(n), ServiceFrame.filter(63, 2, 1, 2, 3, 4)
    yield downlink(n), TeamFrame(3, 0, ((0, 0),) * n)
    yield TELEMETRY, TelemetryFrame(9, 1, 8, 0x80, 0x80, 1, 2, 3, 4)


CASES = [(form, encode(message, n)) for n in (3, 5) for form, message in every_type(n)]


def with_wrong_bits(wire, first, bits):
    number = int.from_bytes(wire, "little")
    for bit in bits:
        number ^= 1 << (first + bit)
    return number.to_bytes(len(wire), "little")


@pytest.mark.parametrize(("form", "wire"), CASES)
@pytest.mark.parametrize("wrong", [1, 2])
def test_every_way_to_get_one_or_two_bits_wrong_is_refused_in_every_type(form, wire, wrong):
    covered = covered_bits(form)
    decoder = WindowDecoder(form)
    ways = list(combinations(range(covered), wrong))
    first = 8 * len(wire) - covered
    decoder.feed(b"".join(with_wrong_bits(wire, first, bits) for bits in ways))
    assert (decoder.valid, decoder.rejected >= len(ways)) == (0, True)
    decoder.feed(wire)
    assert decoder.valid == 1


@BY_FORMAT
def test_no_one_to_four_wrong_bits_at_all_leave_the_crc_good(form):
    """The code is linear: what a set of wrong bits does to the CRC is the XOR of what each does alone. If those
    of no bit, of one and of any two all differ, then three or four never cancel each other either."""
    alone = syndromes(form)
    pairs = [first ^ second for first, second in combinations(alone, 2)]
    assert len({0, *alone, *pairs}) == 1 + len(alone) + len(pairs)


def burst_syndromes(alone, length):
    """Of all bursts of up to `length` bits that begin at the first of `alone`; 0 stands for no bit there."""
    found = np.array([alone[0]], np.uint16)
    for syndrome in alone[1:length]:
        found = np.concatenate([found, found ^ np.uint16(syndrome)])
    return found


@BY_FORMAT
def test_every_burst_of_up_to_16_data_bits_is_refused(form):
    alone = syndromes(form)
    assert all(burst_syndromes(alone[start:], 16).all() for start in range(len(alone)))


@BY_FORMAT
def test_every_burst_of_up_to_20_wire_bits_is_refused(form):
    """Start and stop bits count as bits of the burst; what they do to the UART only makes it worse (below)."""
    wire = []
    for place, syndrome in enumerate(syndromes(form)):
        wire += [syndrome] if place % 8 else [0, 0, syndrome]  # the stop bit before, the start bit
    for start in (place for place, syndrome in enumerate(wire) if syndrome):
        assert burst_syndromes(wire[start:], 20).all()


@BY_FORMAT
def test_every_burst_of_up_to_8_wire_bits_is_refused_through_the_uart_too(form):
    """`python -m benchmarks.undetected bursts` does the same up to 16 bits."""
    rng = np.random.Generator(np.random.Philox(7))
    patterns = np.unpackbits(np.arange(1, 256, 2, dtype=np.uint8)[:, None], axis=1, bitorder="little").T
    starts = range(10 * (form.wire_size - form.body_size - 2), 10 * form.wire_size)
    frames = random_frames(rng, form, len(starts) * patterns.shape[1])
    idle = np.ones((20, len(frames.body)), np.uint8)
    bits = np.concatenate([idle, line_bits(frames.wire), idle])
    lanes = bits.reshape(len(bits), len(starts), -1)
    for lane, start in enumerate(starts):
        lanes[20 + start : 28 + start, lane] ^= patterns
    assert decode_lines(form, receive(bits), len(bits), frames.body) == (0, 0)


@settings(max_examples=200)
@given(st.data(), st.sampled_from([3, 5]), st.integers(1, 4), st.booleans())
def test_one_to_four_wrong_bits_in_any_frame_are_refused(data, n, wrong, up):
    form = TELEMETRY if up else downlink(n)
    wire = encode(data.draw(telemetry_frames(n) if up else host_frames(n)), n)
    covered = covered_bits(form)
    place = st.integers(0, covered - 1)
    bits = data.draw(st.lists(place, min_size=wrong, max_size=wrong, unique=True))
    decoder = WindowDecoder(form)
    decoder.feed(with_wrong_bits(wire, 8 * len(wire) - covered, bits))
    assert (decoder.valid, decoder.rejected >= 1) == (0, True)


@pytest.mark.parametrize(("form", "wire"), CASES)
def test_one_or_two_wrong_bits_anywhere_never_yield_a_frame_that_was_not_sent(form, wire):
    decoder = WindowDecoder(form)
    (sent,) = decoder.feed(wire)
    ways = [bits for wrong in (1, 2) for bits in combinations(range(8 * len(wire)), wrong)]
    events = decoder.feed(b"".join(with_wrong_bits(wire, 0, bits) for bits in ways))
    frames = [event for event in events if isinstance(event, Received)]
    untouched = 8 * len(form.lead)
    assert {event.body for event in frames} == {sent.body}
    assert len(frames) == comb_up_to_two(untouched)


def comb_up_to_two(bits):
    return bits + bits * (bits - 1) // 2
