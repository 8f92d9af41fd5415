"""The pitch: its size, where the paper's world axes lie on it, and whether a robot fits.

Source: robot.md section 7 (MiroSot 1996-98: 130 x 90 cm), control.md section 5 (origin inset 10 cm from the
lower-left corner, so that the errors of Figs. 6-10 fit between the walls).
"""

from __future__ import annotations

from miro_host.posture import Posture

LENGTH_M = 1.30
WIDTH_M = 0.90
INSET_M = 0.10
ROBOT_HALF_M = 0.0375
"""Half the edge of the 7.5 cm cube."""


def corners_m() -> tuple[float, float, float, float]:
    """(left, bottom, right, top) of the pitch in the paper's axes."""
    return -INSET_M, -INSET_M, LENGTH_M - INSET_M, WIDTH_M - INSET_M


def holds(posture: Posture) -> bool:
    """Whether the robot's centre is on the pitch (walls are not modelled; a start beyond them is refused)."""
    left, bottom, right, top = corners_m()
    return left <= posture.x_m <= right and bottom <= posture.y_m <= top
