"""What the paper proves about its law, and what it does not, on robots that do at once what their motors are told.

Long runs and tables: `python -m tests.host.theory.claims`.
"""

import math
from itertools import pairwise

import pytest

from miro_host.integrator import Limits
from miro_host.posture import Posture
from miro_host.references.arc import Arc, StraightLine
from tests.host.theory import stability
from tests.host.theory.ideal import (
    LITERAL,
    PRINTED,
    ROBOT,
    beside,
    figure,
    final_place,
    inertia,
    lateral_slope,
    lyapunov_run,
    paper_law,
    random_starts,
    run_across_theta_e_0,
    run_parallel_to_the_line,
    simulated,
)
from tests.host.theory.paper_law import YangKim
from tests.naive.host_ideal_loop import drive

ERRORS = [(StraightLine(), (0.07, 0.10, -0.38)), (Arc(), (0.05, -0.06, 0.5)), (Arc(), (0.06, 0.04, -0.3))]


# Theorem 1.


@pytest.mark.parametrize(("path", "error"), ERRORS)
@pytest.mark.parametrize("worst", [False, True])
def test_with_gains_above_f_v_falls_in_every_step_away_from_crossings_of_theta_e(path, error, worst):
    """Under a sine, and under the f that does the most harm at each moment; |f_i| <= P_i, as (17) wants it."""
    run = lyapunov_run(path, error, 2.0, 5.0, (0.30, 1.0), worst)
    falls = 0
    for one, two in pairwise(run):
        if one.crossed_before(two) or one.near_a_surface():
            continue
        assert two.v - one.v <= 1e-6
        falls += 1
    assert falls > 100


def test_where_theta_e_crosses_0_v_jumps_by_twice_the_product_of_the_rate_and_phi_e():
    """The proof drops the derivative of sgn(theta_e). In a run, within 5 %."""
    jumps = 0
    for one, two in pairwise(run_across_theta_e_0()):
        expected = stability.jump(one.turn, one.phi_e)
        if one.crossed_before(two) and expected > 0.01:
            assert two.v - one.v == pytest.approx(expected, rel=0.05)
            jumps += 1
    assert jumps > 0


def test_with_gains_below_f_v_rises_and_the_surfaces_stay_within_reach():
    """Condition (17) is needed for V' <= 0. What is left without it is a bound: s_2 within (f - P) / Q."""
    run = lyapunov_run(StraightLine(), (0.05, 0.05, 0.05), 2.0, 5.0, (0.0, 2.0), True)
    gap = stability.reach(PRINTED.p2_rad_s2, PRINTED.q2_per_s, 2.0)
    rises = [two.v - one.v for one, two in pairwise(run) if not one.crossed_before(two)]
    assert max(rises) > 1e-6
    assert max(abs(row.s2) for row in run[len(run) // 2 :]) < 1.1 * gap


@pytest.mark.parametrize(("path", "error"), ERRORS)
def test_both_surfaces_and_the_heading_error_go_to_zero(path, error):
    """What the paper has right: s1, s2, rho_e and theta_e are stabilised, also under a disturbance below P."""
    last = lyapunov_run(path, error, 1.0, 5.9, (0.15, 0.5), False)[-1]
    assert abs(last.s1) < 2e-3
    assert abs(last.rho_e) < 2e-3
    assert abs(last.theta_e) < 0.01


# Proposition 1.


def test_with_the_heading_right_the_robot_runs_parallel_to_the_line_for_ever():
    """Theta_e = 0, 4 cm beside the line: the law answers with no turn at all, and rho sin(phi_e) stays."""
    path, rows = StraightLine(), run_parallel_to_the_line()
    assert {row.demand[1] for row in rows} == {0.0}
    assert abs(rows[-1].posture.y_m - 0.04) < 0.0002
    for row in rows[:: len(rows) // 10]:
        e = stability.polar_errors(path.at(row.t_s), row.posture, row.v_m_s, row.w_rad_s)
        rho_r = path.at(row.t_s).rho_m
        assert math.sin(e.phi_e_rad) * (rho_r + e.rho_e_m) == pytest.approx(0.04, rel=1e-9)
        assert rho_r * math.sin(e.phi_e_rad) == pytest.approx(0.04, rel=0.03)
    first, last = (math.atan2(row.posture.y_m, row.posture.x_m) for row in (rows[0], rows[-1]))
    assert last < 0.1 * first  # like 1 / rho, because the line gets longer: the position does not converge


@pytest.mark.parametrize("path", [StraightLine(), Arc()])
@pytest.mark.parametrize("phi_e", [-0.4, -0.1, 0.2])
def test_the_zero_dynamics_of_the_surfaces_are_those_of_the_formula(path, phi_e):
    """A robot with s1 = s2 = rho_e = theta_e = 0 moves phi_e at this rate and at no other, whatever the gains."""
    r = path.at(3.0)
    angle = r.phi_rad + phi_e
    robot = Posture(r.rho_m * math.cos(angle), r.rho_m * math.sin(angle), r.posture.theta_rad)
    a = r.phi_rad - r.posture.theta_rad
    v = r.v_m_s * math.cos(a) / math.cos(a + phi_e)  # rho_e' = 0
    e = stability.polar_errors(r, robot, v, r.w_rad_s)
    assert (e.rho_e_m, e.rho_e_rate, e.theta_e_rate) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert stability.surfaces(e, (1.7, 3.0)) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert e.phi_e_rate == pytest.approx(stability.phi_error_rate_on_surfaces(r, phi_e), rel=1e-9)


def test_the_final_lateral_error_follows_the_initial_one_with_slope_one_and_with_a_signed_error_not_at_all():
    assert 0.9 < lateral_slope("literal", (-0.04, 0.04), 0.004) < 1.15
    assert abs(lateral_slope("body", (-0.04, 0.04), 0.004)) < 0.01


# The figures and random starts.


@pytest.mark.parametrize(("name", "settled_s"), [("Fig. 6", 1.0), ("Fig. 7", 2.5), ("Fig. 8", 2.6)])
def test_errors_in_the_robots_own_axes_go_to_nothing_from_the_papers_starts(name, settled_s):
    distance, turn, settled = figure("body", name)
    assert distance < 0.001
    assert math.degrees(turn) < 0.5
    assert settled < settled_s


@pytest.mark.parametrize("name", ["Fig. 6", "Fig. 7", "Fig. 8"])
def test_the_papers_figures_can_be_drawn_with_the_papers_law(name):
    """One set of gains ends all three within the paper's own measurement error of 2.40 cm."""
    distance, turn, _ = figure("literal", name)
    assert distance < 0.024
    assert math.degrees(turn) < 0.5


def test_from_random_starts_few_reach_the_line_under_the_papers_law_and_all_with_a_signed_error():
    literal = [final_place("literal", error, 0.01) for error in random_starts(20)]
    body = [final_place("body", error, 0.01) for error in random_starts(10)]
    assert sum(math.hypot(x, y) < 0.03 for x, y, _ in literal) <= 6
    assert sum(abs(theta) < 0.05 for _, _, theta in literal) >= 16  # parallel to it, as the zero dynamics say
    assert all(math.hypot(x, y) < 0.03 for x, y, _ in body)


# The simulation itself.


def swaying(t, posture, v, w):
    """Demands that do not depend on the robot."""
    return 0.3 * math.cos(3.0 * t), 4.0 * math.sin(2.0 * t)


def swayed(end_s, step_s, **options):
    start = Posture(0.1, 0.0, 0.2)
    return list(simulated(swaying, start, (0.0, 0.0), 0.0, end_s, step_s, **options))


@pytest.mark.parametrize("path", [StraightLine(), Arc()])
def test_the_simulation_agrees_with_the_slow_twin_that_knows_no_torque(path):
    """The twin adds up equation (15) in steps of 0.1 ms; f is what tau_d comes to."""

    def f(t):
        return 0.1 * math.sin(7.0 * t), 0.5 * math.sin(7.0 * t)

    start, z = beside(path, 1.0, 0.05, 0.03, 0.3)
    place = (start.x_m, start.y_m, start.theta_rad)
    twin = drive(YangKim(LITERAL), path, place, z, 1.0, 3.0 + 1e-4, 1e-4, f)[-1].posture
    *_, row = simulated(paper_law(LITERAL, path), start, z, 1.0, 3.0, 0.002, lambda t: inertia(ROBOT) @ f(t))
    ended = (row.posture.x_m, row.posture.y_m, row.posture.theta_rad)
    assert ended == pytest.approx((twin.x_m, twin.y_m, twin.theta_rad), abs=2e-5)


def test_half_the_step_leaves_a_sixteenth_of_the_error():
    def end(steps):
        last = swayed(2.0, 2.0 / steps)[-1].posture
        return last.x_m, last.y_m, last.theta_rad

    exact = end(800)
    errors = [math.dist(end(steps), exact) for steps in (20, 40)]
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_the_work_of_the_torques_is_the_energy_that_the_body_has():
    powers, rows = [], swayed(2.0, 1e-3)
    for row in rows:
        half = 0.5 * ROBOT.track_m * row.w_rad_s
        rims = (row.v_m_s - half, row.v_m_s + half)
        powers.append(row.torque_nm @ rims / ROBOT.wheel_radius_m)
    work = sum(0.5 * 1e-3 * (one + other) for one, other in pairwise(powers))
    held = 0.5 * (ROBOT.mass_kg * rows[-1].v_m_s ** 2 + ROBOT.yaw_inertia_kg_m2 * rows[-1].w_rad_s ** 2)
    assert held > 1e-3
    assert work == pytest.approx(held, rel=1e-5)


def test_limits_hold_for_demands_and_speeds():
    limits = Limits(max_v_m_s=0.05, max_w_rad_s=0.5, max_v_dot_m_s2=0.2, max_w_dot_rad_s2=2.0)
    rows = swayed(1.0, 1e-3, limits=limits)
    assert max(abs(row.demand[0]) for row in rows) == 0.2
    assert 0.05 <= max(row.v_m_s for row in rows) < 0.0503
    assert 0.5 <= max(row.w_rad_s for row in rows) < 0.503
