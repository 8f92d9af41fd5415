"""Equations (1) to (10), (14) and (15): any system's reduction, the robot's, and the disturbance that is left."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.theory.mechanics import (
    HEAVY,
    ROBOT,
    System,
    UnicycleBody,
    accelerated,
    acceleration,
    bounds,
    cartesian,
    cartesian_rates,
    constraint_forces,
    inertia,
    polar,
    polar_rates,
    reduced,
    without_constraint,
)

BODIES = st.builds(
    UnicycleBody,
    mass_kg=st.floats(0.05, 20.0),
    yaw_inertia_kg_m2=st.floats(1e-5, 1.0),
    wheel_radius_m=st.floats(0.005, 0.2),
    track_m=st.floats(0.02, 0.5),
)
PLACES = st.tuples(st.floats(0.03, 1.2), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))  # rho, phi, theta


def pairs(most, second=None):
    return st.tuples(st.floats(-most, most), st.floats(-(second or most), second or most)).map(np.array)


SPEEDS = pairs(1.4, 20.0)
TORQUES = pairs(0.1)
DEMANDS = pairs(50.0)
DISTURBANCES = pairs(0.05)


def at(rho, phi, theta):
    """The same posture in both sets of coordinates."""
    return np.array([rho * math.cos(phi), rho * math.sin(phi), theta]), np.array([rho, phi, theta])


def both(body, place, z):
    q, polar_q = at(*place)
    return cartesian(body, q, z), polar(body, polar_q, z)


@given(BODIES, PLACES, SPEEDS)
def test_no_direction_of_motion_breaks_a_constraint(body, place, z):
    for system in both(body, place, z):
        assert system.constraints @ system.directions == pytest.approx(0.0, abs=1e-14)


@given(PLACES, SPEEDS)
def test_equation_9_is_equation_8_in_polar_coordinates(place, z):
    """rho' = (x x' + y y') / rho, phi' = (x y' - y x') / rho^2."""
    (x, y, theta), polar_q = at(*place)
    x_rate, y_rate, turn = cartesian_rates([x, y, theta], z)
    rho, phi_rate = place[0], (x * y_rate - y * x_rate) / place[0] ** 2
    expected = [(x * x_rate + y * y_rate) / rho, phi_rate, turn]
    assert polar_rates(polar_q, z) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(BODIES, PLACES, SPEEDS)
def test_both_sets_of_coordinates_have_the_written_out_h_and_no_g(body, place, z):
    for system in both(body, place, z):
        h, g = reduced(system, z)
        assert h == pytest.approx(inertia(body), rel=1e-9)
        scale = body.mass_kg * (1.0 + z[0] ** 2 + z[1] ** 2) / place[0]
        assert g == pytest.approx(0.0, abs=1e-12 * scale)


@given(BODIES, PLACES, SPEEDS, TORQUES)
def test_the_reduction_is_newtons_and_eulers_law_of_a_body_on_two_wheels(body, place, z, torque):
    """Which are written down by hand, without any matrix."""
    z_dot = accelerated(body, torque)
    for system in both(body, place, z):
        h, g = reduced(system, z)
        scale = 1e-9 * (1.0 + abs(z_dot).sum())
        assert np.linalg.solve(h, torque - g) == pytest.approx(z_dot, rel=1e-7, abs=scale)


@given(BODIES, PLACES, SPEEDS, TORQUES)
def test_the_motors_power_is_the_rate_of_the_energy(body, place, z, torque):
    """The constraint does no work. The rate of m v^2 / 2 + J w^2 / 2 by hand, beside q'^T E tau."""
    z_dot = np.linalg.solve(inertia(body), torque)
    for system in both(body, place, z):
        q_dot = system.directions @ z
        rate = body.mass_kg * z[0] * z_dot[0] + body.yaw_inertia_kg_m2 * z[1] * z_dot[1]
        assert q_dot @ system.inputs @ torque == pytest.approx(rate, rel=1e-9, abs=1e-9)
        twice = body.mass_kg * z[0] ** 2 + body.yaw_inertia_kg_m2 * z[1] ** 2
        assert q_dot @ system.inertia @ q_dot == pytest.approx(twice, rel=1e-12)


@given(PLACES, SPEEDS, TORQUES)
def test_equation_3_holds_with_a_constraint_force_that_is_the_centripetal_one(place, z, torque):
    """In Cartesian coordinates lambda = -m v w: what the wheels press sideways to turn the body."""
    z_dot = np.linalg.solve(inertia(ROBOT), torque)
    for system in both(ROBOT, place, z):
        left = without_constraint(system, z, z_dot, torque)
        forces = constraint_forces(system, z, z_dot, torque)
        assert left - system.constraints.T @ forces == pytest.approx(0.0, abs=1e-9)
    force = constraint_forces(both(ROBOT, place, z)[0], z, z_dot, torque)
    assert force == pytest.approx([-ROBOT.mass_kg * z[0] * z[1]], abs=1e-9)


@given(PLACES, SPEEDS, TORQUES)
def test_equation_5_is_the_derivative_of_equation_4(place, z, z_dot):
    """q'' beside the central difference of q' = S z along the motion; any numbers will do as z'."""
    dt = 1e-5
    for make, rates, q in zip((cartesian, polar), (cartesian_rates, polar_rates), at(*place), strict=True):

        def later(h, q=q, rates=rates):
            middle = q + 0.5 * h * rates(q, z)
            return rates(q + h * rates(middle, z + 0.5 * h * z_dot), z + h * z_dot)

        found = acceleration(make(ROBOT, q, z), z, z_dot)
        scale = (1.0 + abs(z[0]) / place[0] + abs(z[1])) ** 3
        assert found == pytest.approx((later(dt) - later(-dt)) / (2.0 * dt), abs=1e-6 * scale)


# Any other system: a knife edge on a slope, whose equations are in textbooks.


def knife_edge(theta, w, mass=2.0, inertia_kg_m2=0.3, gravity=9.81, slope=0.4):
    """x points down the slope. The inputs are a push along the edge and a moment."""
    sin, cos = math.sin(theta), math.cos(theta)
    along = np.array([[cos, 0.0], [sin, 0.0], [0.0, 1.0]])
    return System(
        inertia=np.diag([mass, mass, inertia_kg_m2]),
        force=np.array([-mass * gravity * math.sin(slope), 0.0, 0.0]),
        inputs=along,
        constraints=np.array([[-sin, cos, 0.0]]),
        directions=along,
        directions_rate=np.array([[-sin * w, 0.0], [cos * w, 0.0], [0.0, 0.0]]),
    )


@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_knife_edge_on_a_slope_is_pulled_by_the_part_of_gravity_along_it(theta, v, w):
    h, g = reduced(knife_edge(theta, w), [v, w])
    assert h == pytest.approx(np.diag([2.0, 0.3]), abs=1e-12)
    assert g == pytest.approx([-2.0 * 9.81 * math.sin(0.4) * math.cos(theta), 0.0], abs=1e-9)


def test_a_system_whose_inputs_do_not_reach_all_directions_is_refused():
    with pytest.raises(ValueError, match="Singular"):
        reduced(knife_edge(0.3, 0.0)._replace(inputs=np.zeros((3, 2))), [0.0, 0.0])


# Computed torque, and what is left of a disturbance.


@given(BODIES, DEMANDS, DISTURBANCES)
def test_computed_torque_leaves_equation_15(body, demanded, tau_d):
    h = inertia(body)
    left = demanded - accelerated(body, h @ demanded - tau_d)
    f = np.linalg.solve(h, tau_d)
    scale = 1e-9 * (1.0 + abs(demanded).sum() + abs(f).sum())
    assert left == pytest.approx(f, abs=scale)


@given(BODIES, DISTURBANCES)
def test_every_disturbance_of_the_wheels_satisfies_the_matching_condition(body, tau_d):
    h = inertia(body)
    assert h @ np.linalg.solve(h, tau_d) == pytest.approx(tau_d, abs=1e-15)


@given(BODIES, pairs(1.0))
def test_bounds_of_the_disturbance_give_bounds_of_f_that_are_reached(body, part):
    h, largest = inertia(body), np.array([0.02, 0.03])
    most = bounds(h, largest)
    assert all(abs(np.linalg.solve(h, largest * part)) <= most * (1.0 + 1e-12))
    assert np.linalg.solve(h, largest)[0] == pytest.approx(most[0])
    assert np.linalg.solve(h, largest * [-1.0, 1.0])[1] == pytest.approx(most[1])


def test_the_robots_friction_is_a_disturbance_of_this_size():
    """1.5 mNm of rolling resistance at each wheel: f_m1 = 0.3 m/s2, f_m2 = 10.9 rad/s2."""
    assert bounds(inertia(ROBOT), [1.5e-3, 1.5e-3]) == pytest.approx([0.3, 10.85], rel=0.01)


@pytest.mark.parametrize("demanded", [0.1, 1.0, 8.0])
def test_a_wrong_model_makes_f_as_large_as_what_is_demanded(demanded):
    """The real robot is 20 % heavier: f1 = (1 - 1/1.2) (v_r' + u1), whatever bound was believed in."""
    v_dot, w_dot = accelerated(HEAVY, inertia(ROBOT) @ [demanded, 0.0])
    assert demanded - v_dot == pytest.approx(demanded / 6.0)
    assert w_dot == pytest.approx(0.0, abs=1e-12)
