"""dmath against mpmath, against its own uncompiled source, and at the edges of its domain."""

import math
import random

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact import dmath
from tests.exact.uncompiled import uncompiled

mpmath.mp.prec = 160
ANGLES = st.floats(-1.59e6, 1.59e6)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


SOURCE = uncompiled(dmath)


def angles(rng, count):
    yield from (rng.uniform(-7.0, 7.0) for _ in range(count))
    yield from (rng.uniform(-1.59e6, 1.59e6) for _ in range(count))
    yield from (rng.choice((-1, 1)) * 10.0 ** rng.uniform(-300, 6) for _ in range(count))
    yield from (rng.randint(-1_000_000, 1_000_000) * (math.pi / 2) for _ in range(count))


def any_scale(rng):
    return rng.choice((-1, 1)) * 10.0 ** rng.uniform(-290, 290)


def points(rng, count):
    yield from ((rng.gauss(0, 1), rng.gauss(0, 1)) for _ in range(2 * count))
    yield from ((any_scale(rng), any_scale(rng)) for _ in range(count))


def worst_ulp(function, exact, cases):
    worst = 0.0
    for case in cases:
        got = function(*case)
        true = exact(*(mpmath.mpf(number) for number in case))
        if true == 0:
            assert got == 0.0
        else:
            worst = max(worst, float(abs(mpmath.mpf(got) - true) / math.ulp(float(true))))
    return worst


def exponents(rng, count):
    yield from (rng.uniform(-745.13, 709.78) for _ in range(count))
    yield from (rng.uniform(-2, 2) for _ in range(count))


def positive(rng, count):
    yield from (10.0 ** rng.uniform(-320, 308) for _ in range(count))
    yield from (1.0 + rng.uniform(-1e-3, 1e-3) for _ in range(count))


@pytest.mark.parametrize(
    ("name", "draw", "bound"),
    [
        ("sin", angles, 0.8),
        ("cos", angles, 0.8),
        ("atan2", points, 1.0),
        ("exp", exponents, 0.9),
        ("log", positive, 0.9),
    ],
)
def test_functions_are_within_one_ulp_over_the_whole_domain(name, draw, bound):
    cases = [case if isinstance(case, tuple) else (case,) for case in draw(random.Random(1), 1500)]
    assert worst_ulp(getattr(dmath, name), getattr(mpmath, name), cases) < bound


@settings(max_examples=300)
@given(ANGLES)
def test_sine_is_odd_cosine_even_and_sincos_is_both(x):
    assert dmath.sin(-x) == -dmath.sin(x)
    assert dmath.cos(-x) == dmath.cos(x)
    assert dmath.sincos(x) == (dmath.sin(x), dmath.cos(x))


@settings(max_examples=300)
@given(ANGLES)
def test_wrap_pi_lands_in_the_half_open_turn_and_keeps_the_direction(x):
    wrapped = dmath.wrap_pi(x)
    assert -math.pi < wrapped <= math.pi
    assert abs(dmath.sin(wrapped) - dmath.sin(x)) < 1e-15
    assert abs(dmath.cos(wrapped) - dmath.cos(x)) < 1e-15
    assert dmath.wrap_pi(wrapped) == wrapped


def test_wrap_pi_sends_minus_pi_to_plus_pi_and_leaves_plus_pi():
    assert dmath.wrap_pi(math.pi) == math.pi
    assert dmath.wrap_pi(-math.pi) == math.pi
    assert abs(abs(dmath.wrap_pi(3 * math.pi)) - math.pi) < 1e-15


@settings(max_examples=300)
@given(FINITE, FINITE)
def test_atan2_is_odd_in_y_and_points_along_the_axes(y, x):
    assert dmath.atan2(-y, x) == -dmath.atan2(y, x)
    assert abs(dmath.atan2(y, x) - math.atan2(y, x)) <= 2 * math.ulp(math.atan2(y, x))


@pytest.mark.parametrize(("y", "x"), [(y, x) for y in (0.0, -0.0, 1.0, -1.0) for x in (0.0, -0.0, 1.0, -1.0)])
def test_atan2_at_axes_diagonals_and_signed_zeros_is_what_ieee_754_says(y, x):
    got = dmath.atan2(y, x)
    assert got == math.atan2(y, x)
    assert math.copysign(1.0, got) == math.copysign(1.0, math.atan2(y, x))


def test_values_that_are_exact_are_exact():
    assert dmath.sin(0.0) == 0.0
    assert dmath.cos(0.0) == 1.0
    assert dmath.exp(0.0) == 1.0
    assert dmath.log(1.0) == 0.0
    assert dmath.sin(math.pi / 2) == 1.0
    assert math.copysign(1.0, dmath.sin(-0.0)) == -1.0
    assert dmath.exp(-800.0) == 0.0


@pytest.mark.parametrize(
    ("name", "arguments"),
    [(name, (x,)) for name in ("sin", "cos", "sincos", "wrap_pi") for x in (math.nan, math.inf, -1.6e6)]
    + [("log", (x,)) for x in (0.0, -1.0, math.nan, math.inf)]
    + [("exp", (math.nan,)), ("atan", (math.nan,)), ("atan2", (math.nan, 1.0)), ("atan2", (1.0, math.inf))],
)
def test_arguments_outside_the_domain_are_refused(name, arguments):
    with pytest.raises(ValueError, match=r"NaN|must be within|needs"):
        getattr(dmath, name)(*arguments)


def test_exp_refuses_to_overflow():
    with pytest.raises(OverflowError, match="beyond float64"):
        dmath.exp(710.0)


def test_the_module_in_use_and_its_source_give_the_same_bits():
    rng = random.Random(5)
    for x in angles(rng, 1000):
        assert dmath.sincos(x) == SOURCE.sincos(x)
        assert dmath.wrap_pi(x) == SOURCE.wrap_pi(x)
    for y, x in points(rng, 1000):
        assert dmath.atan2(y, x) == SOURCE.atan2(y, x)
    for x in exponents(rng, 1500):
        assert dmath.exp(x) == SOURCE.exp(x)
    for x in positive(rng, 1500):
        assert dmath.log(x) == SOURCE.log(x)
