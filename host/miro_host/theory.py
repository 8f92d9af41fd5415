"""The paper's assumptions 1 to 3 on a trajectory, as numbers: how far a posture is from breaking them.

1. "Without loss of generality" all angles lie in (-pi, pi]. Nothing can break it but the seam: an angle that turns past
   pi comes back at -pi. The errors then jump by a turn, which wrapping takes away, unless the error itself passes pi.
2. Equation (11): rho_r = 0 at t = 0 only, and |rho_c| > rho_f for t > 0; rho_f is the measurement error, 2.40 cm.
3. Equation (12): ||phi_c - theta_c| - (2m+1) pi/2| >= alpha, m = 0 or 1: the heading is never across the line of sight
   from the origin. The paper gives no alpha. `across` is the left side, with the sign of the cosine.
"""

import math

from miro_exact.dmath import atan2, wrap_pi
from miro_host.posture import Posture

HALF_PI = 1.5707963267948966
ALPHA_RAD = 0.1
"""Ours: the paper calls alpha "a positive constant"."""


def radius(posture: Posture) -> float:
    """rho in m."""
    return math.sqrt(posture.x_m * posture.x_m + posture.y_m * posture.y_m)


def across(posture: Posture) -> float:
    """The distance in rad from a heading across the line from the origin: equation (12).

    It has the sign of cos(phi_c - theta_c), and is 0 where u1 has its 1/0. The heading may be unwrapped.
    """
    return HALF_PI - abs(wrap_pi(atan2(posture.y_m, posture.x_m) - posture.theta_rad))
