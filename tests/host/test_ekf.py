"""The extended Kalman filter, with encoder counts and without: what it learns, refuses, bridges and remembers.

It follows a robot with wheels of its own size by a camera one frame late.
"""

import math
from typing import Annotated

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Meta

from miro_exact.clock import CONTROL_PERIOD_TICKS, NEVER_TICK, TICKS_PER_SECOND
from miro_host.estimators.ekf import REFUSED, SEEN_NOISE, TOLD_NOISE, EkfParameters
from miro_host.estimators.ekf_telemetry import METRES_PER_COUNT, EkfTelemetryParameters
from miro_host.estimators.interface import DEAD_S, EstimatorInput
from miro_host.estimators.motion import KEPT
from miro_host.estimators.predict import PredictParameters
from miro_host.eye.track import Sighting
from miro_host.pilot import PERIOD_S
from miro_host.posture import Posture
from miro_host.telemetry_receiver import LastTelemetry
from miro_host.wheels import Wheels
from tests.states import restore, snapshot

TRACK_M = Wheels().track_m
P = EkfParameters()
READ_S = 0.03
"""From a period's begin to the reading of the counts."""
SAMPLED_S = EkfTelemetryParameters().sampled_s
DELAY_S = DEAD_S + P.lag_s


def velocities(index):
    """Commands with bends and steps: both wheels must be told apart."""
    return 0.2 + 0.1 * math.sin(0.31 * index), 1.5 * math.sin(0.17 * index) + (
        0.6 if index % 40 < 20 else -0.6
    )


def rims(v_m_s, w_rad_s):
    """Speeds of the rims of wheels with the nominal radius."""
    half = 0.5 * TRACK_M * w_rad_s
    return v_m_s - half, v_m_s + half


class Robot:
    """A robot with its own wheel radii that does what the filter supposes, in steps of 0.1 ms."""

    def __init__(self, left_factor=1.0, right_factor=1.0):
        self.factors = left_factor, right_factor
        self.speeds = [0.0, 0.0]
        self.posture = Posture(0.3, -0.2, 3.0)  # turns through pi soon
        self.time_s = 0.0
        self.sent = []
        self.count = 0
        self.loses = None  # which of the commands does not arrive
        self.rims_m = [0.0, 0.0]  # what encoders would count, for wheels of the nominal radius
        self.disobeys = lambda time_s: (0.0, 0.0)  # further speed of the rims in m/s
        self.follows = lambda time_s: 1.0  # which share of the wheels' way the robot goes

    def send(self, v_m_s, w_rad_s):
        if self.count != self.loses:
            self.sent.append((self.time_s + DELAY_S, rims(v_m_s, w_rad_s)))
        self.count += 1

    def run(self, to_s):
        steps = round((to_s - self.time_s) / 1e-4)
        dt = (to_s - self.time_s) / steps
        x, y, theta = self.posture.x_m, self.posture.y_m, self.posture.theta_rad
        for _ in range(steps):
            self.time_s += dt
            told = next((to for begin, to in reversed(self.sent) if begin < self.time_s), (0.0, 0.0))
            middle = []
            more = self.disobeys(self.time_s)
            for index, to in enumerate(told):
                change = max(-6.0 * dt, min(6.0 * dt, to - self.speeds[index]))
                speed = self.speeds[index] + 0.5 * change + more[index]
                self.rims_m[index] += speed * dt
                middle.append(self.follows(self.time_s) * self.factors[index] * speed)
                self.speeds[index] += change
            turn = (middle[1] - middle[0]) / TRACK_M * dt
            x += 0.5 * (middle[0] + middle[1]) * math.cos(theta + 0.5 * turn) * dt
            y += 0.5 * (middle[0] + middle[1]) * math.sin(theta + 0.5 * turn) * dt
            theta += turn
        self.time_s = to_s
        self.posture = Posture(x, y, theta)


class Loop:
    """Robot, a camera one frame late, and the filter. Each period calls `change(index, sighting)` on what is seen."""

    def __init__(self, estimator, robot, change=lambda index, seen: seen, answers=False):
        self.estimator, self.robot, self.change, self.answers = estimator, robot, change, answers
        self.index = 0
        self.seen = None
        self.before = (0.0, 0.0)
        self.telemetry = self.coming = None  # an answer arrives a period after it was begun
        self.path = []  # true postures at the exposures
        self.tell = lambda telemetry: telemetry  # what becomes of an answer on its way

    @property
    def filter(self):
        """The estimator's filter."""
        return self.estimator.filter

    def period(self):
        """One period; what the filter says and where the robot really is at that time."""
        now_s = self.index * PERIOD_S
        seen = self.change(self.index, self.seen)
        telemetry = self.telemetry if self.telemetry is None else self.tell(self.telemetry)
        given_ = EstimatorInput(now_s, PERIOD_S, seen, *self.before, *rims(*self.before), telemetry)
        self.telemetry = self.coming
        estimate = self.estimator.step(given_)
        self.exposed = self.path[-1] if self.path else self.robot.posture
        self.path.append(self.robot.posture)
        truth = self.robot.posture
        tick = self.index * CONTROL_PERIOD_TICKS
        self.seen = Sighting(truth.x_m, truth.y_m, math.remainder(truth.theta_rad, math.tau), tick, 1.0)
        self.before = velocities(self.index)
        self.robot.send(*self.before)
        self.index += 1
        if self.answers and self.index % 3 == 0:
            self.robot.run(now_s + READ_S)
            counts = [round(way / METRES_PER_COUNT) for way in self.robot.rims_m]
            self.coming = LastTelemetry(
                round((now_s + READ_S + SAMPLED_S) * TICKS_PER_SECOND), 0, 0, 0, 0, *counts, 0, 0
            )
        self.robot.run(self.index * PERIOD_S)
        return estimate

    def run(self, periods):
        return [self.period() for _ in range(periods)]


def truths(periods, left_factor=1.0, right_factor=1.0, after_s=DELAY_S):
    """True postures `after_s` into each period, of a robot that is driven as in a `Loop`."""
    robot, found = Robot(left_factor, right_factor), []
    for index in range(periods):
        robot.send(*velocities(index))
        robot.run(index * PERIOD_S + after_s)
        found.append(robot.posture)
        robot.run((index + 1) * PERIOD_S)
    return found


def replace(seen, **changes):
    return seen if seen is None else msgspec.structs.replace(seen, **changes)


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


@pytest.mark.parametrize("aside", [(0.2, 0.0), (0.0, 1.0)])
def test_an_outlier_is_refused(aside):
    def change(index, seen):
        if index != 60:
            return seen
        theta_rad = math.remainder(seen.theta_rad + aside[1], math.tau)
        return replace(seen, x_m=seen.x_m + aside[0], theta_rad=theta_rad)

    loop, clean = Loop(P.estimator(), Robot(), change), Loop(P.estimator(), Robot())
    for _ in range(60):
        assert loop.period() == clean.period()
    assert apart_m(loop.period(), clean.period().posture) < 5e-4
    assert loop.estimator.refused == 1
    loop.period()
    assert loop.estimator.refused == 0


def test_a_robot_that_was_carried_away_is_found_again_and_its_wheels_are_not_forgotten():
    def change(index, seen):
        return seen if index < 60 else replace(seen, x_m=seen.x_m + 0.4)

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
            return seen if index != 60 else replace(seen, x_m=seen.x_m + 0.003, confidence=confidence)

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


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("covariance", [1.0, 0.5, *[0.0] * 79], "the covariance is not symmetric"),
        ("covariance", [0.0] * 81, "the covariance is not positive definite"),
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


def test_a_derived_filter_may_have_keys_with_one_bound_or_none():
    class Own(EkfParameters, frozen=True, kw_only=True, tag="own"):
        length_m: Annotated[float, Meta(gt=0.0)] = 0.1
        least_m: Annotated[float, Meta(ge=0.0), "where nothing is sure"] = 0.1

    assert Own(length_m=2.0, least_m=3.0).length_m == 2.0
    with pytest.raises(ValueError, match="gate"):
        Own(gate=0.0)


COUNTING = EkfTelemetryParameters()
WITHOUT = EkfParameters(rim_noise_m_s=COUNTING.rim_noise_m_s)


def shaken(time_s):
    """Command noise: other speeds every period, up to 0.05 m/s."""
    period = int(time_s * 30.0)
    return 0.05 * math.sin(2.3 * period), 0.05 * math.sin(1.7 * period + 1.0)


def off_m(loop, periods):
    """Root mean square of the position's error at the last exposure."""
    total = 0.0
    for _ in range(periods):
        loop.period()
        off = loop.filter.state[0] - loop.exposed.x_m, loop.filter.state[1] - loop.exposed.y_m
        total += off[0] ** 2 + off[1] ** 2
    return math.sqrt(total / periods)


def blurred(index, seen):
    """A camera with 8 mm and 0.03 rad of noise."""
    if seen is None:
        return None
    x, y, theta = (math.sin((7.1 + part) * index * index + part) for part in range(3))
    theta_rad = math.remainder(seen.theta_rad + 0.03 * theta, math.tau)
    return replace(seen, x_m=seen.x_m + 0.008 * x, y_m=seen.y_m + 0.008 * y, theta_rad=theta_rad)


def test_counts_tell_what_the_wheels_did_when_they_disobey():
    def error_m(parameters):
        noise = {"position_noise_m": 0.006, "heading_noise_rad": 0.02, "rim_noise_m_s": 0.04}
        loop = Loop(parameters(**noise).estimator(), Robot(), blurred, answers=True)
        loop.robot.disobeys = shaken
        loop.run(20)
        return off_m(loop, 150)

    assert error_m(EkfTelemetryParameters) < 0.85 * error_m(EkfParameters)


def test_without_answers_it_is_the_filter_without_encoders_to_the_last_bit():
    loop, other = Loop(COUNTING.estimator(), Robot(1.02, 0.97)), Loop(WITHOUT.estimator(), Robot(1.02, 0.97))
    for estimate, same in zip(loop.run(60)[1:], other.run(60)[1:], strict=True):
        assert estimate.posture == same.posture
        assert (estimate.left_factor, estimate.right_factor) == (same.left_factor, same.right_factor)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.05, 0.95)])
def test_the_wheel_factors_become_the_true_ones(factors):
    loop = Loop(EkfTelemetryParameters(wheel_spread=0.05).estimator(), Robot(*factors), answers=True)
    estimates = loop.run(120)
    assert loop.filter.state[3] == pytest.approx(factors[0], abs=2e-3)
    assert loop.filter.state[4] == pytest.approx(factors[1], abs=2e-3)
    assert apart_m(estimates[-1], truths(120, *factors)[-1]) < 1e-3


def told_before(change, at=60):
    """Two loops alike, in one of which answers are changed from period `at` on; both after some periods more."""
    loop, same = (Loop(COUNTING.estimator(), Robot(), answers=True) for _ in range(2))
    loop.run(at)
    same.run(at)
    loop.tell = change
    return loop, same


def test_a_repeated_answer_and_an_older_one_change_nothing():
    old = Loop(COUNTING.estimator(), Robot(), answers=True)
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
        left, right = telemetry.position_left + 65_536 * turns, telemetry.position_right - 65_536 * turns
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
        assert apart_m(estimate, whole.posture) < 5e-4
    assert loop.estimator.counting
    assert loop.filter.covariance[5 * 9 + 5] < 0.02**2  # known from the last count


@pytest.mark.parametrize("parameters", [PredictParameters(), EkfParameters(), COUNTING])
def test_an_estimator_saved_at_any_period_goes_on_with_the_same_bits(parameters):
    whole, cut = (Loop(parameters.estimator(), Robot(), blurred, answers=True) for _ in range(2))
    for _ in range(30):
        again = parameters.estimator()
        restore(again, snapshot(cut.estimator))
        cut.estimator = again
        assert cut.period() == whole.period()
        assert snapshot(cut.estimator) == snapshot(whole.estimator)


@pytest.mark.parametrize(
    ("parameters", "name", "value"),
    [
        *((PredictParameters, name, 0.3) for name in ("age_s", "ahead_s")),
        (EkfParameters, "age_s", 0.3),
        (EkfParameters, "position_noise_m", 0.0),
        (EkfParameters, "gate", math.nan),
        (EkfTelemetryParameters, "sampled_s", 0.1),
        (EkfTelemetryParameters, "warp_length_m", 0.0),
        (EkfTelemetryParameters, "gate", 0.0),
    ],
)
def test_a_parameter_out_of_range_is_refused(parameters, name, value):
    with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
        parameters(**{name: value})


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

    slip_m_s, blamed, off = slipping(COUNTING, True)
    assert 0.05 < slip_m_s < 0.2
    assert blamed < 0.003
    assert off < 0.003
    assert slipping(WITHOUT, False)[2] > 2.0 * off


def test_without_slip_none_is_found():
    loop = Loop(COUNTING.estimator(), Robot(1.005, 0.995), answers=True)
    assert max(abs(estimate.inner["slip_m_s"]) for estimate in loop.run(120)[1:]) == 0.0


def test_a_camera_whose_displacement_changes_along_the_path_is_told_from_large_wheels():
    """A displacement that comes and goes over 0.6 m of way; encoders do not see it."""

    def change(index, seen):
        if seen is None:
            return None
        return replace(seen, x_m=seen.x_m + 0.01 * math.sin(seen.x_m / 0.1))

    known = EkfTelemetryParameters(warp_m=0.007, warp_length_m=0.2, position_drift_m=0.0005)
    loop = Loop(known.estimator(), Robot(), change, answers=True)
    shown, found = [], []
    for index, estimate in enumerate(loop.run(240)):
        if index > 60:
            shown.append(0.01 * math.sin(loop.path[index - 1].x_m / 0.1))
            found.append(estimate.inner["warp_x_m"])
    assert np.corrcoef(shown, found)[0, 1] > 0.7


COUNT = st.integers(-NEVER_TICK, NEVER_TICK) | st.integers(-70000, 70000)
ANSWERS = st.builds(
    LastTelemetry,
    st.integers(-1, 10**8) | st.integers(0, NEVER_TICK),
    *[st.integers(0, 255)] * 4,
    *[COUNT] * 2,
    *[st.integers(0, 255)] * 2,
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
