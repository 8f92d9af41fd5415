"""The body: geometry of turns, coupling, friction that holds and never drives."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_sim.plant.chassis import Body
from miro_sim.plant.params import Chassis, DriveParams, Motor
from tests.sim.plant.runs import kinetic_energy_j
from tests.states import snapshot

SMOOTH = DriveParams(motor=Motor(friction_nm=0.0), chassis=Chassis(rolling_resistance=0.0))
ROUGH = DriveParams(chassis=Chassis(left_radius_factor=0.985, right_radius_factor=1.015))
SPEEDS = st.floats(-900.0, 900.0)
SLOW = st.floats(-0.5, 0.5)
IMPULSES = st.floats(-1e-6, 1e-6)


def body(params, left=0.0, right=0.0):
    made = Body(params, 0.0, 0.0, 0.0)
    made.left_rad_s = left
    made.right_rad_s = right
    return made


def test_unequal_speeds_go_round_a_circle_of_the_right_radius_and_close_it():
    one = body(SMOOTH, 200.0, 300.0)
    v, w = one.velocity()
    assert v == pytest.approx(0.020 / 8 * 250.0)
    assert w == pytest.approx(0.020 / 8 * 100.0 / 0.068)
    radius = v / w
    while one.theta_rad < 2 * math.pi - w * 2048 / 24e6:
        one.push(0.0, 0.0, 2048)
        assert math.hypot(one.x_m, one.y_m - radius) == pytest.approx(radius, abs=1e-12)
    one.push(0.0, 0.0, round((2 * math.pi - one.theta_rad) / w * 24e6))
    assert math.hypot(one.x_m, one.y_m) < 1e-7


def test_a_straight_push_keeps_the_heading_and_a_contrary_one_keeps_the_place():
    one = body(SMOOTH)
    one.push(1e-6, 1e-6, 2048)
    assert (one.y_m, one.theta_rad) == (0.0, 0.0)
    assert one.x_m > 0.0
    one = body(SMOOTH)
    one.push(-1e-6, 1e-6, 2048)
    assert one.x_m == 0.0
    assert one.theta_rad > 0.0


def test_impulses_make_the_speeds_of_a_rigid_body():
    one = body(SMOOTH)
    one.push(3e-6, 1e-6, 1000)
    v, w = one.velocity()
    roll = 0.020 / 8
    force_left = (3e-6 - 2.7e-7 * one.left_rad_s) / roll
    force_right = (1e-6 - 2.7e-7 * one.right_rad_s) / roll
    assert force_left + force_right == pytest.approx(0.5 * v)
    assert 0.5 * 0.068 * (force_right - force_left) == pytest.approx(4.7e-4 * w)


@settings(max_examples=300)
@given(st.one_of(SPEEDS, SLOW), st.one_of(SPEEDS, SLOW), st.integers(1, 2048))
def test_friction_alone_never_adds_energy_and_never_reverses_a_shaft_of_its_own(left, right, ticks):
    one = body(ROUGH, left, right)
    before = kinetic_energy_j(one)
    one.push(0.0, 0.0, ticks)
    assert kinetic_energy_j(one) <= before


@settings(max_examples=300)
@given(SLOW, SLOW, IMPULSES, IMPULSES, st.integers(1, 2048))
def test_friction_is_within_its_limit_and_against_the_speed_that_is_left(
    left, right, push_left, push_right, ticks
):
    one = body(ROUGH, left, right)
    one.push(push_left, push_right, ticks)
    most = ROUGH.friction_nm() * ticks / 24e6
    gained_left, gained_right = one.left_rad_s - left, one.right_rad_s - right
    rub_left = one.mass_ll * gained_left + one.mass_lr * gained_right - push_left
    rub_right = one.mass_lr * gained_left + one.mass_rr * gained_right - push_right
    for rub, speed in ((rub_left, one.left_rad_s), (rub_right, one.right_rad_s)):
        assert abs(rub) <= most + 1e-20
        if speed != 0.0:
            assert rub == pytest.approx(-math.copysign(most, speed), abs=1e-18)


@given(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.integers(1, 2048))
def test_pushes_below_stiction_leave_the_robot_exactly_where_it_is(left, right, ticks):
    one = body(ROUGH)
    most = ROUGH.friction_nm() * ticks / 24e6
    one.push(left * most, right * most, ticks)
    assert snapshot(one) == snapshot(body(ROUGH))


def test_one_wheel_can_stick_while_the_other_turns():
    one = body(ROUGH)
    for _ in range(50):
        one.push(0.0, 1e-7, 2048)
    assert one.left_rad_s == 0.0
    assert one.right_rad_s > 0.0
    assert math.hypot(one.x_m, one.y_m) == pytest.approx(abs(one.theta_rad) * 0.034, rel=1e-3)


@given(SPEEDS, SPEEDS, st.integers(0, 2048))
def test_looking_ahead_is_pure_and_is_where_a_free_step_ends(left, right, ticks):
    one = body(SMOOTH, left, right)
    before = snapshot(one)
    ahead = one.pose_after(ticks)
    assert snapshot(one) == before
    one.push(0.0, 0.0, ticks)
    assert ahead == pytest.approx((one.x_m, one.y_m, one.theta_rad), abs=1e-13)
