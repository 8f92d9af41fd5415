"""The patches of colour on a robot's top, from which the tracker finds its identity and posture.

Robot axes: x ahead, y left, origin in the middle of its top, a square of 75 mm. The middle between team patch and
identity patch is the robot's centre. FIRA's rules ask for a team patch of at least 35 x 35 mm, yellow or blue, and
nothing orange, which is the ball's colour.

    diagonal         ahead            strip           ahead
               +------------+                    +------------+
               | TTTT       |                    |            |
               | TTTT       |   left             | TTTT  IIII |
               |       IIII |                    | TTTT  IIII |
               |       IIII |                    |            |
               +------------+                    +------------+
"""

from typing import Literal, NamedTuple

TEAMS = ("yellow", "blue")
IDENTITIES = ("magenta", "cyan", "green", "violet", "lime")
"""Colour of the identity patch, by the robot's number in its team."""
BALL = "orange"
COLOURS = (*TEAMS, *IDENTITIES, BALL)

ROBOT_HALF_MM = 37.5
ROBOT_HEIGHT_M = 0.075
PATCH_MM = 35

PatternName = Literal["diagonal", "strip"]


class Pattern(NamedTuple):
    """Centres of the two square patches of `PATCH_MM` in robot axes, in mm."""

    team_mm: tuple[int, int]
    identity_mm: tuple[int, int]


PATTERNS: dict[PatternName, Pattern] = {
    "diagonal": Pattern((19, 19), (-19, -19)),
    "strip": Pattern((0, 19), (0, -19)),
}
