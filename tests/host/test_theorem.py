"""What the paper proves about its law, and what it does not, in a loop without delay or noise."""

import math
from itertools import pairwise

import pytest
from tests.naive.host_ideal_loop import drive

from miro_host.laws.yang_kim import Gains, YangKim
from miro_host.posture import Posture
from miro_host.reference import Arc, Line

GAINS = Gains(1.7, 3.0, 0.53, 0.72, 0.35, 1.2, switching="sign", cosine_guard=0.0)
STEP_S = 1e-4


def lyapunov(control):
    return 0.5 * (control.s1 * control.s1 + control.s2 * control.s2)


def steps(rows):
    """(V, V of the next row, both rows) where no switching surface is crossed or touched in between."""
    for one, two in pairwise(rows):
        yield lyapunov(one.control), lyapunov(two.control), one.control, two.control


def on_the_way(path, t, x_e, y_e, theta_e):
    r = path.at(t)
    return (r.posture.x_m + x_e, r.posture.y_m + y_e, r.posture.theta_rad + theta_e), (r.v_m_s, r.w_rad_s)


@pytest.mark.parametrize(
    ("path", "error"),
    [(Line(), (0.07, 0.10, -0.38)), (Arc(), (0.05, -0.06, 0.5)), (Arc(), (0.06, 0.04, -0.3))],
)
def test_the_lyapunov_function_falls_away_from_zero_crossings_of_theta_e(path, error):
    def disturbance(t):  # |f_i| <= P_i, as condition (17) wants it
        return 0.3 * math.sin(7.0 * t), math.sin(11.0 * t)

    posture, z = on_the_way(path, 2.0, *error)
    rows = drive(YangKim(GAINS), path, posture, z, 2.0, 5.0, STEP_S, disturbance)
    chatter = 2.0 * STEP_S  # within a step of the surface, s_i may overshoot it
    falls = 0
    for before, after, one, two in steps(rows):
        if one.theta_e_rad * two.theta_e_rad <= 0.0:
            continue
        if min(abs(one.s1), abs(one.s2)) < chatter * 4.0:
            continue
        assert after - before <= 1e-6
        falls += 1
    assert falls > 1000


def test_at_a_zero_crossing_of_theta_e_it_jumps_by_twice_the_product_of_the_proof_s_gap():
    """The proof drops the derivative of sgn(theta_e): V rises by 2 |theta_e'| |phi_e| there."""
    reference = Line().at(3.0)
    law = YangKim(GAINS)
    phi_e, turn = 0.3, 0.4
    x, y = 0.5 * math.cos(phi_e), 0.5 * math.sin(phi_e)
    before = law.control(reference, Posture(x, y, -1e-9), 0.2, turn)
    after = law.control(reference, Posture(x, y, 1e-9), 0.2, turn)
    assert lyapunov(after) - lyapunov(before) == pytest.approx(2.0 * turn * phi_e, rel=1e-6)


def test_with_the_heading_right_the_robot_runs_parallel_to_the_line_for_ever():
    """Theta_e = 0, 4 cm beside the line: the law answers with no turn at all, phi_e falls like 1 / rho."""
    path = Line()
    posture, z = on_the_way(path, 0.75, 0.0, 0.04, 0.0)
    rows = drive(YangKim(GAINS), path, posture, z, 0.75, 6.0)
    assert {row.control.u2 for row in rows} == {0.0}
    assert abs(rows[-1].posture.y_m - 0.04) < 0.0002
    first, last = (row.control.phi_e_rad for row in (rows[0], rows[-1]))
    assert first == pytest.approx(math.atan(0.4), rel=1e-9)
    assert last < 0.1 * first
    for row in rows[:: len(rows) // 10]:
        rho_c = math.hypot(row.posture.x_m, row.posture.y_m)
        assert rho_c * math.sin(row.control.phi_e_rad) == pytest.approx(0.04, rel=1e-9)


def test_the_final_lateral_error_follows_the_initial_one_with_slope_one():
    """No lateral feedback: two robots that start 2 cm apart beside each other end about as far apart."""
    ends = []
    for side in (0.03, 0.05):
        path = Line()
        posture, z = on_the_way(path, 1.5, 0.0, side, 0.05)
        rows = drive(YangKim(GAINS), path, posture, z, 1.5, 5.0)
        ends.append(rows[-1].posture.y_m)
    assert 0.8 < (ends[1] - ends[0]) / 0.02 < 1.2


def test_without_disturbance_both_surfaces_and_the_heading_error_go_to_zero():
    path = Arc()
    posture, z = on_the_way(path, 1.0, 0.05, 0.03, 0.3)
    last = drive(YangKim(GAINS), path, posture, z, 1.0, 5.9)[-1].control
    assert abs(last.s1) < 1e-3
    assert abs(last.rho_e_m) < 1e-3
    assert abs(last.theta_e_rad) < 0.01
