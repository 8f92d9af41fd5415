"""The extended Kalman filter: what it learns, what it refuses, what it bridges, and what it remembers."""

import math
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Meta

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.state import restore, snapshot
from miro_host.estimators.ekf import REFUSED, SEEN_NOISE, TOLD_NOISE, EkfParameters
from miro_host.estimators.interface import EstimatorInput
from miro_host.estimators.motion import KEPT
from miro_host.eye.track import Sighting
from miro_host.laws.yang_kim import Gains
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.line import StraightLine
from tests.host.followed_robot import DELAY_S, Loop, P, Robot, rims, truths, velocities


def apart_m(estimate, truth):
    return math.hypot(estimate.posture.x_m - truth.x_m, estimate.posture.y_m - truth.y_m)


def matrix(one):
    return np.array(one.covariance).reshape(9, 9)[:5, :5]


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.05, 0.95), (0.96, 1.03)])
def test_without_noise_the_wheel_factors_and_the_posture_become_the_true_ones(factors):
    loop = Loop(EkfParameters(wheel_spread=0.05).estimator(), Robot(*factors))
    estimates = loop.run(120)
    assert loop.filter.state[3] == pytest.approx(factors[0], abs=5e-4)
    assert loop.filter.state[4] == pytest.approx(factors[1], abs=5e-4)
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
    assert loop.estimator.refused == 1
    loop.period()
    assert loop.estimator.refused == 0


def test_a_robot_that_was_carried_away_is_found_again_and_its_wheels_are_not_forgotten():
    def change(index, seen):
        if index < 60:
            return seen
        return Sighting(seen.x_m + 0.4, seen.y_m, seen.theta_rad, seen.tick, 1.0)

    loop = Loop(EkfParameters(wheel_spread=0.05).estimator(), Robot(1.04, 0.97), change)
    loop.run(60)
    factors = loop.filter.state[3:5]
    estimates = loop.run(REFUSED)
    assert loop.estimator.refused == 0
    assert loop.filter.state[3:5] == factors
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


@settings(max_examples=10)
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
        covariance = matrix(one.filter)
        assert (covariance == covariance.T).all()
        assert not one.filter.known or np.linalg.eigvalsh(covariance).min() > 0.0
        one.filter.after_load()


@pytest.mark.parametrize("missing", [None, 60])
def test_a_command_that_is_lost_is_doubted_as_much_as_it_changes(missing):
    """With the doubt, the wheels are not blamed for what the radio did."""

    def worst(doubt):
        loop = Loop(EkfParameters(doubt=doubt, heading_noise_rad=0.01).estimator(), Robot())
        loop.robot.loses = missing
        off = []
        for _ in range(120):
            loop.period()
            off.append(max(abs(factor - 1.0) for factor in list(loop.filter.state)[3:5]))
        return max(off[60:])

    if missing is None:
        assert worst(P.doubt) < 1e-3
    else:
        assert worst(P.doubt) < 0.7 * worst(0.0)


def test_the_delay_is_that_of_the_network_unless_it_is_given():
    for parameters, dead_s in ((P, 0.04), (EkfParameters(dead_s=0.02), 0.02)):
        estimate = parameters.estimator().step(
            EstimatorInput(1.0, PERIOD_S, Posture(0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, None, 0.04)
        )
        assert estimate.t_s == 1.0 + (dead_s + parameters.lag_s)


def test_a_plain_posture_is_believed_as_little_as_the_papers_camera():
    assert P.noise(Posture(0.0, 0.0, 0.0)) == TOLD_NOISE
    assert P.noise(Sighting(0.0, 0.0, 0.0, 0, 1.0)) == SEEN_NOISE
    given_ = EkfParameters(position_noise_m=0.004)
    assert given_.noise(Posture(0.0, 0.0, 0.0)) == (0.004, TOLD_NOISE[1])


def test_a_filter_saved_at_any_period_goes_on_with_the_same_bits():
    def pilot():
        return Pilot(StraightLine(), Gains().law(), estimator=P.estimator())

    whole, cut = pilot(), pilot()
    for k in range(40):
        again = pilot()
        restore(again, snapshot(cut))
        cut = again
        seen = None if k in (0, 7, 8) else Posture(0.005 * k, 0.01 * math.sin(k), 0.02 * math.cos(k))
        assert cut.update(seen, k * PERIOD_S) == whole.update(seen, k * PERIOD_S)
        assert snapshot(cut) == snapshot(whole)


SINGULAR = [0.0] * 81
ASYMMETRIC = [1.0, 0.5, *[0.0] * 79]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("covariance", ASYMMETRIC, "the covariance is not symmetric"),
        ("covariance", SINGULAR, "the covariance is not positive definite"),
        ("state", [0.0, 0.0, 0.0, 0.1, 1.0, *[0.0] * 4], "those of no robot"),
        ("state", [0.0, 0.0, 7.0, 1.0, 1.0, *[0.0] * 4], "not between -pi and pi"),
    ],
)
def test_a_memory_that_no_step_leaves_is_refused(name, value, reason):
    one = P.estimator().filter
    one.known = 1
    one.covariance = [float(each) for each in np.eye(9).ravel()]
    one.after_load()
    setattr(one, name, value)
    with pytest.raises(ValueError, match=reason):
        one.after_load()


def test_a_row_of_refusals_that_no_step_leaves_is_refused():
    one = P.estimator()
    one.refused = REFUSED
    with pytest.raises(ValueError, match="measurements in a row"):
        one.after_load()


def test_a_number_that_is_not_finite_is_found():
    for name, length in (("state", 9), ("covariance", 81)):
        one = P.estimator()
        setattr(one.filter, name, [*[0.0] * (length - 1), math.nan])
        with pytest.raises(ValueError, match="not finite"):
            one.check_memory()


@pytest.mark.parametrize(("name", "value"), [("age_s", 0.3), ("position_noise_m", 0.0), ("gate", math.nan)])
def test_a_parameter_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
        EkfParameters(**{name: value})


def test_a_derived_filter_may_have_keys_with_one_bound_or_none():
    class Own(EkfParameters, frozen=True, kw_only=True, tag="own"):
        length_m: Annotated[float, Meta(gt=0.0)] = 0.1
        least_m: Annotated[float, Meta(ge=0.0), "where nothing is sure"] = 0.1

    assert Own(length_m=2.0, least_m=3.0).length_m == 2.0
    with pytest.raises(ValueError, match="gate"):
        Own(gate=0.0)
