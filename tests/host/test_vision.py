"""The measurement's bounds, its grid and its delay."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.dmath import wrap_pi
from miro_exact.domain import DomainError
from miro_exact.rng import Stream
from miro_host.posture import Posture
from miro_host.vision import Vision, VisionErrors, measure, to_grid

ERRORS = VisionErrors()
POSTURES = st.builds(Posture, st.floats(-0.2, 1.3), st.floats(-0.2, 0.9), st.floats(-50.0, 50.0))
NORMALS = st.tuples(*[st.floats(-9.0, 9.0)] * 3)
NO_ERRORS = VisionErrors(position_m=0.0, heading_rad=0.0, pixel_m=0.0)
NOISE = Stream(1997, "camera")


@given(POSTURES, NORMALS)
def test_a_measurement_is_off_by_at_most_the_bound_and_half_a_pixel(true, normals):
    seen = measure(true, normals, ERRORS)
    allowed = 0.0240 + 0.004375 / 2 + 1e-12
    assert abs(seen.x_m - true.x_m) <= allowed
    assert abs(seen.y_m - true.y_m) <= allowed
    assert abs(wrap_pi(seen.theta_rad - true.theta_rad)) <= math.radians(4.83) + 1e-9
    assert -math.pi < seen.theta_rad <= math.pi


@given(POSTURES, NORMALS)
def test_positions_lie_on_the_pixel_grid(true, normals):
    seen = measure(true, normals, ERRORS)
    for x in (seen.x_m, seen.y_m):
        assert x == to_grid(x, ERRORS.pixel_m)
        assert x / ERRORS.pixel_m == pytest.approx(round(x / ERRORS.pixel_m), abs=1e-9)


@given(POSTURES, NORMALS)
def test_without_errors_the_measurement_is_the_posture(true, normals):
    assert measure(true, normals, NO_ERRORS) == Posture(true.x_m, true.y_m, wrap_pi(true.theta_rad))


def test_three_sigma_is_the_bound_and_one_sigma_a_third_of_it():
    only_noise = VisionErrors(pixel_m=0.0)
    seen = measure(Posture(0.0, 0.0, 0.0), (1.0, -3.0, 0.5), only_noise)
    assert (seen.x_m, seen.y_m) == pytest.approx((0.008, -0.024))
    assert math.degrees(seen.theta_rad) == pytest.approx(0.805)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_frame_arrives_so_many_frames_later(delay):
    vision = Vision(NO_ERRORS, delay)
    seen = [vision.expose((float(k), 0.0, 0.0), NOISE, k) for k in range(6)]
    assert [p and p.x_m for p in seen] == [None] * delay + [float(k) for k in range(6 - delay)]


@pytest.mark.parametrize("name", ["position_m", "heading_rad", "pixel_m"])
def test_errors_name_what_is_wrong_with_them(name):
    with pytest.raises(ValueError, match=name):
        VisionErrors(**{name: -1e-3})
    with pytest.raises(ValueError, match="delay_frames"):
        Vision(ERRORS, -1)


@given(POSTURES, st.integers(0, 10**6))
def test_an_exposure_is_measured_with_the_three_draws_of_its_number(true, number):
    draws = tuple(NOISE.gauss(3 * number + axis) for axis in range(3))
    seen = Vision(ERRORS, 0).expose((true.x_m, true.y_m, true.theta_rad), NOISE, number)
    assert seen == measure(true, draws, ERRORS)


@pytest.mark.parametrize("x", [math.inf, -math.inf, math.nan])
def test_what_is_nowhere_is_on_no_grid(x):
    with pytest.raises(DomainError, match="beyond any grid"):
        to_grid(x, 0.004375)
