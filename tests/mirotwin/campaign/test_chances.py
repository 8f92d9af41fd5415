"""What clean runs prove, and how many a fix needs, beside Clopper and Pearson's exact interval."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.interval import clopper_pearson
from mirotwin.campaign.chances import clean_line, highest_rate, needed_runs, wilson


@pytest.mark.parametrize("clean", [1, 2, 3, 10, 59, 60, 299, 300, 5000])
def test_the_rate_that_clean_runs_leave_is_the_exact_bound(clean):
    exact = clopper_pearson(0, clean, confidence=0.90)[1]  # 95 % on one side
    assert highest_rate(clean) == pytest.approx(exact, rel=1e-9)
    assert highest_rate(clean) == pytest.approx(1 - 0.05 ** (1 / clean), rel=1e-9)


def test_it_is_near_the_rule_of_three():
    assert highest_rate(1000) == pytest.approx(3 / 1000, rel=0.01)


@given(st.integers(1, 400).flatmap(lambda runs: st.tuples(st.integers(1, runs), st.just(runs))))
def test_a_fix_needs_the_fewest_clean_runs_whose_bound_is_not_above_the_old_rate(was):
    failed, runs = was
    needed = needed_runs(failed, runs)
    assert highest_rate(needed) <= failed / runs * (1 + 1e-9)
    assert needed == 1 or highest_rate(needed - 1) > failed / runs


@pytest.mark.parametrize(
    ("was", "needed"),
    [((1, 1), 1), ((19, 20), 1), ((1, 2), 5), ((9, 200), 66), ((2, 50), 74), ((1, 1000), 2995)],
)
def test_examples(was, needed):
    assert needed_runs(*was) == needed


def test_the_line_says_both():
    assert clean_line(100) == "100 clean seeds: failure rate below 3 % at 95 %"
    text = "100 clean seeds: failure rate below 3 % at 95 %; at the old rate of 2/50 a fix needs 74: fixed"
    assert clean_line(100, (2, 50)) == text
    assert clean_line(60, (2, 50)).endswith("a fix needs 74: not proven: 14 more")


@pytest.mark.parametrize(("count", "trials"), [(0, 60), (4, 60), (30, 60), (60, 60)])
def test_wilsons_interval_is_near_the_exact_one_and_within_0_to_1(count, trials):
    low, high = wilson(count, trials)
    assert -1e-12 <= low <= count / trials <= high + 1e-12 <= 1.0 + 1e-11
    assert (low, high) == pytest.approx(clopper_pearson(count, trials), abs=0.03)
    assert math.isfinite(low + high)
