"""Surfaces, V and V' of a robot under the paper's law: equations (13), (18) and (23), and what (23) leaves out.

The proof differentiates s2 = theta_e' + gamma2 theta_e + sgn(theta_e) |phi_e| as if sgn(theta_e) were constant. It is,
except where theta_e crosses 0: there s2 jumps by 2 |phi_e|, in the direction of theta_e', and V rises by
2 |theta_e'| |phi_e|. With the saturation function of remark 2 in its place, the jump is spread over the boundary layer:
s2' has the term (theta_e' / layer) |phi_e| there, which is in neither u2 of equation (16) nor in (23).
"""

import math
import random
from typing import NamedTuple

import msgspec

from miro_exact.dmath import wrap_pi
from miro_host.laws.yang_kim import Gains, curvature_term, saturation, sign
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from mirotwin.recording.theory.track import across, radius
from tests.host.theory.paper_law import YangKim


def unguarded(gains):
    """The gains without what the law does near the origin and near assumption 3, which is not in the paper."""
    return msgspec.structs.replace(gains, cosine_guard=1e-9, rho_floor_m=1e-9)


NO_GUARD = unguarded(Gains())
SLOPED = msgspec.structs.replace(NO_GUARD, layer_derivative=True)


class PolarErrors(NamedTuple):
    """Errors c - r (m, rad, wrapped), their rates by equation (9), cos(phi_c - theta_c), and R(q, z) in m/s2."""

    rho_e_m: float
    phi_e_rad: float
    theta_e_rad: float
    rho_e_rate: float
    phi_e_rate: float
    theta_e_rate: float
    cosine: float
    curvature_term: float


def polar_errors(reference, robot, v, w):
    """The errors of a robot that moves with z = (v, w). ZeroDivisionError in the origin."""
    rho, phi = radius(robot), math.atan2(robot.y_m, robot.x_m)
    sin, cos = math.sin(phi - robot.theta_rad), math.cos(phi - robot.theta_rad)
    return PolarErrors(
        rho_e_m=rho - reference.rho_m,
        phi_e_rad=wrap_pi(phi - reference.phi_rad),
        theta_e_rad=wrap_pi(robot.theta_rad - reference.posture.theta_rad),
        rho_e_rate=v * cos - reference.rho_rate_m_s,
        phi_e_rate=-(v / rho) * sin - reference.phi_rate_rad_s,
        theta_e_rate=w - reference.w_rad_s,
        cosine=cos,
        curvature_term=curvature_term(v, w, rho, sin),
    )


def side_of(e, layer_rad):
    """sgn(theta_e), or the saturation that stands for it in a boundary layer."""
    return saturation(e.theta_e_rad, layer_rad) if layer_rad > 0.0 else sign(e.theta_e_rad)


def surfaces(e, gammas, layer_rad=0.0):
    """s1 in m/s and s2 in rad/s of equation (13)."""
    s2 = e.theta_e_rate + gammas[1] * e.theta_e_rad + side_of(e, layer_rad) * abs(e.phi_e_rad)
    return e.rho_e_rate + gammas[0] * e.rho_e_m, s2


def layer_term(e, layer_rad):
    """The part of s2' in rad/s2 that (16) and (23) lack inside a boundary layer of theta_e; 0 outside of it."""
    if abs(e.theta_e_rad) >= layer_rad:
        return 0.0
    return e.theta_e_rate / layer_rad * abs(e.phi_e_rad)


def surface_rates(e, reference, accelerations, gammas, layer_rad=0.0):
    """s1' and s2' of a robot with z' = `accelerations`, nothing left out. `layer_rad` 0: a sign, away from 0."""
    v_dot, w_dot = accelerations
    rho_e_accel = v_dot * e.cosine + e.curvature_term - reference.rho_accel_m_s2  # (18)
    absolute_rate = sign(e.phi_e_rad) * e.phi_e_rate  # d|phi_e|/dt
    s2_rate = w_dot - reference.w_dot_rad_s2 + gammas[1] * e.theta_e_rate
    s2_rate += side_of(e, layer_rad) * absolute_rate + layer_term(e, layer_rad)
    return rho_e_accel + gammas[0] * e.rho_e_rate, s2_rate


def lyapunov(s1, s2):
    """V = s^T s / 2 of the proof of Theorem 1."""
    return 0.5 * (s1 * s1 + s2 * s2)


def lyapunov_rate(s, s_rate):
    """V' = s1 s1' + s2 s2', whatever moves the surfaces."""
    return s[0] * s_rate[0] + s[1] * s_rate[1]


def proof_rate(s, switched, q, p, f, cosine):
    """V' by equation (23); `switched` is (sgn s1, sgn s2), or what stands for them, q and p the gains, f as in (15)."""
    first = s[0] * (-q[0] * s[0] - p[0] * switched[0] - f[0] * cosine)
    second = s[1] * (-q[1] * s[1] - p[1] * switched[1] - f[1])
    return first + second


def jump(theta_e_rate, phi_e_rad):
    """V after a crossing of theta_e = 0 less V before it, with the sign function: never below 0."""
    return 2.0 * abs(theta_e_rate) * abs(phi_e_rad)


def reach(p, q, f):
    """The |s_i| above which V still falls by (23) under |f_i| = f: (f - P_i) / Q_i; condition (17) makes it 0."""
    return max(0.0, (f - p) / q)


def phi_error_rate_on_surfaces(reference, phi_e_rad):
    """phi_e' in rad/s where s1 = s2 = rho_e = theta_e = 0, which Proposition 1 says ends in phi_e = 0.

    rho_e' = 0 makes v cos(a + phi_e) = v_r cos a with a = phi_r - theta_r, and (9) is then
    phi_e' = -(v_r cos a / rho_r) (tan(a + phi_e) - tan a). On a line (a = 0) rho_r sin(phi_e) is constant: the robot
    runs parallel to it. Nothing in u reacts to that, because sgn(0) |phi_e| = 0. ZeroDivisionError at rho_r = 0.
    """
    a = reference.phi_rad - reference.posture.theta_rad
    away = math.tan(a + phi_e_rad) - math.tan(a)
    return -(reference.v_m_s * math.cos(a) / reference.rho_m) * away


def rates(gains, path, t, posture, v, w, f=(0.0, 0.0)):
    """(s, s', e, proof's V') of a robot under the law with a disturbance f, all from the theory's formulas."""
    r = path.at(t)
    c = YangKim(gains).control(r, posture, v, w)
    z_dot = (r.v_dot_m_s2 + c.u1 - f[0], r.w_dot_rad_s2 + c.u2 - f[1])  # (15)
    e, layer, signs = polar_errors(r, posture, v, w), 0.0, (sign(c.s1), sign(c.s2))
    if gains.switching == "saturation":
        layer = gains.layer_theta_rad
        signs = saturation(c.s1, gains.layer_s1_m_s), saturation(c.s2, gains.layer_s2_rad_s)
    gammas = (gains.gamma1_per_s, gains.gamma2_per_s)
    s = surfaces(e, gammas, layer)
    q, p = (gains.q1_per_s, gains.q2_per_s), (gains.p1_m_s2, gains.p2_rad_s2)
    return s, surface_rates(e, r, z_dot, gammas, layer), e, proof_rate(s, signs, q, p, f, e.cosine)


def states(count, spread, seed=3):
    """(path, t, posture, v, w) with theta_e within `spread`, evenly drawn, away from the origin and assumption 3."""
    chance = random.Random(seed)
    for _ in range(count):
        path, t = StraightLine(), chance.uniform(0.6, 5.8)
        r = path.at(t).posture
        x, y = r.x_m + chance.uniform(-0.2, 0.2), r.y_m + chance.uniform(-0.2, 0.2)
        posture = Posture(x, y, r.theta_rad + chance.uniform(-spread, spread))
        v, w = chance.uniform(0.05, 0.4), chance.uniform(-2.0, 2.0)
        if radius(posture) >= 0.05 and abs(across(posture)) >= 0.5:
            yield path, t, posture, v, w


def rising(gains):
    """The share of states inside the layer in which V rises though f = 0."""
    rises = []
    for state in states(2000, 0.9 * gains.layer_theta_rad):
        s, s_rate, _, _ = rates(gains, *state)
        rises.append(lyapunov_rate(s, s_rate) > 1e-9)
    assert len(rises) > 1000
    return sum(rises) / len(rises)
