"""The posture q = (x, y, theta) of equation (8), the type that all modules share."""

import msgspec


class Posture(msgspec.Struct, frozen=True, gc=False):
    """Position and heading of the robot's centre in world axes, whose origin is the start of the reference.

    `theta_rad` is the heading against +X, counter-clockwise positive. A measurement is wrapped to (-pi, pi];
    a true posture may be unwrapped. Source: paper section III, q = [x_c, y_c, theta_c].
    """

    x_m: float
    y_m: float
    theta_rad: float
