"""The extended Kalman filter: what it learns, what it refuses, what it bridges, and what it remembers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.host.followed_robot import DELAY_S, TRACK_M, Loop, P, Robot, rims, truths, velocities
from tests.naive import kalman

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.state import restore, snapshot
from miro_host.estimators.ekf import KEPT, REFUSED, EkfParameters
from miro_host.estimators.interface import EstimatorInput
from miro_host.eye.track import Sighting
from miro_host.laws.yang_kim import Gains
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.line import Line


def apart_m(estimate, truth):
    return math.hypot(estimate.posture.x_m - truth.x_m, estimate.posture.y_m - truth.y_m)


def matrix(one):
    return np.array(one.covariance).reshape(5, 5)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.05, 0.95), (0.96, 1.03)])
def test_without_noise_the_wheel_factors_and_the_posture_become_the_true_ones(factors):
    loop = Loop(EkfParameters(wheel_spread=0.05).estimator(), Robot(*factors))
    estimates = loop.run(120)
    assert loop.filter.left_factor == pytest.approx(factors[0], abs=5e-4)
    assert loop.filter.right_factor == pytest.approx(factors[1], abs=5e-4)
    for index, truth in list(enumerate(truths(120, *factors)))[60:]:
        assert estimates[index].t_s == index * PERIOD_S + DELAY_S
        assert apart_m(estimates[index], truth) < 2e-4
        assert abs(math.remainder(estimates[index].posture.theta_rad - truth.theta_rad, math.tau)) < 2e-3


def test_nothing_is_known_before_the_first_sighting():
    loop = Loop(P.estimator(), Robot())
    assert loop.period() is None
    assert loop.period() is not None


@pytest.mark.parametrize("lost", [1, 5, KEPT + 9])
def test_lost_frames_are_bridged_by_what_was_commanded(lost):
    loop = Loop(P.estimator(), Robot(), lambda index, seen: None if 60 <= index < 60 + lost else seen)
    estimates = loop.run(61 + lost)
    for index, truth in list(enumerate(truths(60 + lost)))[60:]:
        assert apart_m(estimates[index], truth) < 1e-3


def test_an_uncertain_posture_grows_more_uncertain_while_frames_are_lost():
    loop = Loop(P.estimator(), Robot(), lambda index, seen: None if index > 60 else seen)
    loop.run(60)
    before = matrix(loop.filter)
    loop.run(2 * KEPT)
    assert (np.diag(matrix(loop.filter))[:3] > np.diag(before)[:3]).all()


@pytest.mark.parametrize("aside", [Sighting(0.2, 0.0, 0.0, 0, 1.0), Sighting(0.0, 0.0, 1.0, 0, 1.0)])
def test_an_outlier_is_refused(aside):
    def change(index, seen):
        if index != 60:
            return seen
        return Sighting(
            seen.x_m + aside.x_m,
            seen.y_m,
            math.remainder(seen.theta_rad + aside.theta_rad, math.tau),
            seen.tick,
            1.0,
        )

    loop, clean = Loop(P.estimator(), Robot(), change), Loop(P.estimator(), Robot())
    for _ in range(60):
        assert loop.period() == clean.period()
    assert apart_m(loop.period(), clean.period().posture) < 5e-4
    assert loop.filter.refused == 1
    loop.period()
    assert loop.filter.refused == 0


def test_a_robot_that_was_carried_away_is_found_again_and_its_wheels_are_not_forgotten():
    def change(index, seen):
        if index < 60:
            return seen
        return Sighting(seen.x_m + 0.4, seen.y_m, seen.theta_rad, seen.tick, 1.0)

    loop = Loop(EkfParameters(wheel_spread=0.05).estimator(), Robot(1.04, 0.97), change)
    loop.run(60)
    factors = loop.filter.state[3:]
    estimates = loop.run(REFUSED)
    assert loop.filter.refused == 0
    assert loop.filter.state[3:] == factors
    before, last = truths(60 + REFUSED, 1.04, 0.97)[-2:]
    assert apart_m(estimates[-2], before) < 1e-3
    assert apart_m(estimates[-1], Posture(last.x_m + 0.4, last.y_m, 0.0)) < 1e-3


def test_a_frame_that_comes_twice_is_taken_once():
    frames = {}

    def change(index, seen):
        frames[index] = seen
        return frames[index - 1] if index == 60 else seen

    loop = Loop(P.estimator(), Robot(), change)
    loop.run(60)
    before = loop.filter.at_s, list(loop.filter.state), list(loop.filter.covariance)
    loop.period()
    assert (loop.filter.at_s, loop.filter.state, loop.filter.covariance) == before
    loop.period()
    assert loop.filter.at_s == pytest.approx(60 * PERIOD_S)


def test_a_sighting_of_little_confidence_moves_the_filter_less():
    def corrected(confidence):
        def change(index, seen):
            if index != 60:
                return seen
            return Sighting(seen.x_m + 0.003, seen.y_m, seen.theta_rad, seen.tick, confidence)

        loop = Loop(P.estimator(), Robot(), change)
        return loop.run(61)[-1].posture.x_m

    kept = corrected(0.0) - truths(61)[-1].x_m
    assert abs(kept) < 2e-4
    assert abs(corrected(1.0) - corrected(0.0)) > 5.0 * abs(corrected(0.2) - corrected(0.0))


NOISES = st.lists(
    st.none() | st.tuples(*[st.floats(-1.0, 1.0)] * 3, st.floats(0.0, 1.0)), min_size=40, max_size=40
)


@settings(max_examples=10, deadline=None)
@given(NOISES, st.sampled_from([P, EkfParameters(position_noise_m=1e-6, heading_noise_rad=1e-6)]))
def test_the_covariance_stays_symmetric_and_positive(noises, parameters):
    one = parameters.estimator()
    for index, noise in enumerate(noises):
        seen = None
        if noise is not None:
            tick = (index - 1) * CONTROL_PERIOD_TICKS
            seen = Sighting(noise[0] * 0.02, noise[1] * 0.02, 0.1 * noise[2], tick, noise[3])
        one.step(
            EstimatorInput(index * PERIOD_S, PERIOD_S, seen, *velocities(index), *rims(*velocities(index)))
        )
        covariance = matrix(one)
        assert (covariance == covariance.T).all()
        assert not one.known or np.linalg.eigvalsh(covariance).min() > 0.0
        one.after_load()


RIM = st.tuples(st.floats(-1.0, 1.0), st.floats(-0.1, 0.1)).map(lambda pair: (pair[0], pair[0] + pair[1]))
ASIDE = st.floats(-0.002, 0.002)


@settings(max_examples=10, deadline=None)
@given(RIM, RIM, st.floats(-3.1, 3.1), st.tuples(ASIDE, ASIDE))
def test_one_cycle_agrees_with_the_textbook(left, right, theta, aside):
    """The prediction within 0.1 mm, 1e-6 rad and 0.3 % of the spreads (`motion` says why), the update within 1e-11."""
    one = P.estimator()
    one.known = True
    one.state = [0.1, -0.2, theta, 1.01, 0.98]
    root = np.tril(np.cos(np.arange(25.0).reshape(5, 5))) * np.array([[2e-3, 2e-3, 2e-2, 9e-3, 9e-3]]).T
    covariance = root @ root.T + np.diag([1e-6, 1e-6, 1e-4, 1e-5, 1e-5])
    one.covariance = [float(each) for each in (0.5 * (covariance + covariance.T)).ravel()]
    one.left_start_m_s[0], one.left_to_m_s[0] = left
    one.right_start_m_s[0], one.right_to_m_s[0] = right

    end_s = 0.8 * PERIOD_S
    one.at_s = 1.0 + DELAY_S - PERIOD_S
    given_ = EstimatorInput(1.0, PERIOD_S, None, 0.0, 0.0, 0.0, 0.0)

    def drive(state):
        return kalman.moved(state, left, right, P.slope_m_s2, 0.0, end_s, TRACK_M, steps=300)

    start = np.array(one.state)
    by = kalman.derivative(drive, start)
    drift = [P.position_drift_m, P.position_drift_m, P.heading_drift_rad, P.wheel_drift, P.wheel_drift]
    state, covariance = drive(start), kalman.predicted(matrix(one), by, drift, end_s)
    one._predict(one.at_s + end_s, given_)
    agree(one, state, covariance, 1e-4, 1e-6, 3e-3)

    noise = [1e-6, 1e-6, 4e-4]
    measured = [state[0] + aside[0], state[1] - aside[0], state[2] + 10.0 * aside[1]]
    state, covariance, distance = kalman.updated(np.array(one.state), matrix(one), measured, noise)
    assert one._update(Posture(*measured), noise) == (distance <= P.gate)
    if distance <= P.gate:
        agree(one, state, covariance, 1e-11, 1e-11, 1e-11)


def agree(one, state, covariance, within_m, within_rad, within_spreads):
    off = np.array(one.state) - state
    assert math.hypot(off[0], off[1]) < within_m
    assert abs(math.remainder(off[2], math.tau)) < within_rad
    assert np.abs(off[3:]).max() < 1e-11
    spread = np.sqrt(np.diag(covariance))
    assert (np.abs(matrix(one) - covariance) < within_spreads * np.outer(spread, spread)).all()


def test_a_filter_saved_at_any_period_goes_on_with_the_same_bits():
    def pilot():
        return Pilot(Line(), Gains().law(), estimator=P.estimator())

    whole, cut = pilot(), pilot()
    for k in range(40):
        again = pilot()
        restore(again, snapshot(cut))
        cut = again
        seen = None if k in (0, 7, 8) else Posture(0.005 * k, 0.01 * math.sin(k), 0.02 * math.cos(k))
        assert cut.update(seen, k * PERIOD_S) == whole.update(seen, k * PERIOD_S)
        assert snapshot(cut) == snapshot(whole)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("covariance", [1.0, 0.5, *[0.0] * 23], "the covariance is not symmetric"),
        ("covariance", [0.0] * 25, "the covariance is not positive definite"),
        ("state", [0.0, 0.0, 0.0, 0.1, 1.0], "those of no robot"),
        ("state", [0.0, 0.0, 7.0, 1.0, 1.0], "not between -pi and pi"),
        ("refused", REFUSED, "measurements in a row"),
    ],
)
def test_a_memory_that_no_step_leaves_is_refused(name, value, reason):
    one = P.estimator()
    one.known = True
    one.covariance = [float(each) for each in np.eye(5).ravel()]
    setattr(one, name, value)
    with pytest.raises(ValueError, match=reason):
        one.after_load()


@pytest.mark.parametrize(("name", "value"), [("age_s", 0.3), ("position_noise_m", 0.0), ("gate", math.nan)])
def test_a_parameter_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
        EkfParameters(**{name: value})
