"""Robots of the theory on their way: laws as demands for `tests.host.theory.simulation`, and the paper's starts."""

import math
import random
from dataclasses import dataclass

import msgspec

from miro_host.laws.body_frame import BodyFrame, BodyFrameParameters
from miro_host.laws.yang_kim import Gains, YangKim
from miro_host.posture import Posture
from miro_host.references.arc import Arc
from miro_host.references.line import StraightLine
from miro_host.theory import across
from tests.host.theory.matrices import times
from tests.host.theory.simulation import BodySimulation
from tests.host.theory.stability import lyapunov
from tests.host.theory.unicycle import UnicycleBody, inertia

ROBOT = UnicycleBody(mass_kg=0.5, yaw_inertia_kg_m2=4.7e-4, wheel_radius_m=0.020, track_m=0.068)
LITERAL = Gains()  # a set that draws Figs. 6 to 8, with boundary layers and guards
PRINTED = Gains(p1_m_s2=0.35, p2_rad_s2=1.2, switching="sign", cosine_guard=0.0, rho_floor_m=1e-9)
BODY = BodyFrameParameters()
STARTS = {  # path and initial errors of the paper's figures
    "Fig. 6": (StraightLine(), (0.0709, 0.0172, -0.38)),
    "Fig. 7": (StraightLine(), (0.5258, 0.1662, -3.09)),
    "Fig. 8": (Arc(), (0.1120, 0.2892, -1.31)),
}


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


def last(law, path, start, z, start_s, end_s, step_s, limited=True):
    """The robot at `end_s`, and (t, distance in m, heading error in rad) of every step."""
    make, parameters = LAWS[law]
    simulation = BodySimulation(ROBOT, make(parameters, path), limits=parameters if limited else None)
    row, errors = None, []
    for row in simulation.run(start, z, start_s, end_s, step_s):
        there = path.at(row.t_s).posture
        distance = math.hypot(row.posture.x_m - there.x_m, row.posture.y_m - there.y_m)
        turn = math.remainder(row.posture.theta_rad - there.theta_rad, math.tau)
        errors.append((row.t_s, distance, turn))
    return row, errors


def figure(law, name, step_s=0.002):
    """Final distance in m, final heading error in rad, and when it was last outside 3 cm or 0.15 rad."""
    path, error = STARTS[name]
    start, _ = beside(path, 0.0, *error)
    _, errors = last(law, path, start, (0.0, 0.0), 0.0, 6.0, step_s)
    outside = [t for t, distance, turn in errors if distance > 0.03 or abs(turn) > 0.15]
    return errors[-1][1], errors[-1][2], outside[-1] if outside else 0.0


def lateral_slope(law, offsets=(-0.04, -0.02, 0.0, 0.02, 0.04), step_s=0.002):
    """Slope of final against initial lateral error on the line, by least squares, from 0.3 m on with a small turn."""
    path = StraightLine()
    ends = []
    for offset in offsets:
        start, z = beside(path, 1.5, 0.0, offset, 0.05)
        row, _ = last(law, path, start, z, 1.5, 6.0, step_s)
        ends.append(row.posture.y_m)
    middle = math.fsum(offsets) / len(offsets)
    mean = math.fsum(ends) / len(ends)
    rise = math.fsum((x - middle) * (y - mean) for x, y in zip(offsets, ends, strict=True))
    return rise / math.fsum((x - middle) ** 2 for x in offsets)


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
    start, _ = beside(path, 0.0, *error)
    row, errors = last(law, path, start, (0.0, 0.0), 0.0, 6.0, step_s)
    return row.posture.x_m - path.at(6.0).posture.x_m, row.posture.y_m, errors[-1][2]


@dataclass
class Seen:
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


def lyapunov_run(path, error, start_s, end_s, f, worst, gamma2=None, turn=0.0, step_s=1e-3):
    """The law as printed, with f_i = f times a sine or, `worst`, against V at each moment; V at each step."""
    gains = PRINTED if gamma2 is None else msgspec.structs.replace(PRINTED, gamma2_per_s=gamma2)
    law, demand = YangKim(gains), paper_law(gains, path)
    latest = [0.0, 0.0]

    def watching(t, posture, v, w):
        c = law.control(path.at(t), posture, v, w)
        r = path.at(t)
        cosine = math.sin(across(posture))
        latest[:] = [-math.copysign(f[0], c.s1 * cosine), -math.copysign(f[1], c.s2)]
        return r.v_dot_m_s2 + c.u1, r.w_dot_rad_s2 + c.u2

    def torques(t):
        parts = latest if worst else [f[0] * math.sin(7.0 * t), f[1] * math.sin(11.0 * t)]
        return times(inertia(ROBOT), parts)

    start, (v, w) = beside(path, start_s, *error)
    simulation = BodySimulation(ROBOT, watching if worst else demand, disturbance=torques)
    seen = []
    for row in simulation.run(start, (v, w + turn), start_s, end_s, step_s):
        c = law.control(path.at(row.t_s), row.posture, row.v_m_s, row.w_rad_s)
        rate = row.w_rad_s - path.at(row.t_s).w_rad_s
        v_now = lyapunov(c.s1, c.s2)
        seen.append(Seen(v_now, c.s1, c.s2, c.rho_e_m, c.phi_e_rad, c.theta_e_rad, rate, step_s))
    return seen
