"""The time base: exact periods and exact conversions."""

from decimal import ROUND_FLOOR, Decimal, localcontext
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import clock


def test_the_periods_agree_with_the_frequencies_they_stand_for():
    second = clock.TICKS_PER_SECOND
    assert second / clock.CYCLE_TICKS == 2_000_000
    assert second / clock.LM629_CLOCK_TICKS == 6_000_000
    assert clock.LM629_SAMPLE_TICKS == 2048 * clock.LM629_CLOCK_TICKS
    assert clock.PWM_PERIOD_TICKS == 512 * clock.LM629_CLOCK_TICKS
    assert second / clock.HOST_BIT_TICKS == 9600
    assert clock.ROBOT_BIT_TICKS == 78 * 16 * 2
    assert Fraction(second, clock.CAMERA_FRAME_TICKS) == Fraction(30000, 1001)


@pytest.mark.parametrize(
    ("seconds", "ticks"),
    [
        (0.001, 24_000),
        (0.003, 72_000),
        (1, 24_000_000),
        (Fraction(1001, 30000), 800_800),
        (Fraction(1, 48_000_000), 1),  # half a tick goes up
        (Fraction(-1, 48_000_000), 0),
        (1e-9, 0),
    ],
)
def test_seconds_become_ticks_exactly_and_halves_go_up(seconds, ticks):
    assert clock.ticks(seconds) == ticks


@given(st.floats(min_value=-1e6, max_value=1e6))
def test_a_float_means_the_decimal_it_prints_as(seconds):
    with localcontext() as context:
        context.prec = 1100
        half_up = (Decimal(repr(seconds)) * 24_000_000 + Decimal("0.5")).to_integral_value(ROUND_FLOOR)
    assert clock.ticks(seconds) == int(half_up)


@given(st.integers(0, 1 << 50))
def test_ticks_survive_the_way_through_seconds_while_a_float_can_hold_them(tick):
    assert clock.ticks(clock.seconds(tick)) == tick


@pytest.mark.parametrize("seconds", [float("nan"), float("inf")])
def test_no_tick_stands_for_a_time_that_is_not_finite(seconds):
    with pytest.raises(ValueError, match="Fraction"):
        clock.ticks(seconds)


def test_nanoseconds_are_whole_and_rounded_down():
    assert [clock.nanoseconds(tick) for tick in (0, 1, 2, 3, 24_000_000)] == [0, 41, 83, 125, 10**9]


@given(st.integers(-(10**12), 10**12))
def test_whole_milliseconds_and_microseconds_are_exact(time):
    assert clock.ms(time) == 24_000 * time
    assert clock.us(time) == 24 * time


def test_a_part_of_a_microsecond_is_rounded_as_seconds_are():
    assert clock.us(0.1) == clock.ticks(1e-7) == 2
    assert clock.ms(0.3) == 7200
    assert clock.ms(Fraction(1, 48_000)) == 1
