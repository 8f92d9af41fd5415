"""Pairs of patches in one window: which regions can be the top of a robot.

A region is a patch if its area is within the bounds of `Top`. It is whole if it does not touch the border of the
window; only whole patches make a pair. A pair is contested if one of its patches could also belong to a patch of
another robot: any team's or identity's colour at the pattern's distance, whole or not.

How far a pair is from an expected posture is the root mean square of the distances of its two patches from their
expected places; it includes the heading. Of several expected postures the nearest counts.
"""

from __future__ import annotations

import math

from miro_host.eye.regions import Regions
from miro_host.eye.top import Top

_MOST = 170  # patches of a window: 4096 pixels, at least 24 each
_TEAMS = 2  # classes 1 and 2 are the teams', 3 to 7 the identities'
_IDENTITIES = 7
_FAR = 1.0e9


class Patches:
    """Reads windows. `look` finds the patches, `choose` the pair; results stay in the fields `out_`.

    `out_pairs`: pairs at the pattern's distance. `out_team`, `out_identity`: regions of the nearest. `out_off_m`: its
    distance from the expected place, `out_next_m`: that of the second. `out_contested`: see above. `out_gap_m`:
    distance of its two patches.
    """

    NOT_STATE = ("*",)

    def __init__(self, regions: Regions, top: Top) -> None:
        self.regions = regions
        self.robot_top = top
        self.count = self.left = self.top = self.expected = 0
        self.index = [0] * 170
        self.x_m = [0.0] * 170
        self.y_m = [0.0] * 170
        self.expect_x = [0.0] * 4
        self.expect_y = [0.0] * 4
        self.out_pairs = 0
        self.out_team = self.out_identity = -1
        self.out_off_m = self.out_next_m = self.out_gap_m = 0.0
        self.out_contested = False

    def __repr__(self) -> str:
        return f"Patches({self.count} in {self.regions!r} at ({self.left}, {self.top}))"

    def look(self, pixels: bytearray, left: int, top: int, width: int, height: int) -> int:
        """Finds the patches in a window of the picture; returns their number. Raises ValueError as `Regions` does."""
        self.regions.find(pixels, width, height)
        self.left = left
        self.top = top
        self.count = 0
        for region in range(self.regions.count):
            if self.regions.kind[region] <= _IDENTITIES and self.is_patch(region) and self.count < _MOST:
                self.place(region)
        return self.count

    def place(self, region: int) -> None:
        """Adds a patch, unless the lens could not draw it where it is."""
        u, v = self.regions.centroid(region)
        try:
            x_m, y_m = self.robot_top.lens.ground(self.left + u, self.top + v, self.robot_top.z_m)
        except ValueError:
            return
        self.index[self.count] = region
        self.x_m[self.count] = x_m
        self.y_m[self.count] = y_m
        self.count += 1

    def is_patch(self, region: int) -> bool:
        """True if a region has the size of a patch; half of it is enough for one that is cut off."""
        area = self.regions.area[region]
        if self.regions.touches[region]:
            area += area
        top = self.robot_top
        return top.least_area <= area and self.regions.area[region] <= top.most_area

    def expect_nothing(self) -> None:
        """Any pair is as good as any other."""
        self.expected = 0

    def expect(self, team_x: float, team_y: float, identity_x: float, identity_y: float) -> None:
        """Adds a posture that is expected, by the places of its patches in m. The third and later ones are ignored."""
        if self.expected < 2:
            at = 2 * self.expected
            self.expect_x[at] = team_x
            self.expect_y[at] = team_y
            self.expect_x[at + 1] = identity_x
            self.expect_y[at + 1] = identity_y
            self.expected += 1

    def choose(self, team: int, identity: int) -> int:
        """Chooses the pair of these two classes nearest to the expected place; returns the number of pairs."""
        self.out_pairs = 0
        self.out_off_m = self.out_next_m = _FAR
        for mark in range(self.count):
            if self.is_whole(mark, team):
                for other in range(self.count):
                    if self.is_whole(other, identity) and self.fits(mark, other):
                        self.take(mark, other)
        return self.out_pairs

    def is_whole(self, patch: int, kind: int) -> bool:
        """True if a patch is of this class and complete."""
        region = self.index[patch]
        return self.regions.kind[region] == kind and not self.regions.touches[region]

    def fits(self, mark: int, other: int) -> bool:
        """True if two patches are as far from each other as those of a robot."""
        dx = self.x_m[mark] - self.x_m[other]
        dy = self.y_m[mark] - self.y_m[other]
        least_m, most_m = self.robot_top.least_m, self.robot_top.most_m
        return least_m * least_m <= dx * dx + dy * dy <= most_m * most_m

    def take(self, mark: int, other: int) -> None:
        """Takes a found pair as the nearest so far, or as the second."""
        self.out_pairs += 1
        off = self.off_m(mark, other)
        if off >= self.out_off_m:
            self.out_next_m = min(self.out_next_m, off)
            return
        self.out_next_m = self.out_off_m
        self.out_off_m = off
        self.out_team = self.index[mark]
        self.out_identity = self.index[other]
        dx = self.x_m[mark] - self.x_m[other]
        dy = self.y_m[mark] - self.y_m[other]
        self.out_gap_m = math.sqrt(dx * dx + dy * dy)
        self.out_contested = self.partners(mark) > 1 or self.partners(other) > 1

    def off_m(self, team: int, identity: int) -> float:
        """Distance of a pair from the expected place, in metres; 0 if there is none."""
        if self.expected == 0:
            return 0.0
        least = _FAR
        for at in range(0, 2 * self.expected, 2):
            tx = self.x_m[team] - self.expect_x[at]
            ty = self.y_m[team] - self.expect_y[at]
            ix = self.x_m[identity] - self.expect_x[at + 1]
            iy = self.y_m[identity] - self.expect_y[at + 1]
            off = math.sqrt(0.5 * (tx * tx + ty * ty + ix * ix + iy * iy))
            if off < least:
                least = off
        return least

    def partners(self, patch: int) -> int:
        """Number of patches that this one could make a robot with, of any team and identity."""
        of_team = self.regions.kind[self.index[patch]] <= _TEAMS
        count = 0
        for other in range(self.count):
            if (self.regions.kind[self.index[other]] <= _TEAMS) != of_team and self.fits(patch, other):
                count += 1
        return count
