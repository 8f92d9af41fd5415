"""Surfaces, V and V' of a robot under the paper's law: equations (13), (18) and (23), and what (23) leaves out.

The proof differentiates s2 = theta_e' + gamma2 theta_e + sgn(theta_e) |phi_e| as if sgn(theta_e) were constant. It is,
except where theta_e crosses 0: there s2 jumps by 2 |phi_e|, in the direction of theta_e', and V rises by
2 |theta_e'| |phi_e|. With the saturation function of remark 2 in its place, the jump is spread over the boundary layer:
s2' has the term (theta_e' / layer) |phi_e| there, which is in neither u2 of equation (16) nor in (23).
"""

import math

import msgspec

from miro_exact.dmath import atan2, sincos, wrap_pi


class PolarErrors(msgspec.Struct, frozen=True):
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
    rho = math.sqrt(robot.x_m * robot.x_m + robot.y_m * robot.y_m)
    phi = atan2(robot.y_m, robot.x_m)
    sin, cos = sincos(phi - robot.theta_rad)
    return PolarErrors(
        rho_e_m=rho - reference.rho_m,
        phi_e_rad=wrap_pi(phi - reference.phi_rad),
        theta_e_rad=wrap_pi(robot.theta_rad - reference.posture.theta_rad),
        rho_e_rate=v * cos - reference.rho_rate_m_s,
        phi_e_rate=-(v / rho) * sin - reference.phi_rate_rad_s,
        theta_e_rate=w - reference.w_rad_s,
        cosine=cos,
        curvature_term=v * v / rho * sin * sin + v * w * sin,
    )


def surfaces(e, gamma1, gamma2, side):
    """s1 in m/s and s2 in rad/s of equation (13); `side` is sgn(theta_e), or what stands for it."""
    return e.rho_e_rate + gamma1 * e.rho_e_m, e.theta_e_rate + gamma2 * e.theta_e_rad + side * abs(
        e.phi_e_rad
    )


def rho_error_acceleration(e, reference, v_dot):
    """rho_e'' in m/s2 by equation (18)."""
    return v_dot * e.cosine + e.curvature_term - reference.rho_accel_m_s2


def absolute_rate(e):
    """d|phi_e|/dt in rad/s: sgn(phi_e) phi_e'."""
    if e.phi_e_rad == 0.0:
        return 0.0
    return e.phi_e_rate if e.phi_e_rad > 0.0 else -e.phi_e_rate


def layer_term(e, layer_rad):
    """The part of s2' in rad/s2 that (16) and (23) lack inside a boundary layer of theta_e; 0 outside of it."""
    if abs(e.theta_e_rad) >= layer_rad:
        return 0.0
    return e.theta_e_rate / layer_rad * abs(e.phi_e_rad)


def surface_rates(e, reference, accelerations, gammas, side, layer_rad=0.0):
    """s1' and s2' of a robot with z' = `accelerations`, nothing left out. `layer_rad` 0: a sign, away from 0."""
    v_dot, w_dot = accelerations
    s1_rate = rho_error_acceleration(e, reference, v_dot) + gammas[0] * e.rho_e_rate
    s2_rate = w_dot - reference.w_dot_rad_s2 + gammas[1] * e.theta_e_rate + side * absolute_rate(e)
    if layer_rad > 0.0:
        s2_rate += layer_term(e, layer_rad)
    return s1_rate, s2_rate


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
    """The |s_i| above which V still falls by (23) under |f_i| = f, whatever P_i is: (f - P_i) / Q_i, at least 0.

    Condition (17) makes it 0. Infinite for Q_i = 0 and P_i < f.
    """
    if p >= f:
        return 0.0
    return (f - p) / q if q > 0.0 else math.inf


def phi_error_rate_on_surfaces(reference, phi_e_rad):
    """phi_e' in rad/s where s1 = s2 = rho_e = theta_e = 0, which Proposition 1 says ends in phi_e = 0.

    rho_e' = 0 makes v cos(a + phi_e) = v_r cos a with a = phi_r - theta_r, and (9) is then
    phi_e' = -(v_r cos a / rho_r) (tan(a + phi_e) - tan a). On a line (a = 0) rho_r sin(phi_e) is constant: the robot
    runs parallel to it. Nothing in u reacts to that, because sgn(0) |phi_e| = 0. ZeroDivisionError at rho_r = 0.
    """
    a = reference.phi_rad - reference.posture.theta_rad
    sin_a, cos_a = sincos(a)
    sin, cos = sincos(a + phi_e_rad)
    return -(reference.v_m_s * cos_a / reference.rho_m) * (sin / cos - sin_a / cos_a)
