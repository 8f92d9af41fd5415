"""Paths and ramps beside Cartesian formulas in 40 digits, wherever they begin, and their ends."""

import math

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from miro_host.references.arc import Arc, ArcRef, LineRef, StraightLine
from miro_host.references.interface import Paced, with_polar_form
from miro_host.references.ramp import Ramp
from miro_host.references.sine import Sine, SineRef
from tests.naive import host_control, host_paths


def numbers(r):
    """All numbers of a reference, in the order of the twins."""
    return (
        *(r.posture.x_m, r.posture.y_m, r.posture.theta_rad, r.v_m_s, r.w_rad_s, r.v_dot_m_s2),
        *(r.w_dot_rad_s2, r.rho_m, r.phi_rad, r.rho_rate_m_s, r.phi_rate_rad_s, r.rho_accel_m_s2),
    )


def is_plain(r):
    """Whether the polar angle has one value: not at the origin, and not where pi is -pi as well."""
    return r.rho_m > AWAY_M and abs(math.remainder(r.phi_rad - math.pi, 2.0 * math.pi)) > 1e-6


ANGLES = st.floats(-3.1, 3.1)
PLACES = st.floats(-1.0, 1.0)
TIMES = st.floats(0.01, 5.9)
SHAPES = st.sampled_from([StraightLine, Arc, Sine])
AWAY_M = 0.01


@given(SHAPES, TIMES, ANGLES, PLACES, PLACES)
def test_a_path_that_begins_elsewhere_is_the_same_path_moved_there(shape, t, heading, x, y):
    here, there = shape(heading_rad=heading), shape(heading_rad=heading, start_x_m=x, start_y_m=y)
    a, b = here.at(t), there.at(t)
    assert (b.posture.x_m - x, b.posture.y_m - y) == pytest.approx((a.posture.x_m, a.posture.y_m), abs=1e-15)
    assert b.posture.theta_rad == a.posture.theta_rad
    assert numbers(b)[3:7] == numbers(a)[3:7]


@settings(max_examples=80)
@given(
    *(TIMES, ANGLES, st.floats(-2.5, 2.5), st.floats(0.05, 0.4), st.floats(0.1, 1.0)),
    *[st.just(0.0) | PLACES] * 2,
)
def test_an_arc_and_all_its_derivatives_equal_the_cartesian_path(t, heading, curvature, speed, ramp, x, y):
    assume(abs(t - ramp) > 1e-3)
    assume(abs(curvature) > 1e-3)  # below, the twin's differences cancel
    found = Arc(Ramp(speed, ramp), heading, curvature, x, y).at(t)
    assume(is_plain(found))

    def point(time):
        px, py, theta = host_control.arc_point(
            host_control.path_length(time, speed, ramp), heading, curvature
        )
        return px + x, py + y, theta

    expected = [float(value) for value in host_paths.reference(point, t)]
    assert numbers(found) == pytest.approx(expected, rel=1e-8, abs=1e-9)


@given(st.floats(1e-3, 5.9), ANGLES, st.floats(-1.0, 1.0))
def test_out_of_the_origin_the_closed_form_and_the_general_one_are_the_same(t, heading, curvature):
    for path in (StraightLine(heading_rad=heading), Arc(heading_rad=heading, curvature_per_m=curvature)):
        r = path.at(t)
        general = with_polar_form(r.posture, r.v_m_s, r.w_rad_s, r.v_dot_m_s2, r.w_dot_rad_s2)
        assert numbers(general)[:-5] == numbers(r)[:-5]
        apart = math.remainder(general.phi_rad - r.phi_rad, 2.0 * math.pi)
        assert abs(apart) < 1e-9
        assert general.rho_m == pytest.approx(r.rho_m, abs=1e-12)
        assert numbers(general)[-3:] == pytest.approx(numbers(r)[-3:], rel=1e-7, abs=1e-9)


def test_a_sine_leaves_the_origin_as_its_limit_says():
    at_rest, soon = Sine().at(0.0), Sine().at(1e-4)
    assert (at_rest.rho_m, at_rest.phi_rad) == (0.0, at_rest.posture.theta_rad)
    assert at_rest.rho_accel_m_s2 == at_rest.v_dot_m_s2
    assert soon.phi_rad == pytest.approx(at_rest.phi_rad, abs=1e-6)
    assert soon.rho_accel_m_s2 == pytest.approx(at_rest.rho_accel_m_s2, abs=1e-5)


def test_an_arc_may_go_round_and_round():
    circle = Arc(Ramp(duration_s=60.0), 0.0, 4.0, 0.55, 0.10)
    turn_s = 2.0 * math.pi / 4.0 / 0.2
    for t in (1.0, 3.3, 7.0):
        first, third = circle.at(t), circle.at(t + 2.0 * turn_s)
        assert numbers(third) == pytest.approx(numbers(first), abs=1e-12)
    out_of_origin = Arc(Ramp(duration_s=60.0), 0.0, 4.0)
    assert numbers(out_of_origin.at(3.3 + turn_s)) == pytest.approx(numbers(out_of_origin.at(3.3)), abs=1e-12)
    assert out_of_origin.at(3.3 + turn_s).rho_m > 0.0


@example(1.0, 0.25, 0.5, -0.0, 1.0, -0.0, -1.0, -0.0)
@settings(max_examples=60)
@given(
    *(TIMES, st.floats(0.05, 0.4), st.floats(0.1, 1.0), st.floats(-0.2, 0.2), st.floats(0.2, 1.5)),
    *(ANGLES, PLACES, PLACES),
)
def test_a_sine_and_all_its_derivatives_equal_the_cartesian_path(
    t, speed, ramp, height, length, heading, x, y
):
    assume(abs(t - ramp) > 1e-3)
    found = Sine(Ramp(speed, ramp), height, length, heading, x, y).at(t)
    assume(is_plain(found))
    expected = host_paths.reference(
        lambda time: host_paths.sine(time, speed, ramp, height, length, heading, (x, y)), t
    )
    assert numbers(found) == pytest.approx([float(one) for one in expected], rel=1e-7, abs=1e-8)


@given(
    SHAPES, st.floats(0.05, 0.4), st.floats(0.1, 1.0), st.floats(0.001, 0.02), st.floats(0.005, 0.1), ANGLES
)
def test_within_one_step_of_its_pace_a_path_goes_and_turns_no_further_than_asked(
    shape, speed, ramp, step_m, step_rad, heading
):
    path = shape(Ramp(speed, ramp), heading_rad=heading)
    assert isinstance(path, Paced)
    pace = path.pace(step_m, step_rad)
    assert pace.steady_s <= pace.until_s <= 6.0
    k = 0
    while k * pace.step_s < 6.0 and k < 200:
        a, b = path.at(k * pace.step_s).posture, path.at((k + 1) * pace.step_s).posture
        assert math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) <= step_m * (1.0 + 1e-9)
        assert abs(math.remainder(b.theta_rad - a.theta_rad, 2.0 * math.pi)) <= step_rad * (1.0 + 1e-9)
        k += 1


def test_keys_are_in_centimetres_and_degrees():
    line = LineRef(start_x_cm=20.0, start_y_cm=-5.0).trajectory(6.0)
    arc = ArcRef(start_x_cm=20.0, start_y_cm=-5.0).trajectory(6.0)
    sine = SineRef(start_x_cm=20.0, start_y_cm=-5.0, amplitude_cm=12.0, wavelength_cm=80.0).trajectory(6.0)
    for path in (line, arc, sine):
        at = path.at(0.0).posture
        assert (at.x_m, at.y_m) == (0.2, -0.05)
    assert (sine.amplitude_m, sine.wavelength_m) == (0.12, 0.8)
    assert SineRef(drive_s=2.0).trajectory(6.0).at(3.0).v_m_s == 0.0


@settings(max_examples=30)
@given(st.floats(0.01, 6.0), ANGLES)
def test_a_line_and_all_its_derivatives_equal_the_cartesian_path(t, heading):
    assume(abs(t - 0.5) > 1e-3)
    expected = [float(x) for x in host_control.reference(t, 0.2, 0.5, heading, 0)]
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
