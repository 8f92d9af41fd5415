"""Equations (1) to (9): any system's reduction, and the robot's in both sets of coordinates."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.host.theory import matrices
from tests.host.theory.ideal import ROBOT
from tests.host.theory.mechanics import (
    System,
    acceleration,
    constrained,
    constraint_forces,
    energy,
    power,
    reduced,
    residual,
)
from tests.host.theory.unicycle import UnicycleBody, cartesian, cartesian_rates, inertia, polar, polar_rates

BODIES = st.builds(
    UnicycleBody,
    mass_kg=st.floats(0.05, 20.0),
    yaw_inertia_kg_m2=st.floats(1e-5, 1.0),
    wheel_radius_m=st.floats(0.005, 0.2),
    track_m=st.floats(0.02, 0.5),
)
PLACES = st.tuples(st.floats(0.03, 1.2), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))  # rho, phi, theta
SPEEDS = st.tuples(st.floats(-1.4, 1.4), st.floats(-20.0, 20.0))
TORQUES = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))


def at(rho, phi, theta):
    """The same posture in both sets of coordinates."""
    return [rho * math.cos(phi), rho * math.sin(phi), theta], [rho, phi, theta]


def both(body, place, z):
    q, polar_q = at(*place)
    return cartesian(body, q, list(z)), polar(body, polar_q, list(z))


@given(BODIES, PLACES, SPEEDS)
def test_no_direction_of_motion_breaks_a_constraint(body, place, z):
    for system in both(body, place, z):
        assert constrained(system)[0] == pytest.approx([0.0, 0.0], abs=1e-14)


@given(PLACES, SPEEDS)
def test_equation_9_is_equation_8_in_polar_coordinates(place, z):
    """rho' = (x x' + y y') / rho, phi' = (x y' - y x') / rho^2."""
    (x, y, theta), polar_q = at(*place)
    x_rate, y_rate, turn = cartesian_rates([x, y, theta], list(z))
    rho, phi_rate = place[0], (x * y_rate - y * x_rate) / place[0] ** 2
    expected = [(x * x_rate + y * y_rate) / rho, phi_rate, turn]
    assert polar_rates(polar_q, list(z)) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(BODIES, PLACES, SPEEDS)
def test_both_sets_of_coordinates_have_the_written_out_h_and_no_g(body, place, z):
    h = inertia(body)
    for system in both(body, place, z):
        found = reduced(system, list(z))
        for row, expected in zip(found.h, h, strict=True):
            assert row == pytest.approx(expected, rel=1e-9)
        scale = body.mass_kg * (1.0 + z[0] ** 2 + z[1] ** 2) / place[0]
        assert found.g == pytest.approx([0.0, 0.0], abs=1e-12 * scale)


@given(BODIES, PLACES, SPEEDS, TORQUES)
def test_the_reduction_is_newtons_and_eulers_law_of_a_body_on_two_wheels(body, place, z, torque):
    """m v' = (tau_l + tau_r) / r and J w' = (tau_r - tau_l) b / 2 r: written down by hand, without any matrix."""
    left, right = torque
    v_dot = (left + right) / (body.mass_kg * body.wheel_radius_m)
    w_dot = (right - left) * body.track_m / (2.0 * body.wheel_radius_m * body.yaw_inertia_kg_m2)
    for system in both(body, place, z):
        found = reduced(system, list(z))
        rest = [one - other for one, other in zip(torque, found.g, strict=True)]
        scale = 1e-9 * (1.0 + abs(v_dot) + abs(w_dot))
        assert matrices.solved(found.h, rest) == pytest.approx([v_dot, w_dot], rel=1e-7, abs=scale)


@given(BODIES, PLACES, SPEEDS, TORQUES)
def test_the_motors_power_is_the_rate_of_the_energy(body, place, z, torque):
    """The constraint does no work. The rate of m v^2 / 2 + J w^2 / 2 by hand, beside q'^T E tau."""
    for system in both(body, place, z):
        z_dot = matrices.solved(inertia(body), list(torque))
        rate = body.mass_kg * z[0] * z_dot[0] + body.yaw_inertia_kg_m2 * z[1] * z_dot[1]
        assert power(system, list(z), list(torque)) == pytest.approx(rate, rel=1e-9, abs=1e-9)
        expected = 0.5 * (body.mass_kg * z[0] ** 2 + body.yaw_inertia_kg_m2 * z[1] ** 2)
        assert energy(system, list(z)) == pytest.approx(expected, rel=1e-12)


@given(PLACES, SPEEDS, TORQUES)
def test_equation_3_holds_with_a_constraint_force_that_is_the_centripetal_one(place, z, torque):
    """In Cartesian coordinates lambda = -m v w: what the wheels press sideways to turn the body."""
    z_dot = matrices.solved(inertia(ROBOT), list(torque))
    for system in both(ROBOT, place, z):
        assert residual(system, list(z), z_dot, list(torque)) == pytest.approx([0.0] * 3, abs=1e-9)
    force = constraint_forces(both(ROBOT, place, z)[0], list(z), z_dot, list(torque))
    assert force == pytest.approx([-ROBOT.mass_kg * z[0] * z[1]], abs=1e-9)


@given(PLACES, SPEEDS, TORQUES)
def test_equation_5_is_the_derivative_of_equation_4(place, z, torque):
    """q'' beside the central difference of q' = S z along the motion."""
    z_dot = torque  # any numbers will do
    for make, rates, q in ((cartesian, cartesian_rates, at(*place)[0]), (polar, polar_rates, at(*place)[1])):
        dt = 1e-5

        def later(h, q=q, rates=rates):
            first = rates(q, list(z))
            middle = [a + 0.5 * h * b for a, b in zip(q, first, strict=True)]
            half = [a + 0.5 * h * b for a, b in zip(z, z_dot, strict=True)]
            moved = [a + h * b for a, b in zip(q, rates(middle, half), strict=True)]
            return rates(moved, [a + h * b for a, b in zip(z, z_dot, strict=True)])

        found = acceleration(make(ROBOT, q, list(z)), list(z), list(z_dot))
        expected = [(a - b) / (2.0 * dt) for a, b in zip(later(dt), later(-dt), strict=True)]
        scale = (1.0 + abs(z[0]) / place[0] + abs(z[1])) ** 3
        assert found == pytest.approx(expected, abs=1e-6 * scale)


# Any other system: a knife edge on a slope, whose equations are in textbooks.


def knife_edge(theta, w, mass=2.0, inertia_kg_m2=0.3, gravity=9.81, slope=0.4):
    """x points down the slope. The inputs are a push along the edge and a moment."""
    sin, cos = math.sin(theta), math.cos(theta)
    return System(
        inertia=[[mass, 0.0, 0.0], [0.0, mass, 0.0], [0.0, 0.0, inertia_kg_m2]],
        force=[-mass * gravity * math.sin(slope), 0.0, 0.0],
        inputs=[[cos, 0.0], [sin, 0.0], [0.0, 1.0]],
        constraints=[[-sin, cos, 0.0]],
        directions=[[cos, 0.0], [sin, 0.0], [0.0, 1.0]],
        directions_rate=[[-sin * w, 0.0], [cos * w, 0.0], [0.0, 0.0]],
    )


@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_knife_edge_on_a_slope_is_pulled_by_the_part_of_gravity_along_it(theta, v, w):
    found = reduced(knife_edge(theta, w), [v, w])
    assert found.h[0] == pytest.approx([2.0, 0.0], abs=1e-12)
    assert found.h[1] == pytest.approx([0.0, 0.3], abs=1e-12)
    assert found.g == pytest.approx([-2.0 * 9.81 * math.sin(0.4) * math.cos(theta), 0.0], abs=1e-9)


def test_a_system_whose_inputs_do_not_reach_all_directions_is_refused():
    system = knife_edge(0.3, 0.0)
    without = System(
        system.inertia,
        system.force,
        [[0.0, 0.0]] * 3,
        system.constraints,
        system.directions,
        system.directions_rate,
    )
    with pytest.raises(ValueError, match="singular"):
        reduced(without, [0.0, 0.0])


# The matrices themselves.

NUMBERS = st.floats(-10.0, 10.0)
SQUARES = st.integers(1, 4).flatmap(
    lambda size: st.lists(st.lists(NUMBERS, min_size=size, max_size=size), min_size=size, max_size=size)
)


@given(SQUARES, st.data())
def test_the_solution_of_linear_equations_solves_them(a, data):
    right = data.draw(st.lists(NUMBERS, min_size=len(a), max_size=len(a)))
    try:
        found = matrices.solved(a, right)
    except ValueError:
        assume(False)
    scale = max(map(abs, found)) * max(abs(value) for row in a for value in row)
    assume(scale < 1e6)
    assert matrices.times(a, found) == pytest.approx(right, abs=1e-9 * (1.0 + scale))


def test_equal_columns_are_singular_also_where_rounding_leaves_a_difference():
    with pytest.raises(ValueError, match="singular"):
        matrices.solved([[1.75, 1.75], [6.25, 6.25]], [0.0, 0.0])


def test_rows_are_exchanged_where_the_first_one_cannot_be_divided_by():
    assert matrices.solved([[0.0, 2.0], [4.0, 0.0]], [6.0, 8.0]) == [2.0, 3.0]
    assert matrices.product([[1.0, 2.0, 3.0]], [[1.0], [10.0], [100.0]]) == [[321.0]]
    assert matrices.transposed([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]) == [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]


@pytest.mark.parametrize("name", ["mass_kg", "yaw_inertia_kg_m2", "wheel_radius_m", "track_m"])
def test_a_body_without_mass_or_size_is_refused(name):
    keys = {"mass_kg": 1.0, "yaw_inertia_kg_m2": 1.0, "wheel_radius_m": 1.0, "track_m": 1.0, name: 0.0}
    with pytest.raises(ValueError, match=name):
        UnicycleBody(**keys)
