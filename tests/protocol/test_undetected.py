"""What gets past the checks: experiments of a size for every test run beside what must come out.

`python -m benchmarks.undetected` is the same at full size; protocol/README.md has its figures.
"""

from itertools import combinations

import numpy as np
import pytest

from benchmarks.interval import clopper_pearson
from benchmarks.line import decode_lines, line_bits, random_frames, receive
from benchmarks.undetected import crc_only, noise, on_the_line
from benchmarks.weights import undetected_probability
from miro_protocol.table import DOWNLINK, TELEMETRY

FORMATS = (*DOWNLINK.values(), TELEMETRY)
BY_FORMAT = pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
IDLE_BITS = 20


def draws(seed):
    return np.random.Generator(np.random.Philox(seed))


def verdict_of(form, patterns, seed=3):
    """Frames as sent and others, when each column of `patterns` is turned over on a line of its own."""
    frames = random_frames(draws(seed), form, patterns.shape[1])
    idle = np.ones((IDLE_BITS, patterns.shape[1]), np.uint8)
    bits = np.concatenate([idle, line_bits(frames.wire) ^ patterns, idle])
    return decode_lines(form, receive(bits), len(bits), frames.body)


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
