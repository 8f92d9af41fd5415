"""Equations (11), (12), (13) and (18) to (23) as identities of numbers, and the term that the layer adds to V'."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from miro_host.laws.yang_kim import sign
from miro_host.posture import Posture
from miro_host.references.arc import Arc, StraightLine
from mirotwin.recording.theory.track import HALF_PI, across, radius
from tests.host.driving import ANY_PATH, POSTURES, SPEEDS, TURNS, later
from tests.host.theory import stability
from tests.host.theory.ideal import PRINTED
from tests.host.theory.paper_law import YangKim
from tests.host.theory.stability import NO_GUARD, SLOPED, rates, rising, states

TIMES = st.floats(0.1, 0.4) | st.floats(0.6, 5.8)  # not on the corner of the ramp
F1, F2 = st.floats(-0.35, 0.35), st.floats(-1.2, 1.2)


def near_no_seam(e):
    return all(abs(abs(angle) - math.pi) > 1e-3 for angle in (e.phi_e_rad, e.theta_e_rad))


@given(
    ANY_PATH,
    TIMES,
    POSTURES,
    SPEEDS,
    TURNS,
    st.floats(-5.0, 5.0),
    st.floats(-20.0, 20.0),
    st.sampled_from((0.0, 0.5)),
)
def test_the_rates_of_the_errors_and_surfaces_are_their_differences_along_the_motion(
    path, t, posture, v, w, v_dot, w_dot, layer_rad
):
    """(9), (13) and (18) beside central differences, with sgn(theta_e) and with a boundary layer."""
    assume(radius(posture) > 0.05)
    e = stability.polar_errors(path.at(t), posture, v, w)
    assume(near_no_seam(e) and abs(e.phi_e_rad) > 1e-2 and abs(e.theta_e_rad) > 1e-2)
    assume(abs(abs(e.theta_e_rad) - layer_rad) > 1e-2)
    dt, gammas = 1e-5, (1.7, 3.0)
    before, after = (
        stability.polar_errors(
            path.at(t + h), later(posture, v, w, h, v_dot, w_dot), v + h * v_dot, w + h * w_dot
        )
        for h in (-dt, dt)
    )
    scale = (1.0 + abs(v) / radius(posture) + abs(w)) ** 3 * (1.0 + abs(v_dot) + abs(w_dot))
    rates_of_errors = np.subtract(after[:3], before[:3]) / (2 * dt)
    assert rates_of_errors == pytest.approx(np.array(e[3:6]), abs=1e-5 * scale)
    one, two = (stability.surfaces(x, gammas, layer_rad) for x in (before, after))
    found = stability.surface_rates(e, path.at(t), (v_dot, w_dot), gammas, layer_rad)
    assert np.subtract(two, one) / (2 * dt) == pytest.approx(np.array(found), abs=1e-5 * scale)


@given(ANY_PATH, TIMES, POSTURES, SPEEDS, TURNS, F1, F2)
def test_as_printed_v_falls_exactly_as_equation_23_says_wherever_theta_e_is_not_0(
    path, t, posture, v, w, f1, f2
):
    """With the sign function and without guards: (18) to (22) put together. V' <= 0, because P_i >= |f_i|."""
    assume(radius(posture) > 0.02)
    assume(abs(math.cos(HALF_PI - across(posture))) > 0.02)
    s, s_rate, e, by_proof = rates(PRINTED, path, t, posture, v, w, (f1, f2))
    assume(e.theta_e_rad != 0.0 and e.phi_e_rad != 0.0 and near_no_seam(e))
    rate = stability.lyapunov_rate(s, s_rate)
    assert rate == pytest.approx(by_proof, rel=1e-6, abs=1e-7 * (1.0 + abs(s[0]) + abs(s[1])) * 100.0)
    assert by_proof <= 0.0


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), F1, F2, st.floats(-1.0, 1.0))
def test_with_gains_below_f_the_proofs_rate_still_falls_outside_of_reach(s1, s2, f1, f2, cosine):
    """So the paper's law has a bounded error even where (17) is broken: |s_i| ends within (f_i - P_i) / Q_i."""
    q, p = (0.53, 0.72), (0.1, 0.3)
    far = [stability.reach(p[0], q[0], abs(f1)), stability.reach(p[1], q[1], abs(f2))]
    assume(abs(s1) >= far[0] and abs(s2) >= far[1])
    assert stability.proof_rate((s1, s2), (sign(s1), sign(s2)), q, p, (f1, f2), cosine) <= 1e-12


@given(st.floats(0.3, 0.9), st.floats(-1.2, 1.2), st.floats(-3.0, 3.0))
def test_where_theta_e_crosses_0_v_jumps_by_the_product_that_the_proof_drops(rho, phi_e, turn):
    assume(abs(turn) > 1e-3 and abs(phi_e) > 1e-3)
    r, law = StraightLine().at(3.0), YangKim(PRINTED)
    x, y, towards = rho * math.cos(phi_e), rho * math.sin(phi_e), math.copysign(1e-10, turn)
    before, after = (law.control(r, Posture(x, y, side), 0.2, turn) for side in (-towards, towards))
    rise = stability.lyapunov(after.s1, after.s2) - stability.lyapunov(before.s1, before.s2)
    assert rise == pytest.approx(stability.jump(turn, phi_e), rel=1e-5)


# The boundary layer of remark 2.


@given(ANY_PATH, TIMES, POSTURES, SPEEDS, TURNS, st.sampled_from((NO_GUARD, SLOPED)))
def test_inside_the_layer_v_has_one_term_more_than_equation_23_unless_u2_has_its_derivative(
    path, t, posture, v, w, gains
):
    assume(radius(posture) > 0.05)
    assume(abs(across(posture)) > 0.8)  # far from the guard of the cosine
    s, s_rate, e, by_proof = rates(gains, path, t, posture, v, w)
    assume(near_no_seam(e) and e.phi_e_rad != 0.0)
    more = 0.0 if gains is SLOPED else s[1] * stability.layer_term(e, gains.layer_theta_rad)
    scale = 1.0 + abs(s[0]) + abs(s[1])
    assert stability.lyapunov_rate(s, s_rate) == pytest.approx(by_proof + more, abs=1e-6 * scale * scale)


def test_v_rises_in_many_states_inside_the_layer_and_in_none_when_u2_has_its_derivative():
    assert 0.3 < rising(NO_GUARD) < 0.95
    assert rising(SLOPED) == 0


def test_outside_of_the_layer_v_never_rises():
    for state in states(2000, 1.2, seed=4):
        s, s_rate, e, _ = rates(NO_GUARD, *state)
        if abs(e.theta_e_rad) > NO_GUARD.layer_theta_rad:
            assert stability.lyapunov_rate(s, s_rate) < 1e-9


# Assumptions 2 and 3.


@given(POSTURES, st.integers(-3, 3))
def test_across_is_the_left_side_of_equation_12_with_the_sign_of_the_cosine(posture, turns):
    assume(radius(posture) > 1e-3)
    phi = math.atan2(posture.y_m, posture.x_m)
    by_12 = min(abs(abs(phi - posture.theta_rad) - (2 * m + 1) * HALF_PI) for m in (0, 1))
    unwrapped = Posture(posture.x_m, posture.y_m, posture.theta_rad + turns * 2.0 * math.pi)
    assert abs(across(unwrapped)) == pytest.approx(by_12, abs=1e-9)
    assume(by_12 > 1e-6)
    assert math.copysign(1.0, across(posture)) == math.copysign(1.0, math.cos(phi - posture.theta_rad))


@pytest.mark.parametrize("path", [StraightLine(), Arc()])
def test_the_references_of_the_figures_keep_assumption_2_and_stay_away_from_assumption_3(path):
    assert path.at(0.0).rho_m == 0.0
    for index in range(1, 600):
        r = path.at(0.01 * index)
        assert r.rho_m > 0.0
        assert across(r.posture) > 0.9


# Remark 1.


@given(st.floats(0.02, 1.5), st.floats(0.1, 0.9))
def test_u1_grows_like_one_over_the_sine_of_alpha(alpha, rho):
    """A robot at rest, alpha away from assumption 3's limit: u1 + v_r' is the braces of (16) over sin(alpha)."""
    r = StraightLine().at(3.0)
    law = YangKim(PRINTED)
    u1 = law.control(r, Posture(rho, 0.0, HALF_PI - alpha), 0.0, 0.0).u1
    e = stability.polar_errors(r, Posture(rho, 0.0, HALF_PI - alpha), 0.0, 0.0)
    s1 = e.rho_e_rate + 1.7 * e.rho_e_m
    braces = -0.53 * s1 - 0.35 * sign(s1) - 1.7 * e.rho_e_rate
    assert u1 * math.sin(alpha) == pytest.approx(braces, rel=1e-6, abs=1e-9)


@pytest.mark.slow
@given(ANY_PATH, TIMES, POSTURES, SPEEDS, TURNS, F1)
def test_f1_moves_s1_by_its_part_along_the_line_of_sight_only(path, t, posture, v, w, f1):
    """What remark 1 sets against that: near the limit f1 counts as little as u1."""
    assume(radius(posture) > 0.02)
    e, r = stability.polar_errors(path.at(t), posture, v, w), path.at(t)
    calm, pushed = (stability.surface_rates(e, r, (0.3 - f, 0.0), (1.7, 3.0))[0] for f in (0.0, f1))
    assert calm - pushed == pytest.approx(f1 * math.sin(across(posture)), abs=1e-9)
