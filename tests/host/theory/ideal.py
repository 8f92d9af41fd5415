"""Robots of the theory on their way, in continuous time: laws, the paper's starts, and what comes of both.

    demand z_r' + u ─► (14) tau = H z_r' + G + H u ─► (10) H z' + G + tau_d = tau ─► (8) q' = S z

The law is asked in every stage of a step. Where a sign function switches, the method is of order 1, and a surface is
held within what the law does in one step.
"""

import math
import random
from typing import NamedTuple

import msgspec
import numpy as np

from miro_host.integrator import clamp
from miro_host.laws.body_frame import BodyFrame, BodyFrameParameters
from miro_host.laws.yang_kim import Gains
from miro_host.posture import Posture
from miro_host.references.arc import Arc, StraightLine
from mirotwin.recording.theory.track import across
from tests.host.driving import apart
from tests.host.theory.mechanics import ROBOT, accelerated, cartesian_rates, inertia
from tests.host.theory.paper_law import YangKim
from tests.host.theory.stability import lyapunov

LITERAL = Gains()  # a set that draws Figs. 6 to 8, with boundary layers and guards
PRINTED = Gains(p1_m_s2=0.35, p2_rad_s2=1.2, switching="sign", cosine_guard=0.0, rho_floor_m=1e-9)
BODY = BodyFrameParameters()
STARTS = {  # path and initial errors of the paper's figures
    "Fig. 6": (StraightLine(), (0.0709, 0.0172, -0.38)),
    "Fig. 7": (StraightLine(), (0.5258, 0.1662, -3.09)),
    "Fig. 8": (Arc(), (0.1120, 0.2892, -1.31)),
}


class Row(NamedTuple):
    """The robot at the beginning of a step, its heading unwrapped, and what was demanded and applied there."""

    t_s: float
    posture: Posture
    v_m_s: float
    w_rad_s: float
    demand: tuple[float, float]
    torque_nm: np.ndarray


def simulated(demand, start, z, start_s, end_s, step_s, disturbance=lambda t_s: (0.0, 0.0), limits=None):
    """Rows from `start_s` to `end_s`, both included, by Runge and Kutta; `disturbance` is tau_d in Nm at the wheels.

    With `limits` demands are clamped as the host's integrator does it, and no speed is raised above its limit.
    """
    h = inertia(ROBOT)

    def demanded(t, state):
        x, y, theta, v, w = (float(value) for value in state)
        v_dot, w_dot = demand(t, Posture(x, y, theta), v, w)
        if limits is not None:
            v_dot = _limited(v, clamp(v_dot, limits.max_v_dot_m_s2), limits.max_v_m_s)
            w_dot = _limited(w, clamp(w_dot, limits.max_w_dot_rad_s2), limits.max_w_rad_s)
        return v_dot, w_dot

    def rates(t, state):
        torque = h @ demanded(t, state)  # (14)
        return np.array([*cartesian_rates(state, state[3:]), *accelerated(ROBOT, torque - disturbance(t))])

    state = np.array([start.x_m, start.y_m, start.theta_rad, *z])
    for index in range(round((end_s - start_s) / step_s) + 1):
        t, half = start_s + index * step_s, 0.5 * step_s
        x, y, theta, v, w = (float(value) for value in state)
        now = demanded(t, state)
        yield Row(t, Posture(x, y, theta), v, w, now, h @ now)
        k1 = rates(t, state)
        k2 = rates(t + half, state + half * k1)
        k3 = rates(t + half, state + half * k2)
        k4 = rates(t + step_s, state + step_s * k3)
        state = state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def _limited(speed, rate, most):
    """The rate, or 0 where it would raise a speed that is at its limit."""
    return 0.0 if abs(speed) >= most and speed * rate > 0.0 else rate


def paper_law(gains, path):
    """z_r' + u of equations (15) and (16)."""
    law = YangKim(gains)

    def demand(t, posture, v, w):
        r = path.at(t)
        c = law.control(r, posture, v, w)
        return r.v_dot_m_s2 + c.u1, r.w_dot_rad_s2 + c.u2

    return demand


def body_law(parameters, path):
    law = BodyFrame(parameters)

    def demand(t, posture, v, w):
        c = law.control(path.at(t), posture, v, w)
        return c.v_dot, c.w_dot

    return demand


LAWS = {"literal": (paper_law, LITERAL), "body": (body_law, BODY)}


def beside(path, t, x_e, y_e, theta_e):
    """A posture off the reference by these errors, and the reference's velocities."""
    r = path.at(t)
    at = r.posture
    return Posture(at.x_m + x_e, at.y_m + y_e, at.theta_rad + theta_e), (r.v_m_s, r.w_rad_s)


def driven(law, path, start, z, start_s, step_s):
    """Rows of a robot within its limits until 6 s."""
    make, parameters = LAWS[law]
    return list(simulated(make(parameters, path), start, z, start_s, 6.0, step_s, limits=parameters))


def figure(law, name, step_s=0.002):
    """Final distance in m, final heading error in rad, and when it was last outside 3 cm or 0.15 rad."""
    path, error = STARTS[name]
    start, _ = beside(path, 0.0, *error)
    rows = driven(law, path, start, (0.0, 0.0), 0.0, step_s)
    errors = [(row.t_s, *apart(row.posture, path.at(row.t_s))) for row in rows]
    outside = [t for t, distance, turn in errors if distance > 0.03 or turn > 0.15]
    return errors[-1][1], errors[-1][2], outside[-1] if outside else 0.0


def lateral_slope(law, offsets=(-0.04, -0.02, 0.0, 0.02, 0.04), step_s=0.002):
    """Slope of final against initial lateral error on the line, by least squares, from 0.3 m on with a small turn."""
    path, ends = StraightLine(), []
    for offset in offsets:
        start, z = beside(path, 1.5, 0.0, offset, 0.05)
        ends.append(driven(law, path, start, z, 1.5, step_s)[-1].posture.y_m)
    return np.polyfit(offsets, ends, 1)[0]


def random_starts(count, seed=1):
    """Errors x_e from 5 to 50 cm, y_e within 20 cm, theta_e within 1.2 rad."""
    chance = random.Random(seed)
    return [
        (chance.uniform(0.05, 0.5), chance.uniform(-0.2, 0.2), chance.uniform(-1.2, 1.2))
        for _ in range(count)
    ]


def final_place(law, error, step_s=0.002):
    """Where a robot that starts at rest, off the line by `error`, is after 6 s: along, across (m), heading (rad)."""
    path = StraightLine()
    end = driven(law, path, beside(path, 0.0, *error)[0], (0.0, 0.0), 0.0, step_s)[-1].posture
    return end.x_m - path.at(6.0).posture.x_m, end.y_m, math.remainder(end.theta_rad, math.tau)


def run_parallel_to_the_line():
    """Theta_e = 0, 4 cm beside the line, on rho_e = 0."""
    path = StraightLine()
    start = Posture(math.sqrt(path.at(0.75).rho_m ** 2 - 0.04**2), 0.04, 0.0)
    _, z = beside(path, 0.75, 0.0, 0.0, 0.0)
    return list(simulated(paper_law(PRINTED, path), start, z, 0.75, 6.0, 0.001))


class Seen(NamedTuple):
    """V and what it is made of at one step."""

    v: float
    s1: float
    s2: float
    rho_e: float
    phi_e: float
    theta_e: float
    turn: float
    step_s: float

    def crossed_before(self, other):
        return self.theta_e * other.theta_e <= 0.0

    def near_a_surface(self):
        """Within what the law does to a surface in a few steps: there the sign function chatters."""
        return min(abs(self.s1) / PRINTED.p1_m_s2, abs(self.s2) / PRINTED.p2_rad_s2) < 8.0 * self.step_s


def lyapunov_run(path, error, start_s, end_s, f, worst, gamma2=PRINTED.gamma2_per_s, turn=0.0, step_s=1e-3):
    """The law as printed, with f_i = f times a sine or, `worst`, against V at each moment; V at each step."""
    gains = msgspec.structs.replace(PRINTED, gamma2_per_s=gamma2)
    law, demand, h, latest = YangKim(gains), paper_law(gains, path), inertia(ROBOT), [0.0, 0.0]

    def watching(t, posture, v, w):
        c = law.control(path.at(t), posture, v, w)
        latest[:] = [-math.copysign(f[0], c.s1 * across(posture)), -math.copysign(f[1], c.s2)]
        return demand(t, posture, v, w)

    def torques(t):
        return h @ (latest if worst else [f[0] * math.sin(7.0 * t), f[1] * math.sin(11.0 * t)])

    start, (v, w) = beside(path, start_s, *error)
    seen = []
    for row in simulated(watching, start, (v, w + turn), start_s, end_s, step_s, torques):
        c = law.control(path.at(row.t_s), row.posture, row.v_m_s, row.w_rad_s)
        rate = row.w_rad_s - path.at(row.t_s).w_rad_s
        v_now = lyapunov(c.s1, c.s2)
        seen.append(Seen(v_now, c.s1, c.s2, c.rho_e_m, c.phi_e_rad, c.theta_e_rad, rate, step_s))
    return seen


def run_across_theta_e_0():
    """A run in which theta_e crosses 0 far from the line."""
    far = (0.07, 0.30, -0.2)
    return lyapunov_run(StraightLine(), far, 2.0, 2.5, (0.0, 0.0), False, gamma2=0.3, turn=1.0, step_s=1e-4)
