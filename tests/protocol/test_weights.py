"""Exact weight enumeration: against listing all code words where they are few, and against another calculation."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from benchmarks import weights
from miro_protocol.table import DOWNLINK, TELEMETRY, Format

FORMATS = pytest.mark.parametrize("form", [*DOWNLINK.values(), TELEMETRY], ids=lambda form: form.name)
TINY = Format("tiny", b"", b"\x2d\xd4", 0x13, 1, 2500)  # HDR, one byte of payload, CRC: 2^16 code words


def test_a_code_small_enough_to_list_has_the_weights_it_has():
    single = np.array(weights.syndromes(TINY), np.uint16)
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
    assert counted == weights.code_words(TINY)


def ones(numbers):
    bits = np.unpackbits(numbers.astype("<u4").view(np.uint8).reshape(-1, 4), axis=1)
    return bits.sum(axis=1, dtype=np.int64)  # NumPy 1.26 counts neither in uint64 nor converts it


def solve(basis):
    """Every XOR of the CRC bits' syndromes, with how many bits as a mask."""
    found = [(0, 0)]
    for place, syndrome in enumerate(basis):
        found += [(value ^ syndrome, bits | 1 << place) for value, bits in found]
    return found


@FORMATS
def test_no_one_to_four_wrong_bits_are_a_code_word_and_five_can_be(form):
    words = weights.code_words(form)
    assert words[:5] == [1, 0, 0, 0, 0]
    assert words[5] > 0
    assert sum(words) == 1 << weights.covered_bits(form) - 16


@FORMATS
def test_the_low_weights_are_what_listing_them_gives(form):
    """A word of five bits is a pair and a triple with the same syndrome."""
    single = np.array(weights.syndromes(form), np.uint16)
    pairs = np.zeros(1 << 16, np.int64)
    for first, second in combinations(range(len(single)), 2):
        pairs[single[first] ^ single[second]] += 1
    meet = 0
    for first, second in combinations(range(len(single)), 2):
        meet += int(pairs[single[first] ^ single[second] ^ single[second + 1 :]].sum())
    # Nothing lighter exists, so pair and triple have no bit in common, and a word splits in comb(5, 2) ways.
    assert meet == comb(5, 2) * weights.code_words(form)[5]


@pytest.mark.parametrize(
    ("form", "rate", "probability"),
    [(DOWNLINK[3], 1e-3, 2.8e-12), (DOWNLINK[3], 1e-4, 3.1e-17), (DOWNLINK[5], 1e-3, 2.3e-11)],
)
def test_the_probabilities_are_those_of_another_calculation(form, rate, probability):
    """By another program, from the weights of the dual code (MacWilliams identity), to two digits."""
    assert weights.undetected_probability(form, rate) == pytest.approx(probability, rel=0.03)
