"""The top of a robot as a calibrated camera sees it: where its two patches are, and what two patches say."""

from __future__ import annotations

import math

from miro_exact.dmath import atan2, sincos, wrap_pi
from miro_host.eye.calibration import Calibration
from miro_host.eye.patterns import PATCH_MM, PATTERNS, ROBOT_HEIGHT_M, PatternName

_DISTANCE = 0.2  # share by which a pair's distance may differ from the pattern's
# Shares of a patch's expected area: half covered pixels and dim light make it smaller, two patches in one are 2.
_LEAST = 0.35
_MOST = 1.5


class Top:
    """A pattern under a calibration. Constant.

    `angle_rad`: of the vector from identity patch to team patch in robot axes, `distance_m` its length. `z_m`: height
    at which pixels are evaluated. `area_px`, `side_px`: of a patch under the camera. `least_m`, `most_m`: distance of
    two patches that are a pair; `least_area`, `most_area`: of a patch in px.
    """

    NOT_STATE = ("*",)

    def __init__(self, pattern: PatternName, calibration: Calibration) -> None:
        self.pattern = pattern
        self.lens = calibration.lens()
        team_mm, identity_mm = PATTERNS[pattern]
        along, across = float(team_mm[0] - identity_mm[0]), float(team_mm[1] - identity_mm[1])
        self.angle_rad = atan2(across, along)
        self.distance_m = math.sqrt(along * along + across * across) / 1000.0
        self.z_m = calibration.height_m(ROBOT_HEIGHT_M)
        patch_m = PATCH_MM / 1000.0
        fall_m = self.lens.height_m - self.z_m
        self.area_px = self.lens.focal_u * self.lens.focal_v * patch_m * patch_m / (fall_m * fall_m)
        self.side_px = math.sqrt(self.area_px)
        reach_m = _DISTANCE * self.distance_m
        self.least_m, self.most_m = self.distance_m - reach_m, self.distance_m + reach_m
        self.least_area, self.most_area = math.ceil(_LEAST * self.area_px), math.floor(_MOST * self.area_px)

    def __repr__(self) -> str:
        return f"Top({self.pattern!r}, {self.distance_m * 1000.0:.1f} mm, {self.area_px:.1f} px)"

    def places(self, x_m: float, y_m: float, theta_rad: float) -> tuple[float, float, float, float]:
        """x, y of the team patch and of the identity patch of a robot, in m."""
        sin, cos = sincos(theta_rad + self.angle_rad)
        dx = 0.5 * self.distance_m * cos
        dy = 0.5 * self.distance_m * sin
        return x_m + dx, y_m + dy, x_m - dx, y_m - dy

    def posture(
        self, team_u: float, team_v: float, identity_u: float, identity_v: float
    ) -> tuple[float, float, float]:
        """x, y and heading of the robot with these centroids: its centre is in the middle of its patches.

        Raises ValueError for a pixel that does not look at the ground.
        """
        team_x, team_y = self.lens.ground(team_u, team_v, self.z_m)
        identity_x, identity_y = self.lens.ground(identity_u, identity_v, self.z_m)
        return (
            0.5 * (team_x + identity_x),
            0.5 * (team_y + identity_y),
            wrap_pi(atan2(team_y - identity_y, team_x - identity_x) - self.angle_rad),
        )

    def confidence(self, gap_m: float, team_area: int, identity_area: int) -> float:
        """Distance of a pair from the nearest limit for a robot: 1 in the middle, 0 at the limit."""
        least = 1.0 - abs(gap_m - self.distance_m) / (_DISTANCE * self.distance_m)
        return max(0.0, min(least, self.margin(team_area), self.margin(identity_area)))

    def margin(self, area: int) -> float:
        """Distance of a patch's area from the nearest limit: 1 at the expected area, 0 at the limit."""
        share = area / self.area_px
        if share < 1.0:
            return (share - _LEAST) / (1.0 - _LEAST)
        return (_MOST - share) / (_MOST - 1.0)
