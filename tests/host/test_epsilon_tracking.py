"""The reconstructed epsilon-tracking law: its twin in 40 digits, what its theory promises, and its memory of turns."""

import math

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_host.laws.epsilon_tracking import (
    ILLUSTRATIVE,
    RETUNED,
    THEORY,
    EpsilonTracking,
    point,
)
from miro_host.laws.interface import LawInput
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.arc import Arc, StraightLine
from tests.host.driving import ANY_PATH, POSTURES, SPEEDS, TIMES, TURNS, apart, drive, later
from tests.naive import host_laws as naive
from tests.naive.host_ideal_loop import drive_at_velocities

SETS = [THEORY, ILLUSTRATIVE, RETUNED]
NAMES = ["theory", "illustrative", "retuned"]


def asked(law, path, t, posture):
    return law.step(LawInput(t, PERIOD_S, path.at(t), path, posture, 0.0, 0.0))


def beside(path, x_m, y_m, theta_rad):
    """A posture with these errors against the reference's start."""
    at = path.at(0.0).posture
    return at.x_m + x_m, at.y_m + y_m, at.theta_rad + theta_rad


# The equations.


@pytest.mark.parametrize("gains", SETS, ids=NAMES)
@settings(max_examples=60)
@given(ANY_PATH, TIMES, POSTURES)
def test_velocities_equal_those_of_the_formula_in_complex_numbers(gains, path, t, posture):
    r, law = path.at(t), EpsilonTracking(gains)
    answer = asked(law, path, t, posture)
    named = {"epsilon": gains.epsilon_rad, "alpha": gains.alpha_per_s, "beta": gains.beta_per_s}
    width = gains.layer_sigma_rad2 if gains.switching == "saturation" else None
    named |= {"length": gains.length_m, "invariant": gains.sigma == "invariant", "width": width}
    robot = posture.x_m, posture.y_m, law.theta_rad
    at = r.posture.x_m, r.posture.y_m, law.reference_rad
    v, w, sigma = naive.epsilon_tracking(named, robot, at, (r.v_m_s, r.w_rad_s))
    assume(abs(sigma) > 1e-9)
    assert answer.inner["sigma_rad2"] == pytest.approx(float(sigma), rel=1e-9, abs=1e-9)
    assert (answer.v_m_s, answer.w_rad_s) == pytest.approx((float(v), float(w)), rel=1e-9, abs=1e-9)


@given(POSTURES, SPEEDS, TURNS)
def test_the_transformed_unicycle_is_the_nonholonomic_integrator(posture, v, w):
    """x1' = u1, x2' = u2, x3' = x1 u2 - x2 u1 with u1 = w, u2 = v / L - z3 w, by central differences."""
    length, h = 0.2, 1e-5

    def at(dt):
        there = later(posture, v, w, dt)
        return point(there, posture.theta_rad + dt * w, length)

    here, before, after = at(0.0), at(-h), at(h)
    u1, u2 = w, v / length - here.z3 * w
    rates = [(getattr(after, name) - getattr(before, name)) / (2 * h) for name in ("x1", "x2", "x3")]
    assert rates == pytest.approx([u1, u2, here.x1 * u2 - here.x2 * u1], abs=1e-6)


@given(ANY_PATH, st.floats(0.6, 5.8), POSTURES)
def test_the_invariant_sigma_falls_as_the_docstring_says(path, t, posture):
    g = msgspec.structs.replace(THEORY, max_v_m_s=1e6, max_w_rad_s=1e6)
    law = EpsilonTracking(g)
    answer, r = asked(law, path, t, posture), path.at(t)
    n, sigma = answer.inner["n_rad"], answer.inner["sigma_rad2"]
    h = 1e-6
    assume(abs(sigma) > 1e-2)

    def sigma_at(dt):
        there = later(posture, answer.v_m_s, answer.w_rad_s, dt)
        other = EpsilonTracking(g)
        other.begun, other.theta_rad, other.reference_rad = True, law.theta_rad, law.reference_rad
        return asked(other, path, t + dt, there).inner["sigma_rad2"]

    e1, e2 = answer.inner["e1_rad"], answer.inner["e2_rad"]
    u2_r = r.v_m_s / g.length_m - point(r.posture, law.reference_rad, g.length_m).z3 * r.w_rad_s
    expected = -g.beta_per_s * n * n * math.copysign(1.0, sigma) + 2.0 * (e1 * u2_r - e2 * r.w_rad_s)
    scale = 1.0 + answer.w_rad_s**2 + answer.v_m_s**2
    assert (sigma_at(h) - sigma_at(-h)) / (2 * h) == pytest.approx(expected, rel=1e-4, abs=1e-5 * scale)


def test_the_robot_on_the_reference_is_driven_out_to_the_circle_and_not_along():
    """At e = 0 neither pull nor rotation acts: the answer is the reference's own velocity."""
    for gains in SETS:
        r = Arc().at(3.0)
        answer = asked(EpsilonTracking(gains), Arc(), 3.0, r.posture)
        assert (answer.v_m_s, answer.w_rad_s) == pytest.approx((r.v_m_s, r.w_rad_s), abs=1e-12)


# What the theory promises, in continuous time.


@pytest.mark.slow
@pytest.mark.parametrize("path", [StraightLine(), Arc()], ids=["line", "arc"])
@pytest.mark.parametrize("start", [(0.0243, 0.0308, -0.96), (0.0292, 0.0185, 0.56), (0.0709, 0.0172, -0.38)])
def test_with_the_theory_s_gains_sigma_vanishes_and_n_holds_epsilon_in_continuous_time(path, start):
    """beta epsilon > 2 |u*|: after 4 s both have long settled, n on the circle of radius epsilon, sigma at 0."""
    rows = drive_at_velocities(EpsilonTracking(THEORY), path, beside(path, *start), 0.0, 6.0, 2e-4)
    last = rows[len(rows) * 2 // 3 :]
    u_r = max(math.hypot(row.reference.w_rad_s, row.reference.v_m_s / THEORY.length_m) for row in last)
    assert THEORY.beta_per_s * THEORY.epsilon_rad > 2.0 * u_r
    for row in last:
        assert row.control.inner["n_rad"] == pytest.approx(THEORY.epsilon_rad, rel=0.03)
        assert abs(row.control.inner["sigma_rad2"]) < 0.1 * THEORY.epsilon_rad**2
        robot, at = row.posture, row.reference.posture
        away = math.hypot(robot.x_m - at.x_m, robot.y_m - at.y_m)
        lever = 1.0 + math.hypot(at.x_m, at.y_m) / THEORY.length_m
        assert away < 1.2 * THEORY.epsilon_rad * THEORY.length_m * lever


def test_with_the_condition_broken_sigma_does_not_vanish():
    """The condition is what holds sigma: with a tenth of beta it wanders off from the circle's promise."""
    weak = msgspec.structs.replace(THEORY, beta_per_s=0.5)
    rows = drive_at_velocities(
        EpsilonTracking(weak), StraightLine(), beside(StraightLine(), 0.0243, 0.0308, -0.96), 0.0, 6.0
    )
    assert max(abs(row.control.inner["sigma_rad2"]) for row in rows[-1000:]) > 0.1 * weak.epsilon_rad**2


def test_once_a_period_the_theory_s_gains_do_not_hold():
    """The same law, robot and gains, asked 30 times a second: 22/s of rotation is 0.7 rad a period."""
    fast = msgspec.structs.replace(
        THEORY, max_v_m_s=10.0, max_w_rad_s=100.0, max_v_dot_m_s2=1e4, max_w_dot_rad_s2=1e5
    )
    start = Posture(*beside(StraightLine(), 0.0243, 0.0308, -0.96))
    errors = [apart(truth, r)[0] for _, truth, r in drive(EpsilonTracking(fast), StraightLine(), start, 178)]
    assert max(errors[-30:]) > 0.10


@pytest.mark.parametrize("path", [StraightLine(), Arc()], ids=["line", "arc"])
def test_the_retuned_gains_track_without_delay_or_noise(path):
    """On the arc 3 cm remain: with so small a beta sigma does not come to 0 while x* turns."""
    for start in ((0.0243, 0.0308, -0.96), (0.0292, 0.0185, 0.56), (0.0709, 0.0172, -0.38)):
        *_, (_, truth, reference) = drive(RETUNED.law(), path, Posture(*beside(path, *start)), 178)
        distance, turn = apart(truth, reference)
        assert distance < 0.035
        assert turn < 0.1


# The memory of turns.


@given(st.floats(-3.0, 3.0), st.integers(-3, 3))
def test_the_first_heading_is_taken_within_half_a_turn_of_the_reference(theta_rad, turns):
    law = EpsilonTracking(RETUNED)
    asked(law, StraightLine(), 1.0, Posture(0.2, 0.0, theta_rad + turns * 2.0 * math.pi))
    assert law.theta_rad == pytest.approx(theta_rad, abs=1e-12)


def test_headings_go_on_through_pi():
    """A robot and a reference that turn on count their turns: no jump of 2 pi in x1."""
    law, path = EpsilonTracking(RETUNED), StraightLine(heading_rad=3.0)
    for k in range(40):
        asked(law, path, 1.0 + k * PERIOD_S, Posture(0.2, 0.0, math.remainder(3.0 + 0.2 * k, 2.0 * math.pi)))
        assert law.theta_rad == pytest.approx(3.0 + 0.2 * k, abs=1e-12)
    assert law.reference_rad == pytest.approx(3.0, abs=1e-12)


@given(st.sampled_from(SETS), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3.14, 3.14))
def test_far_away_the_answer_is_finite_and_the_command_within_the_limits(gains, x, y, theta):
    command = Pilot(Arc(), gains.law()).update(Posture(x, y, theta), 1.0)
    assert abs(command.v_m_s) <= gains.max_v_m_s
    assert abs(command.w_rad_s) <= gains.max_w_rad_s
