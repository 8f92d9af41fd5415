"""What laws are driven with: drawn states, and a robot that does at once what the pilot commands, period by period.

It has limits, but no delay, noise or quantum.
"""

import math
import random

from hypothesis import strategies as st

from miro_host.estimators.predict import moved
from miro_host.pilot import PERIOD_S, Pilot
from miro_host.posture import Posture
from miro_host.references.arc import Arc, StraightLine

PATHS = [StraightLine(), StraightLine(heading_rad=2.2), Arc(), Arc(heading_rad=-2.9, curvature_per_m=0.8)]
ANY_PATH = st.sampled_from(PATHS)
POSTURES = st.builds(Posture, st.floats(-1.2, 1.2), st.floats(-0.9, 0.9), st.floats(-3.14, 3.14))
TIMES = st.floats(0.02, 5.9)
SPEEDS = st.floats(-0.9, 0.9)
TURNS = st.floats(-4.0, 4.0)


def later(posture, v, w, h, v_dot=0.0, w_dot=0.0):
    """Where a robot is after `h` seconds, or was before."""
    return moved(posture, h * (v + 0.5 * h * v_dot), h * (w + 0.5 * h * w_dot))


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
