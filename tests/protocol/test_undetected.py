"""What gets past the checks: nothing of few wrong bits and short bursts, and of many as much as exact weights say.

Experiments have a size for every test run; `python -m benchmarks.undetected` is the same at full size, and
`benchmarks/undetected.csv` has its figures.
"""

from itertools import combinations
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.interval import clopper_pearson
from benchmarks.line import decode_lines, line_bits, random_frames, receive
from benchmarks.undetected import crc_only, noise, on_the_line
from benchmarks.weights import code_words, covered_bits, syndromes, undetected_probability
from miro_protocol.decoder import Received, Scanner
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.hypothesis_frames import host_frames, telemetry_frames
from miro_protocol.table import DOWNLINK, TELEMETRY, Format, downlink

BY_FORMAT = pytest.mark.parametrize("form", [*DOWNLINK.values(), TELEMETRY], ids=lambda form: form.name)
TINY = Format("tiny", b"", b"\x2d\xd4", 0x13, 1, 2500)  # HDR, one byte of payload, CRC: 2^16 code words
IDLE_BITS = 20


def draws(seed):
    return np.random.Generator(np.random.Philox(seed))


def verdict_of(form, patterns, seed=3):
    """Frames as sent and others, when each column of `patterns` is turned over on a line of its own."""
    frames = random_frames(draws(seed), form, patterns.shape[1])
    idle = np.ones((IDLE_BITS, patterns.shape[1]), np.uint8)
    bits = np.concatenate([idle, line_bits(frames.wire), idle])
    bits[IDLE_BITS : IDLE_BITS + len(patterns)] ^= patterns
    return decode_lines(form, receive(bits), len(bits), frames.body)


def every_type(n):
    yield downlink(n), TeamFrame(0, 5, ((16633, -16633),) * n)
    yield downlink(n), ServiceFrame.filter(63, 2, 1, 2, 3, 4)
    yield downlink(n), TeamFrame(3, 0, ((0, 0),) * n)
    yield TELEMETRY, TelemetryFrame(9, 1, 8, 0x80, 0x80, 1, 2, 3, 4)


def with_wrong_bits(wire, first, bits):
    number = int.from_bytes(wire, "little")
    for bit in bits:
        number ^= 1 << (first + bit)
    return number.to_bytes(len(wire), "little")


@pytest.mark.parametrize(
    ("form", "wire"), [(form, encode(message, n)) for n in (3, 5) for form, message in every_type(n)]
)
def test_one_or_two_wrong_bits_are_refused_in_every_type_but_where_the_lead_alone_has_them(form, wire):
    decoder = Scanner(form)
    (sent,) = decoder.feed(wire)
    ways = [bits for wrong in (1, 2) for bits in combinations(range(8 * len(wire)), wrong)]
    events = decoder.feed(b"".join(with_wrong_bits(wire, 0, bits) for bits in ways))
    frames = [event for event in events if isinstance(event, Received)]
    in_lead = 8 * len(form.lead)
    assert {event.body for event in frames} == {sent.body}
    assert len(frames) == in_lead + comb(in_lead, 2)


@settings(max_examples=200)
@given(st.data(), st.sampled_from([3, 5]), st.integers(1, 4), st.booleans())
def test_one_to_four_wrong_bits_in_any_frame_are_refused(data, n, wrong, up):
    form = TELEMETRY if up else downlink(n)
    wire = encode(data.draw(telemetry_frames(n) if up else host_frames(n)), n)
    covered = covered_bits(form)
    place = st.integers(0, covered - 1)
    bits = data.draw(st.lists(place, min_size=wrong, max_size=wrong, unique=True))
    decoder = Scanner(form)
    decoder.feed(with_wrong_bits(wire, 8 * len(wire) - covered, bits))
    assert (decoder.valid, decoder.rejected >= 1) == (0, True)


@BY_FORMAT
@pytest.mark.parametrize("wrong", [1, 2])
def test_no_one_or_two_wrong_bits_anywhere_on_the_line_yield_another_frame(form, wrong):
    """Every way to choose them: preamble, sync, start and stop bits included. Most leave a frame that is refused."""
    places = np.array(list(combinations(range(10 * form.wire_size), wrong)))
    patterns = np.zeros((10 * form.wire_size, len(places)), np.uint8)
    for column in places.T:
        patterns[column, np.arange(len(places))] = 1
    verdict = verdict_of(form, patterns)
    assert verdict.wrong == 0
    assert 0 < verdict.right < len(places)


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
    starts = range(10 * (form.wire_size - form.body_size - 2), 10 * form.wire_size)
    bursts = np.unpackbits(np.arange(1, 256, 2, dtype=np.uint8)[:, None], axis=1, bitorder="little").T
    patterns = np.zeros((10 * form.wire_size + 7, len(starts), bursts.shape[1]), np.uint8)
    for lane, start in enumerate(starts):
        patterns[start : start + 8, lane] = bursts
    assert verdict_of(form, patterns.reshape(len(patterns), -1), seed=7) == (0, 0)


@pytest.mark.slow
def test_bits_from_a_coin_get_past_the_crc_as_often_as_weight_enumeration_says():
    """At a bit-error rate of 1/2 errors are frequent enough to be counted here: once in 65536."""
    form, count = DOWNLINK[3], 150_000
    expected = undetected_probability(form, 0.5)
    assert expected == pytest.approx(2**-16, rel=1e-3)
    low, high = clopper_pearson(crc_only(form, 0.5, count, draws(1)).wrong, count, 0.999)
    assert 0 < low < expected < high


@BY_FORMAT
def test_at_one_wrong_bit_in_a_hundred_nothing_gets_past_the_crc_in_a_small_sample(form):
    verdict = crc_only(form, 1e-2, 20_000, draws(2))
    assert verdict.wrong == 0
    intact = 0.99 ** (8 * (form.body_size + 2))
    assert verdict.right == pytest.approx(intact * 20_000, rel=0.1)


def test_on_a_noisy_line_frames_are_lost_but_none_is_wrong():
    strict, loose = on_the_line(DOWNLINK[3], 1e-3, 20_000, draws(3))
    assert strict.wrong == 0
    assert loose.right >= strict.right > 0.8 * 20_000


@pytest.mark.parametrize("form", DOWNLINK.values(), ids=lambda form: form.name)
def test_minutes_of_slicer_noise_hold_no_frame(form):
    heard, taken = noise(form, 300, draws(4))
    assert heard > 200_000
    assert taken == 0


# Exact weight enumeration: against listing all code words where they are few, and against another calculation


def test_a_code_small_enough_to_list_has_the_weights_it_has():
    single = np.array(syndromes(TINY), np.uint16)
    patterns = np.arange(1 << 16, dtype=np.uint32)
    syndrome = np.zeros(1 << 16, np.uint16)
    for bit in range(16):  # any HDR and payload; the CRC bits that make the syndrome 0 are then unique
        syndrome ^= np.where(patterns >> bit & 1, single[bit], 0).astype(np.uint16)
    basis = {int(single[bit]): bit for bit in range(16, 32)}
    spans = np.zeros(1 << 16, np.uint32)
    for combined, bits in solve(basis):
        spans[combined] = bits
    weight = ones(patterns) + ones(spans[syndrome])
    counted = np.bincount(weight, minlength=33).tolist()
    assert counted == code_words(TINY)


def ones(numbers):
    bits = np.unpackbits(numbers.astype("<u4").view(np.uint8).reshape(-1, 4), axis=1)
    return bits.sum(axis=1, dtype=np.int64)  # NumPy 1.26 counts neither in uint64 nor converts it


def solve(basis):
    """Every XOR of the CRC bits' syndromes, with how many bits as a mask."""
    found = [(0, 0)]
    for place, syndrome in enumerate(basis):
        found += [(value ^ syndrome, bits | 1 << place) for value, bits in found]
    return found


@BY_FORMAT
def test_no_one_to_four_wrong_bits_are_a_code_word_and_five_can_be(form):
    words = code_words(form)
    assert words[:5] == [1, 0, 0, 0, 0]
    assert words[5] > 0
    assert sum(words) == 1 << covered_bits(form) - 16


@BY_FORMAT
def test_the_low_weights_are_what_listing_them_gives(form):
    """A word of five bits is a pair and a triple with the same syndrome."""
    single = np.array(syndromes(form), np.uint16)
    pairs = np.zeros(1 << 16, np.int64)
    for first, second in combinations(range(len(single)), 2):
        pairs[single[first] ^ single[second]] += 1
    assert pairs.max() == 1  # what no bit, one and any two do all differs, so four never cancel each other
    assert not pairs[[0, *single]].any()
    meet = 0
    for first, second in combinations(range(len(single)), 2):
        meet += int(pairs[single[first] ^ single[second] ^ single[second + 1 :]].sum())
    # Nothing lighter exists, so pair and triple have no bit in common, and a word splits in comb(5, 2) ways.
    assert meet == comb(5, 2) * code_words(form)[5]


@pytest.mark.parametrize(
    ("form", "rate", "probability"),
    [(DOWNLINK[3], 1e-3, 2.8e-12), (DOWNLINK[3], 1e-4, 3.1e-17), (DOWNLINK[5], 1e-3, 2.3e-11)],
)
def test_the_probabilities_are_those_of_another_calculation(form, rate, probability):
    """By another program, from the weights of the dual code (MacWilliams identity), to two digits."""
    assert undetected_probability(form, rate) == pytest.approx(probability, rel=0.03)
