"""Quantiles, bootstrap intervals and paired differences: those of their definitions, digit for digit."""

import statistics

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.naive import bootstrap

from miro_exact.rng import Stream
from mirotwin.campaign.comparison import Difference
from mirotwin.campaign.statistics import (
    STREAM,
    Interval,
    _words,
    draws,
    figures,
    mean,
    mean_interval,
    quantile,
)

NUMBERS = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=12)


@given(NUMBERS, st.floats(0.0, 1.0))
def test_a_quantile_and_a_mean_are_those_of_the_plain_loops(numbers, share):
    array = np.array(numbers)
    assert quantile(np.sort(array), share) == bootstrap.quantile(numbers, share)
    assert mean(array) == bootstrap.mean(numbers)


@settings(max_examples=5, deadline=None)
@given(NUMBERS)
def test_intervals_are_those_of_the_plain_loops(numbers):
    found = figures(np.array(numbers))
    low, high = bootstrap.interval(numbers, bootstrap.mean)
    assert found.mean_interval == Interval(low, high) == mean_interval(np.array(numbers))
    low, high = bootstrap.interval(numbers, lambda drawn: bootstrap.quantile(drawn, 0.5))
    assert found.median_interval == Interval(low, high)
    assert (found.count, found.quantiles["0"], found.quantiles["1"]) == (
        len(numbers),
        min(numbers),
        max(numbers),
    )


def test_the_median_is_that_of_the_standard_library():
    numbers = [3.0, 1.0, 4.0, 1.5, 9.0, 2.5]
    assert figures(np.array(numbers)).median == statistics.median(numbers)


def test_of_no_numbers_there_are_no_figures():
    assert figures(np.array([])) is None


@given(st.integers(0, 10**12), st.integers(1, 40))
def test_words_are_those_of_the_stream(first, count):
    stream = Stream(0, STREAM)
    assert _words(first, count).tolist() == [stream.u32(first + at) for at in range(count)]


def test_draws_are_the_same_each_time_and_reach_every_place():
    first, second = np.concatenate(list(draws(7))), np.concatenate(list(draws(7)))
    assert (first == second).all()
    shares = np.bincount(first, minlength=7) / len(first)
    assert len(shares) == 7
    assert abs(shares - 1 / 7).max() < 0.01


def test_an_interval_holds_the_mean_of_what_the_numbers_come_from_in_95_of_100_cases():
    source = np.random.Philox(key=1)
    held = 0
    for _ in range(100):
        numbers = np.array([float(word >> np.uint64(11)) / 2.0**53 for word in source.random_raw(60)])
        found = mean_interval(numbers)
        held += found.low <= 0.5 <= found.high
    assert 88 <= held <= 100


def of(metric="rms_position_cm", first=2.0, low=0.1, high=0.3, **more):
    interval = None if low is None else Interval(low, high)
    values = {"higher": 10, "lower": 2, **more}
    return Difference(metric, 20, first, first + 0.2, 0.2, interval, 0.2, **values)


@pytest.mark.parametrize(
    ("found", "tolerance", "worse"),
    [
        (of(), 0.0, True),
        (of(low=-0.1), 0.0, False),
        (of(low=0.0), 0.0, False),
        (of(), 0.04, True),
        (of(), 0.06, False),
        (of(low=-0.3, high=-0.1), 0.0, False),
        (of("frames_accepted", low=-0.3, high=-0.1), 0.0, True),
        (of("frames_accepted"), 0.0, False),
        (of(low=None), 0.0, False),
        (of("fault", low=0.0, higher=1, lower=0), 0.5, True),
        (of("error", low=0.0, higher=1, lower=1), 0.0, False),
    ],
)
def test_worse_is_what_lies_on_the_bad_side_with_its_whole_interval(found, tolerance, worse):
    assert found.worse(tolerance) == worse
