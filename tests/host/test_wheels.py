"""From (v, w) to int16: the split, the limit that keeps the curvature, the rounding."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.wheels import Wheels, nearest, wheel_command
from miro_protocol.table import VELOCITY_SATURATION

WHEELS = Wheels()
SPEEDS = st.floats(-20.0, 20.0)
TURNS = st.floats(-500.0, 500.0)
LIMIT = 16633


def test_the_greatest_command_is_the_robots_own_limit():
    assert wheel_command(WHEELS, 1.46, 0.0) == (LIMIT, LIMIT)
    assert LIMIT == VELOCITY_SATURATION
    assert wheel_command(WHEELS, -99.0, 0.0) == (-LIMIT, -LIMIT)
    assert WHEELS.units_per_m_s == pytest.approx(11392.75, abs=0.01)


def test_turning_left_slows_the_left_wheel():
    assert WHEELS.split(0.2, 1.0) == pytest.approx((0.166, 0.234))


@given(SPEEDS, TURNS)
def test_no_command_exceeds_the_limit(v, w):
    left, right = wheel_command(WHEELS, v, w)
    assert type(left) is type(right) is int
    assert max(abs(left), abs(right)) <= LIMIT


@given(SPEEDS, TURNS)
def test_the_limit_scales_both_wheels_by_one_factor(v, w):
    rims = WHEELS.split(v, w)
    factor = min(1.0, WHEELS.limit_m_s / max(*map(abs, rims), 1e-300))
    for units, rim in zip(wheel_command(WHEELS, v, w), rims, strict=True):
        assert abs(units - rim * factor * WHEELS.units_per_m_s) <= 0.5 + 1e-9


@pytest.mark.slow
@given(st.floats(-1.46, 1.46))
def test_a_command_is_the_nearest_quantum(speed):
    exact = Fraction(speed) * Fraction(WHEELS.units_per_m_s)
    assert abs(WHEELS.counts(speed) - exact) <= Fraction(1, 2) + Fraction(1, 10**9)


@given(SPEEDS, TURNS)
def test_backwards_and_the_other_way_round_are_mirror_images(v, w):
    left, right = wheel_command(WHEELS, v, w)
    assert wheel_command(WHEELS, -v, -w) == (-left, -right)
    assert wheel_command(WHEELS, v, -w) == (right, left)


@given(st.integers(-LIMIT, LIMIT))
def test_every_integer_is_its_own_quantum(count):
    assert WHEELS.counts(count / WHEELS.units_per_m_s) == count


@given(st.floats(-1e6, 1e6))
def test_rounding_is_to_the_nearest(x):
    assert abs(nearest(x) - Fraction(x)) <= Fraction(1, 2)


def test_halves_go_away_from_zero():
    assert [nearest(x) for x in (0.5, 1.5, 2.5, -0.5, -1.5, -0.0)] == [1, 2, 3, -1, -2, 0]
    assert nearest(0.49999999999999994) == 0  # where x + 0.5 rounds up to 1


@pytest.mark.parametrize("name", ["track_m", "radius_m", "limit_m_s"])
def test_wheels_name_what_is_wrong_with_them(name):
    with pytest.raises(ValueError, match=name):
        Wheels(**{name: 0.0})
    with pytest.raises(ValueError, match="int16"):
        Wheels(radius_m=0.010)


@given(SPEEDS, st.integers(5, 15))
def test_short_words_are_the_nearest_multiples_of_their_step_within_the_limit(speed, bits):
    short, step = Wheels(word_bits=bits), 1 << (16 - bits)
    units = short.counts(speed)
    assert units % step == 0
    assert abs(units) <= WHEELS.counts(WHEELS.limit_m_s)
    if abs(speed) * WHEELS.units_per_m_s + step < WHEELS.counts(WHEELS.limit_m_s):
        assert abs(units - speed * WHEELS.units_per_m_s) <= 0.5 * step * (1.0 + 1e-9)
    assert short.counts(-speed) == -units


def test_words_of_16_bits_are_those_of_the_frame_and_others_are_refused():
    assert Wheels(word_bits=16) == WHEELS
    for bits in (4, 17):
        with pytest.raises(ValueError, match="word_bits"):
            Wheels(word_bits=bits)
