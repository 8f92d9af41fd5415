"""Twin of `mirotwin.recording.theory.track` and of the chattering index: the whole run at once, with numpy.

The definitions one after the other, from the records of one robot. Nothing is shared with the code under test.
"""

import math
from itertools import pairwise

import numpy as np

PERIOD_S = 1001 / 30000
SPEED = 256 * 16384 / (24e6 / 8192) / (2 * math.pi * 0.02)  # 1/256 count per sample in 1 m/s


def disturbances(robots):
    """f1 and f2 of every period whose beginning has a command."""
    commands = [(0.0, 0.0)]
    found = []
    for robot, after in pairwise(robots):
        if robot.control is None:
            continue
        given = (robot.control.v_m_s, robot.control.w_rad_s)
        demand = np.subtract(given, commands[-1]) / PERIOD_S
        commands.append(given)
        happened = np.subtract((after.v_m_s, after.w_rad_s), (robot.v_m_s, robot.w_rad_s)) / PERIOD_S
        found.append(demand - happened)
    return np.array(found).reshape(-1, 2)


def across(posture):
    """Equation (12) with the sign of the cosine: asin of it."""
    return math.asin(math.cos(math.atan2(posture.y_m, posture.x_m) - posture.theta_rad))


def outside(angles):
    """Where an angle, followed without jumps from (-pi, pi], is outside of it; and how often it passes pi."""
    first = math.remainder(angles[0], math.tau)
    followed = np.unwrap(np.array(angles)) - angles[0] + first
    turns = np.floor((followed + math.pi) / math.tau)
    return turns != 0, int(np.abs(np.diff(turns)).sum())


def chattering(commands):
    """Variation less net change in windows of ten steps, for one wheel and second."""
    wheels = np.array(commands, dtype=float) / SPEED
    total = 0.0
    for start in range(0, len(wheels) - 1, 10):
        window = wheels[start : start + 11]
        total += np.abs(np.diff(window, axis=0)).sum() - np.abs(window[-1] - window[0]).sum()
    return total / 2 / ((len(wheels) - 1) * PERIOD_S)


def effort(commands):
    """Mean size of the change of a wheel's speed, a second."""
    wheels = np.array(commands, dtype=float) / SPEED
    return np.abs(np.diff(wheels, axis=0)).mean() / PERIOD_S
