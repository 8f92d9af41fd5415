"""The boundary layer of theta_e in the paper's law, with and without its derivative in u2."""

import math
import random

import msgspec
import pytest

from miro_host.laws.yang_kim import Gains, YangKim, saturation
from miro_host.posture import Posture
from miro_host.references.line import StraightLine


def surface_rate(law, path, t, posture, v, w):
    """s2 and s2' along the motion that the law's answer makes, by a central difference; None where a kink is near."""
    c, r, h = law.control(path.at(t), posture, v, w), path.at(t), 1e-5
    v_dot, w_dot = r.v_dot_m_s2 + c.u1, r.w_dot_rad_s2 + c.u2

    def later(dt):
        turn, length = dt * (w + 0.5 * dt * w_dot), dt * (v + 0.5 * dt * v_dot)
        middle = posture.theta_rad + 0.5 * turn
        x, y = posture.x_m + length * math.cos(middle), posture.y_m + length * math.sin(middle)
        there = Posture(x, y, posture.theta_rad + turn)
        return law.control(path.at(t + dt), there, v + dt * v_dot, w + dt * w_dot)

    before, after = later(-h), later(h)
    if before.phi_e_rad * after.phi_e_rad <= 0.0:
        return None
    return c, (after.s2 - before.s2) / (2 * h)


def inside_the_layer(count):
    """States within 0.1 rad of the reference's heading, and away from the origin and from assumption 3."""
    chance = random.Random(3)
    while count:
        r = StraightLine().at(chance.uniform(1.0, 5.0))
        x, y = r.posture.x_m + chance.uniform(-0.1, 0.1), r.posture.y_m + chance.uniform(-0.2, 0.2)
        if x > 0.05:
            count -= 1
            theta_rad = r.posture.theta_rad + chance.uniform(-0.098, 0.098)
            yield r, Posture(x, y, theta_rad), chance.uniform(0.1, 0.3), chance.uniform(-2.0, 2.0)


def test_inside_the_layer_the_published_u2_lets_v_rise_and_the_layer_s_derivative_does_not():
    """sat has a slope where sgn has none: s2' then has theta_e' / w |phi_e| beside what Theorem 1 counts."""
    width, path = 0.1, StraightLine()
    published = Gains(1.7, 3.0, 0.53, 0.72, 0.35, 1.2, layer_s2_rad_s=0.19, layer_theta_rad=width)
    sloped = msgspec.structs.replace(published, layer_derivative=True)
    rises, most, seen = {False: 0, True: 0}, 0.0, 0
    for r, posture, v, w in inside_the_layer(400):
        t = r.rho_m / 0.2 + 0.25
        for gains in (published, sloped):
            found = surface_rate(YangKim(gains), path, t, posture, v, w)
            if found is None:
                continue
            c, s2_rate = found
            reaching = -gains.q2_per_s * c.s2 - gains.p2_rad_s2 * saturation(c.s2, gains.layer_s2_rad_s)
            extra = 0.0 if gains.layer_derivative else w / width * abs(c.phi_e_rad)
            assert s2_rate == pytest.approx(reaching + extra, rel=1e-4, abs=1e-4)
            rises[gains.layer_derivative] += c.s2 * s2_rate > 1e-6
            most = max(most, c.s2 * s2_rate)
            seen += 1
    assert seen > 700
    assert rises[True] == 0
    assert rises[False] > 60
    assert most > 1.0  # rad2/s3: not a matter of rounding
