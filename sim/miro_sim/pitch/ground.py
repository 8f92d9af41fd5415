"""The pitch: its size, where the paper's axes lie on it, and whether a robot stands on it.

There are no walls yet: a robot that drives off the pitch drives on.

    top 80 cm     +--------------------------------------+
                  |                                      |   130 x 90 cm, robots of 7.5 x 7.5 cm:
                  |    y                                 |   FIRA MiroSot game rules as of 1998
                  |    ^   heading counter-clockwise     |   (law 1, playground; law 2, robots)
                  |    o--> x                            |
    bottom -10 cm +--------------------------------------+
              left -10 cm                           right 120 cm

The paper does not say where on the pitch its origin lies. It is put 10 cm from the lower left corner, so that the
starts of Figs. 6 to 10 and their paths fit.
"""

from __future__ import annotations

from miro_host.posture import Posture

LENGTH_M = 1.30
WIDTH_M = 0.90
INSET_M = 0.10
LEFT_M, RIGHT_M = -INSET_M, LENGTH_M - INSET_M
BOTTOM_M, TOP_M = -INSET_M, WIDTH_M - INSET_M
ROBOT_HALF_M = 0.0375
"""Half the edge of the robot's square."""


def reach_m(theta_rad: float) -> float:
    """Extent of the robot's square at this heading from its centre along x, which is the same along y, in metres.

    A corner is half an edge ahead and half an edge aside: the largest of |+-cos +- sin| half edges.
    """
    from miro_exact.dmath import sincos  # a hot module: not before the engine was chosen

    sin, cos = sincos(theta_rad)
    return ROBOT_HALF_M * (abs(cos) + abs(sin))


def holds(posture: Posture) -> bool:
    """True if all four corners of the robot's square are on the pitch."""
    reach = reach_m(posture.theta_rad)
    return (
        LEFT_M + reach <= posture.x_m <= RIGHT_M - reach and BOTTOM_M + reach <= posture.y_m <= TOP_M - reach
    )
