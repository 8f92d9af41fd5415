"""The rates of s and V under the law, and states inside and outside of the boundary layer of theta_e."""

import random

from miro_host.laws.yang_kim import Gains, YangKim, saturation, sign
from miro_host.posture import Posture
from miro_host.references.line import StraightLine
from miro_host.theory import across, radius
from tests.host.theory import stability

NO_GUARD = Gains(cosine_guard=1e-9, rho_floor_m=1e-9)


def switched(gains, posture_e, c):
    """What stands for sgn in theta_e, s1 and s2."""
    if gains.switching == "sign":
        return sign(posture_e.theta_e_rad), (sign(c.s1), sign(c.s2))
    side = saturation(posture_e.theta_e_rad, gains.layer_theta_rad)
    return side, (saturation(c.s1, gains.layer_s1_m_s), saturation(c.s2, gains.layer_s2_rad_s))


def rates(gains, path, t, posture, v, w, f):
    """(s, s', e, proof's V') of a robot under the law with a disturbance f, all from the theory's formulas."""
    r = path.at(t)
    c = YangKim(gains).control(r, posture, v, w)
    z_dot = (r.v_dot_m_s2 + c.u1 - f[0], r.w_dot_rad_s2 + c.u2 - f[1])  # (15)
    e = stability.polar_errors(r, posture, v, w)
    side, signs = switched(gains, e, c)
    gammas = (gains.gamma1_per_s, gains.gamma2_per_s)
    s = stability.surfaces(e, *gammas, side)
    layer = gains.layer_theta_rad if gains.switching == "saturation" else 0.0
    s_rate = stability.surface_rates(e, r, z_dot, gammas, side, layer)
    q, p = (gains.q1_per_s, gains.q2_per_s), (gains.p1_m_s2, gains.p2_rad_s2)
    return s, s_rate, e, stability.proof_rate(s, signs, q, p, f, e.cosine)


def states(count, spread, seed=3):
    """(path, t, posture, v, w) with theta_e within `spread`, evenly drawn."""
    chance = random.Random(seed)
    for _ in range(count):
        path, t = StraightLine(), chance.uniform(0.6, 5.8)
        r = path.at(t).posture
        x, y = r.x_m + chance.uniform(-0.2, 0.2), r.y_m + chance.uniform(-0.2, 0.2)
        theta = r.theta_rad + chance.uniform(-spread, spread)
        yield path, t, Posture(x, y, theta), chance.uniform(0.05, 0.4), chance.uniform(-2.0, 2.0)


def rising(spread, layer_added):
    """The share of states in which V rises though f = 0, with and without the layer's derivative in u2."""
    rises, count = 0, 0
    for path, t, posture, v, w in states(2000, spread):
        if radius(posture) < 0.05 or abs(across(posture)) < 0.5:
            continue
        s, s_rate, e, _ = rates(NO_GUARD, path, t, posture, v, w, (0.0, 0.0))
        rate = stability.lyapunov_rate(s, s_rate)
        if layer_added:
            rate -= s[1] * stability.layer_term(e, NO_GUARD.layer_theta_rad)
        rises += rate > 1e-9
        count += 1
    assert count > 1000
    return rises / count
