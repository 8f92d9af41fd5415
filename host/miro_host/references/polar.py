"""From the Cartesian form of a reference to all of it: polar coordinates, their rates (9), and rho'' (18)."""

import math

from miro_exact.dmath import atan2, sincos
from miro_host.posture import Posture
from miro_host.references.interface import Reference

ORIGIN_M = 1e-8
"""Nearer to the origin than this, the polar form has the values of its limit for a path that leaves it."""


def with_polar_form(
    at: Posture, v_m_s: float, w_rad_s: float, v_dot_m_s2: float, w_dot_rad_s2: float
) -> Reference:
    """The reference at the posture `at` with these velocities and accelerations.

    With alpha = phi - theta: rho' = v cos(alpha), phi' = -v sin(alpha) / rho, equation (9), and
    rho'' = v' cos(alpha) + v^2 sin^2(alpha) / rho + v w sin(alpha), equation (18). In the origin all this is 0/0;
    along a path that leaves it forwards alpha = -w rho / (2 v), hence phi = theta, phi' = w / 2, rho' = v, rho'' = v'.
    """
    x, y = at.x_m, at.y_m
    rho = math.sqrt(x * x + y * y)
    if rho < ORIGIN_M:
        polar = (at.theta_rad, v_m_s, 0.5 * w_rad_s, v_dot_m_s2)
    else:
        sin_theta, cos_theta = sincos(at.theta_rad)
        sin_alpha = (y * cos_theta - x * sin_theta) / rho
        cos_alpha = (x * cos_theta + y * sin_theta) / rho
        across = v_m_s * sin_alpha
        polar = (
            atan2(y, x),
            v_m_s * cos_alpha,
            -across / rho,
            v_dot_m_s2 * cos_alpha + across * across / rho + across * w_rad_s,
        )
    return Reference(at, v_m_s, w_rad_s, v_dot_m_s2, w_dot_rad_s2, rho, *polar)
