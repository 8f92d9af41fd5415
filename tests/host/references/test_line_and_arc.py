"""Reference trajectories against Cartesian formulas in 40 digits, and their ends."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_host.references.arc import Arc
from miro_host.references.line import StraightLine
from miro_host.references.ramp import Ramp
from tests.host.references.numbers import numbers
from tests.naive import host_control as naive

ANGLES = st.floats(-3.1, 3.1)


@settings(max_examples=60)
@given(st.floats(0.01, 6.0), ANGLES, st.floats(-2.5, 2.5), st.floats(0.05, 0.4), st.floats(0.1, 1.0))
def test_an_arc_and_all_its_derivatives_equal_the_cartesian_path(t, heading, curvature, speed, ramp):
    assume(abs(t - ramp) > 1e-3)
    assume(abs(curvature) > 1e-3)  # below, the twin's differences cancel
    path = Arc(Ramp(speed, ramp), heading, curvature)
    assert numbers(path.at(t)) == pytest.approx(
        [float(x) for x in naive.reference(t, speed, ramp, heading, curvature)], rel=1e-9, abs=1e-11
    )


@settings(max_examples=30)
@given(st.floats(0.01, 6.0), ANGLES)
def test_a_line_and_all_its_derivatives_equal_the_cartesian_path(t, heading):
    assume(abs(t - 0.5) > 1e-3)
    expected = [float(x) for x in naive.reference(t, 0.2, 0.5, heading, 0)]
    assert numbers(StraightLine(heading_rad=heading).at(t)) == pytest.approx(expected, rel=1e-9, abs=1e-11)


def test_an_arc_without_curvature_is_a_line():
    assert numbers(Arc(heading_rad=0.3, curvature_per_m=0.0).at(2.0)) == pytest.approx(
        numbers(StraightLine(heading_rad=0.3).at(2.0)), rel=1e-15, abs=1e-16
    )


def test_the_polar_form_has_its_limit_values_in_the_origin():
    start = Arc().at(0.0)
    assert (start.rho_m, start.phi_rad, start.phi_rate_rad_s) == (0.0, math.radians(60.0), 0.0)
    assert (start.v_dot_m_s2, start.w_dot_rad_s2, start.rho_accel_m_s2) == (0.4, -0.4, 0.4)


def test_the_arc_of_the_curve_scenario_ends_where_it_should():
    end = Arc().at(6.0).posture
    assert (end.x_m, end.y_m, math.degrees(end.theta_rad)) == pytest.approx((0.969, 0.495, -5.9), abs=0.02)


@pytest.mark.parametrize("path", [StraightLine(), Arc()], ids=["line", "arc"])
@pytest.mark.parametrize(("t", "same_place_as"), [(-1e-9, 0.0), (-5.0, 0.0), (6.0 + 1e-9, 6.0), (60.0, 6.0)])
def test_outside_its_time_the_reference_stands_still_at_its_end(path, t, same_place_as):
    r = path.at(t)
    assert r.posture == path.at(same_place_as).posture
    assert (r.v_m_s, r.w_rad_s, r.v_dot_m_s2, r.w_dot_rad_s2) == (0.0, 0.0, 0.0, 0.0)
    assert (r.rho_rate_m_s, r.phi_rate_rad_s, r.rho_accel_m_s2) == (0.0, 0.0, 0.0)


def test_the_speed_is_steady_from_the_end_of_the_ramp_on():
    assert Ramp().at(0.5) == (0.05, 0.2, 0.0)
    assert Ramp().at(6.0) == pytest.approx((1.15, 0.2, 0.0))
    assert Ramp(ramp_s=0.0).at(0.0) == (0.0, 0.2, 0.0)


PROFILES = st.builds(
    Ramp, st.floats(0.05, 0.4), st.floats(0.1, 1.0), st.floats(0.05, 6.0), ramp_down=st.just(True)
)


@given(PROFILES, st.floats(0.0, 1.0))
def test_a_ramp_down_is_the_ramp_up_run_backwards(ramp, part):
    t = part * ramp.duration_s
    s, v, _ = ramp.at(t)
    rest, left, _ = ramp.at(ramp.duration_s - t)
    assert v == pytest.approx(left, abs=1e-12)
    assert s + rest == pytest.approx(ramp.at(ramp.duration_s)[0], abs=1e-12)
    assert ramp.at(ramp.duration_s)[1] == pytest.approx(0.0, abs=1e-12)


@given(PROFILES, st.floats(0.01, 0.99))
def test_speed_and_acceleration_of_a_ramp_down_are_the_derivatives_of_its_length(ramp, part):
    t, h = part * ramp.duration_s, 1e-6
    corners = (ramp.ramp_s, ramp.duration_s - ramp.ramp_s, 0.5 * ramp.duration_s)
    assume(all(abs(t - corner) > 2 * h for corner in corners))
    before, (_, v, a), after = ramp.at(t - h), ramp.at(t), ramp.at(t + h)
    assert (after[0] - before[0]) / (2 * h) == pytest.approx(v, abs=1e-8)
    assert (after[1] - before[1]) / (2 * h) == pytest.approx(a, abs=1e-8)


def test_a_path_with_a_ramp_down_is_the_same_path_without_until_it_slows_down():
    for path in (StraightLine, Arc):
        stopping = path(Ramp(duration_s=4.0, ramp_down=True))
        assert stopping.at(3.5) == path().at(3.5)
        end = stopping.at(60.0)
        assert (end.v_m_s, end.v_dot_m_s2) == (0.0, 0.0)
        assert stopping.ramp.at(60.0)[0] == pytest.approx(0.2 * 3.5)
    assert Ramp(duration_s=0.0, ramp_down=True).at(1.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["speed_m_s", "ramp_s", "duration_s"])
@pytest.mark.parametrize("value", [-0.1, math.nan])
def test_a_ramp_names_what_is_wrong_with_it(name, value):
    with pytest.raises(ValueError, match=name):
        Ramp(**{name: value})
