"""A robot with wheels of its own size, a camera one frame late, and a filter that follows it: a loop for `test_ekf`."""

import math

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_host.estimators.ekf import EkfParameters
from miro_host.estimators.ekf_telemetry import METRES_PER_COUNT, EkfTelemetryParameters
from miro_host.estimators.interface import DEAD_S, EstimatorInput
from miro_host.eye.track import Sighting
from miro_host.pilot import PERIOD_S
from miro_host.posture import Posture
from miro_host.telemetry_receiver import LastTelemetry
from miro_host.wheels import Wheels

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
