"""Equations (10), (14), (15) and the matching condition: where f comes from, and where it has no bound."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.theory import computed_torque
from tests.host.theory.ideal import ROBOT
from tests.host.theory.test_mechanics import BODIES
from tests.host.theory.unicycle import UnicycleBody, inertia

DEMANDS = st.lists(st.floats(-50.0, 50.0), min_size=2, max_size=2)
DISTURBANCES = st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=2)
NO_G = [0.0, 0.0]


@given(BODIES, DEMANDS, DISTURBANCES)
def test_computed_torque_leaves_equation_15(body, demanded, tau_d):
    h = inertia(body)
    z_dot = computed_torque.acceleration(h, NO_G, computed_torque.torque(h, NO_G, demanded), tau_d)
    f = computed_torque.matched(h, tau_d)
    for i in (0, 1):
        scale = 1e-9 * (1.0 + abs(demanded[0]) + abs(demanded[1]) + abs(f[0]) + abs(f[1]))
        assert computed_torque.disturbance(demanded[i], z_dot[i]) == pytest.approx(f[i], abs=scale)


@given(BODIES, DISTURBANCES)
def test_every_disturbance_of_the_wheels_satisfies_the_matching_condition(body, tau_d):
    h = inertia(body)
    f = computed_torque.matched(h, tau_d)
    assert computed_torque.mismatch(h, tau_d, f) == pytest.approx([0.0, 0.0], abs=1e-15)


@given(BODIES, st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=2))
def test_bounds_of_the_disturbance_give_bounds_of_f_that_are_reached(body, part):
    h = inertia(body)
    most = computed_torque.bounds(h, [0.02, 0.03])
    f = computed_torque.matched(h, [0.02 * part[0], 0.03 * part[1]])
    assert all(abs(f[i]) <= most[i] * (1.0 + 1e-12) for i in (0, 1))
    assert computed_torque.matched(h, [0.02, 0.03])[0] == pytest.approx(most[0])
    assert computed_torque.matched(h, [-0.02, 0.03])[1] == pytest.approx(most[1])


def test_the_robots_friction_is_a_disturbance_of_this_size():
    """1.5 mNm of rolling resistance at each wheel: f_m1 = 0.3 m/s2, f_m2 = 10.9 rad/s2."""
    assert computed_torque.bounds(inertia(ROBOT), [1.5e-3, 1.5e-3]) == pytest.approx([0.3, 10.85], rel=0.01)


def test_a_wrong_model_makes_f_as_large_as_what_is_demanded():
    """The real robot is 20 % heavier: f1 = (1 - 1/1.2) (v_r' + u1), whatever bound was believed in."""
    real = inertia(
        UnicycleBody(**{name: getattr(ROBOT, name) for name in ROBOT.__struct_fields__} | {"mass_kg": 0.6})
    )
    for demanded in (0.1, 1.0, 8.0):
        applied = computed_torque.torque(inertia(ROBOT), NO_G, [demanded, 0.0])
        z_dot = computed_torque.acceleration(real, NO_G, applied, [0.0, 0.0])
        f1 = computed_torque.disturbance(demanded, z_dot[0])
        assert f1 == pytest.approx(demanded / 6.0)
        assert math.isclose(z_dot[1], 0.0, abs_tol=1e-12)
