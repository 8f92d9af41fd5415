"""Tracking errors in the robot's own axes, as Kanayama et al. (ICRA 1990) define them.

The errors are those of the reference as the robot sees it: x ahead, y to the left, theta anticlockwise. They do not
depend on where the origin of the world axes is.
"""

import msgspec

from miro_exact.dmath import sincos, wrap_pi
from miro_host.posture import Posture


class Errors(msgspec.Struct, frozen=True):
    """Where the reference is, seen from the robot; `theta_rad` in (-pi, pi]."""

    x_m: float
    y_m: float
    theta_rad: float


def errors(reference: Posture, robot: Posture) -> Errors:
    """The errors of `robot` against `reference`."""
    sin, cos = sincos(robot.theta_rad)
    dx_m, dy_m = reference.x_m - robot.x_m, reference.y_m - robot.y_m
    theta_rad = wrap_pi(reference.theta_rad - robot.theta_rad)
    return Errors(cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m, theta_rad)
