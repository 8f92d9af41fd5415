"""Posture estimators: the paper's loop without one, and prediction through the dead time."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_host.estimators.interface import Estimate, Estimator, EstimatorInput, EstimatorParameters
from miro_host.estimators.predict import NoEstimator, PredictParameters, moved
from miro_host.laws.kanayama import KanayamaParameters
from miro_host.laws.yang_kim import Gains
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_host.wheels import Wheels
from tests.states import restore, snapshot

HERE = Posture(0.07, 0.02, -0.38)
COMMANDS = st.lists(st.tuples(st.floats(-0.9, 0.9), st.floats(-4.0, 4.0)), min_size=20, max_size=20)


def near(one, other, within=1e-9):
    turn = math.remainder(one.theta_rad - other.theta_rad, math.tau)
    return max(abs(one.x_m - other.x_m), abs(one.y_m - other.y_m), abs(turn)) < within


@given(st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_an_arc_ends_where_many_small_steps_end(length_m, turn_rad, theta_rad):
    steps, x, y = 2000, 0.1, -0.2
    for index in range(steps):
        middle = theta_rad + turn_rad * (index + 0.5) / steps
        x += length_m / steps * math.cos(middle)
        y += length_m / steps * math.sin(middle)
    ended = moved(Posture(0.1, -0.2, theta_rad), length_m, turn_rad)
    assert near(ended, Posture(x, y, theta_rad + turn_rad), 1e-6)


def test_without_an_estimator_a_measurement_is_the_posture_at_its_arrival():
    one = NoEstimator().estimator()
    assert one.step(EstimatorInput(0.5, PERIOD_S, HERE, 0.2, 0.0, 0.2, 0.2)) == Estimate(0.5, HERE)
    assert one.step(EstimatorInput(0.5, PERIOD_S, None, 0.2, 0.0, 0.2, 0.2)) is None


def truth_at(time_s, commands, ahead_s):
    """Posture of a robot that does at once what was commanded `ahead_s` before, from rest in the origin."""
    posture = Posture(0.0, 0.0, 0.0)
    edges = [index * PERIOD_S + ahead_s for index in range(len(commands) + 1)]
    for (begin_s, end_s), (v_m_s, w_rad_s) in zip(pairwise(edges), commands, strict=True):
        held_s = min(max(time_s - begin_s, 0.0), end_s - begin_s)
        posture = moved(posture, v_m_s * held_s, w_rad_s * held_s)
    return posture


@given(COMMANDS, st.floats(0.0, 0.25), st.floats(0.0, 0.25))
def test_a_robot_that_follows_at_once_is_where_it_was_predicted(commands, age_s, ahead_s):
    one = PredictParameters(age_s=age_s, ahead_s=ahead_s).estimator()
    before = (0.0, 0.0)
    for index, command in enumerate(commands):
        now_s = index * PERIOD_S
        seen = truth_at(now_s - age_s, commands, ahead_s) if index % 3 else None
        estimate = one.step(EstimatorInput(now_s, PERIOD_S, seen, *before, 0.0, 0.0))
        before = command
        if seen is None:
            assert estimate is None
        else:
            assert estimate.t_s == now_s + ahead_s
            assert near(estimate.posture, truth_at(now_s + ahead_s, commands, ahead_s))


def test_the_law_is_given_the_reference_of_the_time_that_was_predicted():
    plain, led = Gains().law(), Pilot(StraightLine(), Gains().law(), reference_lead_s=0.03)
    one = Pilot(StraightLine(), plain, estimator=PredictParameters(age_s=0.0, ahead_s=0.03).estimator())
    assert one.update(HERE, 1.0) == led.update(HERE, 1.0)  # at rest nothing moves, only the time differs


class Odd(EstimatorParameters, frozen=True, tag="odd"):
    answer: object = None

    def estimator(self):
        return Answering(self)


class Answering(Estimator[Odd]):
    INNER = ("a",)

    def step(self, given):
        return self.parameters.answer


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (
            Estimate(0.0, Posture(math.nan, 0.0, 0.0)),
            "`step` returned x_m = nan, which is not a finite float",
        ),
        (Estimate(math.inf, HERE), "`step` returned t_s = inf, which is not a finite float"),
        (HERE, "which is no Estimate of a Posture"),
    ],
)
def test_an_estimator_that_fails_is_named(answer, reason):
    one = Pilot(StraightLine(), Gains().law(), estimator=Odd(answer).estimator())
    with pytest.raises(
        PluginError,
        match=rf"estimator 'odd' failed: .*{reason} \(.*:\d+ in Answering.step\); mend the estimator",
    ):
        one.update(HERE, 0.0)


def steered(left=1.25, right=0.8, named="a"):
    """A pilot whose estimator knows the wheels, after one period, and its command."""
    knowing = Odd(Estimate(1.0, HERE, left, right, {named: 0.5})).estimator()
    one = Pilot(StraightLine(), KanayamaParameters().law(), estimator=knowing)
    return one, one.update(HERE, 1.0)


def test_the_command_is_divided_by_the_factors_that_an_estimator_knows():
    _, corrected = steered()
    _, plain = steered(left=1.0, right=1.0)
    assert (corrected.v_m_s, corrected.w_rad_s) == (plain.v_m_s, plain.w_rad_s)
    left_m_s, right_m_s = Wheels().split(plain.v_m_s, plain.w_rad_s)
    assert corrected.left == Wheels().counts(left_m_s / 1.25)
    assert corrected.right == Wheels().counts(right_m_s / 0.8)
    assert corrected.left != plain.left


def test_values_that_an_estimator_names_go_with_the_command_and_are_saved():
    one, command = steered()
    assert command.estimate == {"a": 0.5}
    other, _ = steered(named="a", left=1.0)
    restore(other, snapshot(one))
    assert other.command == command


@pytest.mark.parametrize("wrong", [{"left": 0.0}, {"right": 2.5}, {"left": math.nan}, {"named": "b"}])
def test_an_estimator_with_odd_wheels_or_other_names_is_named(wrong):
    with pytest.raises(PluginError, match="estimator 'odd' failed: "):
        steered(**wrong)
