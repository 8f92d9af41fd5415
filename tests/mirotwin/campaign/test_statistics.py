"""Quantiles, bootstrap intervals and paired differences: those of their definitions, digit for digit."""

import itertools

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.intervals import coverage
from mirotwin.campaign.comparison import MetricDifference
from mirotwin.campaign.statistics import (
    FEWEST,
    Interval,
    draws,
    figures,
    mean,
    quantile,
    rank_interval,
    sign_test,
    student,
)
from tests.naive import bootstrap

NUMBERS = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=12)


@given(NUMBERS, st.floats(0.0, 1.0))
def test_a_quantile_and_a_mean_are_those_of_the_plain_loops(numbers, share):
    array = np.array(numbers)
    assert quantile(np.sort(array), share) == bootstrap.quantile(numbers, share)
    assert mean(array) == bootstrap.mean(numbers)


@settings(max_examples=5)
@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.integers(0, 12)), min_size=8, max_size=30))
def test_intervals_are_those_of_the_plain_loops(rows):
    numbers, seeds = [one for one, _ in rows], [seed for _, seed in rows]
    count = len(set(seeds))
    found = figures(np.array(numbers), np.array(seeds))
    assert (found.count, found.seeds) == (len(numbers), count)
    assert (found.quantiles["0"], found.quantiles["1"]) == (min(numbers), max(numbers))
    if count < FEWEST:
        assert found.mean_interval is None
        assert found.median_interval is None
        return
    low, high = bootstrap.mean_interval(numbers, seeds, student(count - 1))
    assert found.mean_interval == Interval(low, high)
    low, high = bootstrap.median_interval(numbers, seeds, student(count - 1))
    spread = max(numbers) - min(numbers)
    assert found.median_interval.low == pytest.approx(low, abs=1e-4 * spread)
    assert found.median_interval.high == pytest.approx(high, abs=1e-4 * spread)


@pytest.mark.parametrize("freedom", [*range(FEWEST - 1, 61), 80, 120, 500, 10_000])
def test_students_t_is_that_of_the_distribution(freedom):
    half = mpmath.mpf(freedom) / 2
    t = mpmath.mpf(student(freedom))
    above = mpmath.betainc(half, 0.5, 0, freedom / (freedom + t * t), regularized=True) / 2
    slope = mpmath.beta(half, 0.5) ** -1 / mpmath.sqrt(freedom) * (1 + t * t / freedom) ** (-half - 0.5)
    assert abs(above - 0.025) / slope < 5e-5


def test_runs_of_one_seed_count_as_one_sample():
    draw = np.random.Generator(np.random.Philox(key=3))
    numbers, seeds = draw.normal(size=20), np.arange(20)
    alone = figures(numbers, seeds)
    five_times = figures(np.repeat(numbers, 5), np.repeat(seeds, 5))
    assert five_times.median_interval == alone.median_interval
    assert five_times.mean_interval.low == pytest.approx(alone.mean_interval.low, abs=1e-12)
    assert five_times.mean_interval.high == pytest.approx(alone.mean_interval.high, abs=1e-12)


def test_of_no_numbers_there_are_no_figures():
    assert figures(np.array([]), np.array([], dtype=np.int64)) is None


def test_draws_are_the_same_each_time_and_reach_every_place():
    first, second = np.concatenate(list(draws(7))), np.concatenate(list(draws(7)))
    assert (first == second).all()
    shares = np.bincount(first, minlength=7) / len(first)
    assert len(shares) == 7
    assert abs(shares - 1 / 7).max() < 0.01


def test_intervals_hold_what_they_should_where_scenarios_of_a_seed_are_correlated():
    found = coverage(samples=20, correlation=0.95, trials=1000)
    assert 0.93 <= found.mean <= 0.97
    assert found.by_pairs < 0.7


def test_where_a_few_runs_are_lost_the_interval_of_the_median_holds_and_that_of_the_mean_does_not():
    found = coverage(samples=50, scenarios=1, correlation=0.0, trials=60, kind="runaway", medians=True)
    assert found.mean < 0.8
    assert found.median > 0.88


@given(st.integers(0, 6), st.integers(0, 6))
def test_the_sign_test_counts_all_ways_in_which_the_signs_may_fall(lower, higher):
    count, split = lower + higher, abs(lower - higher)
    ways = list(itertools.product((-1, 1), repeat=count))
    as_uneven = [way for way in ways if abs(sum(way)) >= split]
    assert sign_test(lower, higher) == pytest.approx(len(as_uneven) / len(ways))


NONZERO = st.floats(-10.0, 10.0).filter(lambda number: number != 0.0)


@given(st.lists(NONZERO, min_size=1, max_size=60), st.sampled_from([0.9, 0.95, 0.999]))
def test_zero_is_outside_of_the_interval_of_the_median_where_the_sign_test_says_so(numbers, confidence):
    interval = rank_interval(np.array(numbers), confidence)
    lower = len([number for number in numbers if number < 0.0])
    decided = sign_test(lower, len(numbers) - lower) <= 1.0 - confidence
    assert decided == (interval is not None and not interval.low <= 0.0 <= interval.high)
    if interval is not None:
        assert interval.low <= quantile(np.sort(numbers), 0.5) <= interval.high


def test_the_interval_of_the_median_of_fifty_numbers_is_from_the_eighteenth_to_the_thirty_third():
    """As in tables of the binomial: P(B < 18) = 0.0164 for B of 50, P(B < 19) = 0.0325."""
    assert rank_interval(np.arange(1.0, 51.0)) == Interval(18.0, 33.0)
    assert rank_interval(np.arange(5.0)) is None


def of(metric="rms_position_cm", first=2.0, low=0.1, high=0.3, **more):
    interval = None if low is None else Interval(low, high)
    values = {"higher": 10, "lower": 2, **more}
    return MetricDifference(metric, 20, 0, 20, first, first + 0.2, 0.2, interval, 0.2, **values)


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
