"""The chattering index: what it counts, and what it does not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.recording.chattering import Chattering
from tests.naive import theory_terms as naive

WHEEL = st.integers(-16633, 16633)
PERIOD_S = naive.PERIOD_S


def after(commands):
    chattering = Chattering()
    for left, right in commands:
        chattering.add(left, right)
    return chattering


def index(commands):
    return after(commands).index(PERIOD_S)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_the_effort_is_the_mean_size_of_the_commanded_acceleration_of_a_wheel(commands):
    found = after(commands)
    assert found.effort(PERIOD_S) == pytest.approx(naive.effort(commands), rel=1e-9, abs=1e-12)
    assert found.effort(PERIOD_S) >= found.index(PERIOD_S)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_it_is_the_variation_less_the_net_motion_of_each_window(commands):
    assert index(commands) == pytest.approx(naive.chattering(commands), rel=1e-9, abs=1e-12)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_speeds_that_only_rise_do_not_chatter(commands):
    left, right = (sorted(wheel) for wheel in zip(*commands, strict=True))
    assert index(zip(left, right, strict=True)) == 0.0


def test_a_swing_of_one_wheel_at_every_frame_counts_both_ways():
    """1139 units are 0.1 m/s. One wheel that changes by so much in every frame makes 3 m/s2, half of it a wheel."""
    commands = [(1139 * (k % 2), 0) for k in range(301)]
    assert index(commands) == pytest.approx(0.5 * 0.1 / PERIOD_S, rel=1e-3)


def test_a_slow_movement_there_and_back_counts_hardly():
    """1 m/s up in a second and down in a second: at most one window holds the turn."""
    slow = [(380 * min(k, 60 - k), 0) for k in range(61)]
    assert index(slow) == 0.0
    assert index(slow[5:]) < 0.2 * naive.chattering([(22800 * (k % 2), 0) for k in range(3)])


def test_one_command_says_nothing():
    assert index([]) is None
    assert index([(1, 1)]) is None
    assert after([(1, 1)]).effort(PERIOD_S) is None
    assert index([(1, 1), (1, 1)]) == 0.0
