"""A robot that does at once what the pilot commands, period by period: limits, but no delay, noise or quantum."""

import math
import random

from miro_host.estimators.predict import moved
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture


def drive(law, path, start, periods):
    """(command, truth, reference) of each period, the latter two at its end."""
    pilot, truth = Pilot(path, law), start
    for index in range(periods):
        command = pilot.update(truth, index * PERIOD_S)
        truth = moved(truth, command.v_m_s * PERIOD_S, command.w_rad_s * PERIOD_S)
        yield command, truth, path.at((index + 1) * PERIOD_S)


def starts(count, path, reach_m=0.6, seed=1):
    """Postures within `reach_m` of the path's start, with all headings."""
    chance, begin = random.Random(seed), path.at(0.0).posture
    for _ in range(count):
        far, bearing = reach_m * math.sqrt(chance.random()), chance.uniform(-math.pi, math.pi)
        x, y = begin.x_m + far * math.cos(bearing), begin.y_m + far * math.sin(bearing)
        yield Posture(x, y, chance.uniform(-math.pi, math.pi))


def apart(truth, reference):
    """Distance in m and difference of headings in rad, without sign."""
    there = reference.posture
    turn = math.remainder(truth.theta_rad - there.theta_rad, 2 * math.pi)
    return math.hypot(truth.x_m - there.x_m, truth.y_m - there.y_m), abs(turn)
