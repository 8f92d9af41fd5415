"""The filter with encoder counts: what they tell, and what becomes of answers that tell nothing."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_exact.state import restore, snapshot
from miro_host.estimators.ekf import EkfParameters
from miro_host.estimators.ekf_telemetry import EkfTelemetryParameters
from miro_host.eye.track import Sighting
from miro_host.telemetry_receiver import TURN, LastTelemetry
from tests.host.followed_robot import Loop, Robot, truths

P = EkfTelemetryParameters()
WITHOUT = EkfParameters(rim_noise_m_s=P.rim_noise_m_s)


def shaken(time_s):
    """Command noise: other speeds every period, up to 0.05 m/s."""
    period = int(time_s * 30.0)
    return 0.05 * math.sin(2.3 * period), 0.05 * math.sin(1.7 * period + 1.0)


def off_m(loop, periods):
    """Root mean square of the position's error at the last exposure."""
    total = 0.0
    for _ in range(periods):
        loop.period()
        total += (loop.filter.state[0] - loop.exposed.x_m) ** 2 + (
            loop.filter.state[1] - loop.exposed.y_m
        ) ** 2
    return math.sqrt(total / periods)


def blurred(index, seen):
    """A camera with 8 mm and 0.03 rad of noise."""
    if seen is None:
        return None
    x, y, theta = (math.sin((7.1 + part) * index * index + part) for part in range(3))
    theta_rad = math.remainder(seen.theta_rad + 0.03 * theta, math.tau)
    return Sighting(seen.x_m + 0.008 * x, seen.y_m + 0.008 * y, theta_rad, seen.tick, 1.0)


def test_counts_tell_what_the_wheels_did_when_they_disobey():
    def error_m(parameters):
        noise = {"position_noise_m": 0.006, "heading_noise_rad": 0.02, "rim_noise_m_s": 0.04}
        loop = Loop(parameters(**noise).estimator(), Robot(), blurred, answers=True)
        loop.robot.disobeys = shaken
        loop.run(20)
        return off_m(loop, 150)

    assert error_m(EkfTelemetryParameters) < 0.85 * error_m(EkfParameters)


def test_without_answers_it_is_the_filter_without_encoders_to_the_last_bit():
    loop, other = Loop(P.estimator(), Robot(1.02, 0.97)), Loop(WITHOUT.estimator(), Robot(1.02, 0.97))
    for estimate, same in zip(loop.run(60)[1:], other.run(60)[1:], strict=True):
        assert estimate.posture == same.posture
        assert (estimate.left_factor, estimate.right_factor) == (same.left_factor, same.right_factor)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.05, 0.95)])
def test_the_wheel_factors_become_the_true_ones(factors):
    loop = Loop(EkfTelemetryParameters(wheel_spread=0.05).estimator(), Robot(*factors), answers=True)
    estimates = loop.run(120)
    assert loop.filter.state[3] == pytest.approx(factors[0], abs=2e-3)
    assert loop.filter.state[4] == pytest.approx(factors[1], abs=2e-3)
    truth = truths(120, *factors)[-1]
    assert math.hypot(estimates[-1].posture.x_m - truth.x_m, estimates[-1].posture.y_m - truth.y_m) < 1e-3


def told_before(change, at=60):
    """Two loops alike, in one of which answers are changed from period `at` on; both after some periods more."""
    loop, same = (Loop(P.estimator(), Robot(), answers=True) for _ in range(2))
    loop.run(at)
    same.run(at)
    loop.tell = change
    return loop, same


def test_a_repeated_answer_and_an_older_one_change_nothing():
    old = Loop(P.estimator(), Robot(), answers=True)
    old.run(10)
    loop, same = told_before(lambda telemetry: None)
    last = LastTelemetry(loop.estimator.telemetry_tick, *loop.telemetry[1:])
    for telemetry in (last, old.telemetry):
        loop.tell = lambda _, told=telemetry: told
        same.tell = lambda _: None
        assert loop.period() == same.period()


def test_an_answer_from_the_future_changes_nothing():
    loop, same = told_before(lambda telemetry: telemetry._replace(tick=NEVER_TICK))
    same.tell = lambda _: None
    assert loop.run(5) == same.run(5)


@pytest.mark.parametrize("turns", [-2, 1, 7])
def test_counts_that_are_off_by_whole_turns_of_the_counter_tell_the_same(turns):
    def change(telemetry):
        left, right = telemetry.position_left + turns * TURN, telemetry.position_right - turns * TURN
        return telemetry._replace(position_left=left, position_right=right)

    loop, same = told_before(change)
    assert loop.run(20) == same.run(20)


def test_a_robot_that_was_reset_is_not_moved_and_counted_on_from_there():
    loop, same = told_before(lambda telemetry: telemetry)
    first = loop.telemetry
    loop.tell = lambda telemetry: telemetry._replace(
        position_left=telemetry.position_left - first.position_left + 20000,
        position_right=telemetry.position_right - first.position_right - 20000,
    )
    for estimate, whole in zip(loop.run(30), same.run(30), strict=True):
        assert (
            math.hypot(estimate.posture.x_m - whole.posture.x_m, estimate.posture.y_m - whole.posture.y_m)
            < 5e-4
        )
    assert loop.estimator.counting
    assert loop.filter.covariance[5 * 9 + 5] < 0.02**2  # known from the last count


def test_a_robot_that_slips_is_followed_and_the_wheels_are_not_blamed():
    """For six periods the robot goes half of what its wheels do, 0.1 m/s less."""

    def slipping(parameters, answers):
        loop = Loop(parameters.estimator(), Robot(), answers=answers)
        loop.robot.follows = lambda time_s: 0.5 if 2.0 < time_s < 2.2 else 1.0
        loop.run(60)
        slip_m_s, factor, off = 0.0, 1.0, 0.0
        for _ in range(20):
            estimate = loop.period()
            slip_m_s = max(slip_m_s, estimate.inner.get("slip_m_s", 0.0))
            factor = min(factor, estimate.left_factor, estimate.right_factor)
            off = max(off, off_m(loop, 1))
        return slip_m_s, 1.0 - factor, off

    slip_m_s, blamed, off = slipping(P, True)
    assert 0.05 < slip_m_s < 0.2
    assert blamed < 0.003
    assert off < 0.003
    assert slipping(WITHOUT, False)[2] > 2.0 * off


def test_without_slip_none_is_found():
    loop = Loop(P.estimator(), Robot(1.005, 0.995), answers=True)
    assert max(abs(estimate.inner["slip_m_s"]) for estimate in loop.run(120)[1:]) == 0.0


def test_a_camera_whose_displacement_changes_along_the_path_is_told_from_large_wheels():
    """A displacement that comes and goes over 0.6 m of way; encoders do not see it."""

    def change(index, seen):
        if seen is None:
            return None
        shown = seen.x_m + 0.01 * math.sin(seen.x_m / 0.1)
        return Sighting(shown, seen.y_m, seen.theta_rad, seen.tick, 1.0)

    known = EkfTelemetryParameters(warp_m=0.007, warp_length_m=0.2, position_drift_m=0.0005)
    loop = Loop(known.estimator(), Robot(), change, answers=True)
    shown, found = [], []
    for index, estimate in enumerate(loop.run(240)):
        if index > 60:
            shown.append(0.01 * math.sin(loop.path[index - 1].x_m / 0.1))
            found.append(estimate.inner["warp_x_m"])
    assert np.corrcoef(shown, found)[0, 1] > 0.7


COUNT = st.integers(-NEVER_TICK, NEVER_TICK) | st.integers(-70000, 70000)
BYTE = st.integers(0, 255)
ANSWERS = st.builds(
    LastTelemetry,
    st.integers(-1, 10**8) | st.integers(0, NEVER_TICK),
    BYTE,
    BYTE,
    BYTE,
    BYTE,
    COUNT,
    COUNT,
    BYTE,
    BYTE,
)


@pytest.mark.slow
@settings(max_examples=20)
@given(st.lists(st.none() | ANSWERS, min_size=40, max_size=40))
def test_whatever_an_answer_says_the_filter_goes_on(answers):
    loop = Loop(EkfTelemetryParameters(warp_m=0.005).estimator(), Robot(), blurred, answers=True)
    loop.tell = lambda telemetry: answers[loop.index % 40] or telemetry
    for _ in range(60):
        loop.period()
        loop.estimator.check_memory()
        loop.filter.after_load()


def test_a_filter_saved_at_any_period_goes_on_with_the_same_bits():
    whole, cut = (Loop(P.estimator(), Robot(), blurred, answers=True) for _ in range(2))
    for _ in range(30):
        again = P.estimator()
        restore(again, snapshot(cut.estimator))
        cut.estimator = again
        assert cut.period() == whole.period()
        assert snapshot(cut.estimator) == snapshot(whole.estimator)


@pytest.mark.parametrize(("name", "value"), [("sampled_s", 0.1), ("warp_length_m", 0.0), ("gate", 0.0)])
def test_a_parameter_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
        EkfTelemetryParameters(**{name: value})
