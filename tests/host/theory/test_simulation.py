"""The simulation at the level of torques: both sets of coordinates, its slow twin, its order, its energy."""

import math
from itertools import pairwise

import pytest

from miro_host.integrator import Limits
from miro_host.laws.yang_kim import YangKim
from miro_host.posture import Posture
from miro_host.references.arc import Arc
from miro_host.references.line import StraightLine
from tests.host.theory import computed_torque
from tests.host.theory.ideal import LITERAL, ROBOT, beside, paper_law
from tests.host.theory.simulation import BodySimulation
from tests.host.theory.unicycle import UnicycleBody, inertia
from tests.naive.host_ideal_loop import drive


def swaying(t, posture, v, w):
    """Demands that do not depend on the robot."""
    return 0.3 * math.cos(3.0 * t), 4.0 * math.sin(2.0 * t)


def ended(rows):
    *_, row = rows
    return row.posture.x_m, row.posture.y_m, row.posture.theta_rad, row.v_m_s, row.w_rad_s


@pytest.mark.parametrize("path", [StraightLine(), Arc()])
def test_equations_8_and_9_lead_to_the_same_place(path):
    start, z = beside(path, 1.0, 0.05, 0.03, 0.3)
    ends = [
        ended(BodySimulation(ROBOT, paper_law(LITERAL, path), chart=chart).run(start, z, 1.0, 4.0, 0.002))
        for chart in ("cartesian", "polar")
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-6)


@pytest.mark.parametrize("path", [StraightLine(), Arc()])
def test_it_agrees_with_the_slow_twin_that_knows_no_torque(path):
    """The twin adds up equation (15) in steps of 0.1 ms; f is what tau_d comes to."""
    f = (0.1, 0.5)

    def friction(t):
        return [sum(a * b * math.sin(7.0 * t) for a, b in zip(row, f, strict=True)) for row in inertia(ROBOT)]

    start, z = beside(path, 1.0, 0.05, 0.03, 0.3)
    row = drive(
        YangKim(LITERAL),
        path,
        (start.x_m, start.y_m, start.theta_rad),
        z,
        1.0,
        3.0 + 1e-4,
        1e-4,
        lambda t: (f[0] * math.sin(7.0 * t), f[1] * math.sin(7.0 * t)),
    )[-1]
    made = BodySimulation(ROBOT, paper_law(LITERAL, path), disturbance=friction)
    x, y, theta, _, _ = ended(made.run(start, z, 1.0, 3.0, 0.002))
    assert (x, y, theta) == pytest.approx((row.posture.x_m, row.posture.y_m, row.posture.theta_rad), abs=2e-5)


def test_half_the_step_leaves_a_sixteenth_of_the_error():
    def end(steps):
        return ended(
            BodySimulation(ROBOT, swaying).run(Posture(0.1, 0.0, 0.2), (0.2, 1.0), 0.0, 2.0, 2.0 / steps)
        )

    exact = end(800)
    errors = [math.dist(end(steps)[:3], exact[:3]) for steps in (20, 40)]
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_the_work_of_the_torques_is_the_energy_that_the_body_has():
    step, work, rows = 1e-3, 0.0, []
    for row in BodySimulation(ROBOT, swaying).run(Posture(0.0, 0.0, 0.0), (0.0, 0.0), 0.0, 2.0, step):
        rows.append(row)
    powers = []
    for row in rows:
        half = 0.5 * ROBOT.track_m * row.w_rad_s
        left, right = row.v_m_s - half, row.v_m_s + half
        powers.append((row.torque_nm[0] * left + row.torque_nm[1] * right) / ROBOT.wheel_radius_m)
    for one, other in pairwise(powers):
        work += 0.5 * step * (one + other)
    last = rows[-1]
    held = 0.5 * (ROBOT.mass_kg * last.v_m_s**2 + ROBOT.yaw_inertia_kg_m2 * last.w_rad_s**2)
    assert held > 1e-3
    assert work == pytest.approx(held, rel=1e-5)


def test_a_wrong_model_is_the_disturbance_that_the_theory_calls_it():
    heavy = UnicycleBody(mass_kg=0.6, yaw_inertia_kg_m2=4.7e-4, wheel_radius_m=0.02, track_m=0.068)
    first, second, *_ = BodySimulation(heavy, swaying, model=ROBOT).run(
        Posture(0.1, 0.0, 0.2), (0.0, 0.0), 0.0, 0.01, 1e-4
    )
    v_dot = (second.v_m_s - first.v_m_s) / 1e-4
    f1 = computed_torque.disturbance(first.demand[0], v_dot)
    assert f1 == pytest.approx(first.demand[0] / 6.0, rel=1e-3)


def test_limits_hold_for_demands_and_speeds():
    limits = Limits(max_v_m_s=0.05, max_w_rad_s=0.5, max_v_dot_m_s2=0.2, max_w_dot_rad_s2=2.0)
    rows = list(
        BodySimulation(ROBOT, swaying, limits=limits).run(Posture(0.1, 0.0, 0.0), (0.0, 0.0), 0.0, 1.0, 1e-3)
    )
    assert max(abs(row.demand[0]) for row in rows) == 0.2
    assert 0.05 <= max(row.v_m_s for row in rows) < 0.0503
    assert 0.5 <= max(row.w_rad_s for row in rows) < 0.503


def test_the_steps_have_to_fill_the_time():
    with pytest.raises(ValueError, match="no whole number of steps"):
        list(BodySimulation(ROBOT, swaying).run(Posture(0.1, 0.0, 0.0), (0.0, 0.0), 0.0, 1.0, 0.3))
