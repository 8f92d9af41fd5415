"""The pitch in the PC's memory: places of lines and walls that a camera shows as a bright band on dark ground.

        +--|--|--|--|--|--|--|--|--|--|--|--|--+
        _                  |                   _      | and _  a mark: the picture is read across the band there
     +--+  -               -               -   +--+
     |  -  -               -               -   -  |   bands: the walls' inner faces, from the floor to 5 cm, the middle
     +--+  -               -               -   +--+          line, the lines of the goals and of the goal areas
        _                  |                   _
        +--|--|--|--|--|--|--|--|--|--|--|--|--+

Sizes: FIRA MiroSot game rules (law 1: playground, walls, corners, lines), in the paper's axes: the pitch of 130 x 90 cm
reaches from x = -10 to 120 cm and from y = -10 to 80 cm. Marks keep away from where two bands meet.
"""

from __future__ import annotations

from typing import NamedTuple

LEFT_M, RIGHT_M = -0.10, 1.20
BOTTOM_M, TOP_M = -0.10, 0.80
MIDDLE_X_M, MIDDLE_Y_M = 0.55, 0.35
WALL_M = 0.05
AREA_DEPTH_M = 0.15
AREA_HALF_M = 0.25


class PitchMark(NamedTuple):
    """A place in the middle of a band on the floor at (x_m, y_m), or at the foot of a wall of `height_m`.

    The band runs along (`along_x`, `along_y`), a unit vector.
    """

    x_m: float
    y_m: float
    along_x: float
    along_y: float
    height_m: float = 0.0


_ALONG_WALL_M = (0.02, 0.11, 0.20, 0.29, 0.38, 0.47, 0.63, 0.72, 0.81, 0.90, 0.99, 1.08)
_ASIDE_WALL_M = (0.30, 0.35)
_MIDDLE_LINE_M = (0.04, 0.10, 0.16, 0.33, 0.39)
_AREA_LINE_M = (0.04, 0.10, 0.16)
_GOAL_LINE_M = (0.04, 0.12)
_AREA_SIDE_M = (0.05, 0.10)


def _all() -> tuple[PitchMark, ...]:
    marks = []
    for y in (BOTTOM_M, TOP_M):
        marks += [PitchMark(x, y, 1.0, 0.0, WALL_M) for x in _ALONG_WALL_M]
    for sign in (-1.0, 1.0):
        end_m = LEFT_M if sign < 0.0 else RIGHT_M
        area_m = end_m - sign * AREA_DEPTH_M
        for up in (-1.0, 1.0):
            marks += [PitchMark(end_m, MIDDLE_Y_M + up * y, 0.0, 1.0, WALL_M) for y in _ASIDE_WALL_M]
            marks += [PitchMark(end_m, MIDDLE_Y_M + up * y, 0.0, 1.0) for y in _GOAL_LINE_M]
            marks += [PitchMark(area_m, MIDDLE_Y_M + up * y, 0.0, 1.0) for y in _AREA_LINE_M]
            marks += [
                PitchMark(end_m - sign * x, MIDDLE_Y_M + up * AREA_HALF_M, 1.0, 0.0) for x in _AREA_SIDE_M
            ]
    for up in (-1.0, 1.0):
        marks += [PitchMark(MIDDLE_X_M, MIDDLE_Y_M + up * y, 0.0, 1.0) for y in _MIDDLE_LINE_M]
    return tuple(marks)


MARKS = _all()
