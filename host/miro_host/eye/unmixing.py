"""Centroids of the two patches of a robot, weighted by chroma.

What belongs here: how much of a pixel is of the team's colour and how much of the identity's, and the centroids of
these shares. What does not: finding the regions (`regions`), choosing the pair (`patches`).

A television signal carries little chroma bandwidth: near an edge a pixel's chroma is a mixture of its neighbours'.
With T and I the mean chroma vectors of the two classes, a pixel c = t T + i I has the shares

    t = (c x I) / (T x I),    i = (T x c) / (T x I),    x: cross product in the plane of Cb and Cr.

Where T and I point into nearly the same or the opposite direction, that would magnify noise; the projections
t = (c . T) / |T|^2, i = (c . I) / |I|^2 stand for them, which do not keep apart like colours. Shares are integers in
1/256 from pixel to centroid; below `_LEAST` they count as 0, above `_MOST` (more than a
whole patch: noise, light) as that.
"""

from __future__ import annotations

from miro_host.eye.regions import Regions

_MARGIN = 3  # pixels around a region in which its colour is sought: how far the chroma filter spreads it
_LEAST = 40  # of 256
_MOST = 384
_UNIT = 16  # of a mean chroma: 1/16 of a level
_SHIFT = 12


class Unmixing:
    """The shares of one team colour and one identity colour. `centroids` leaves its results in the `out_` fields.

    `out_weight`, `out_u`, `out_v`: sum of the shares, and of share times 2 i + 1 over columns and rows, for the team's
    patch [0] and the identity's [1]: the centroid is out_u / (2 out_weight).
    """

    NOT_STATE = ("gain_cb", "gain_cr", "out_weight", "out_u", "out_v", "rival", "rivals")

    def __init__(self, team: tuple[int, int], identity: tuple[int, int]) -> None:
        """`team`, `identity`: mean Cb - 128 and Cr - 128 in 1/16 level. ValueError for a colour without chroma."""
        self.gain_cb = [0] * 2
        self.gain_cr = [0] * 2
        self.out_weight = [0] * 2
        self.out_u = [0] * 2
        self.out_v = [0] * 2
        self.rival = [0] * 64
        self.rivals = 0
        gains = _gains(team, identity)
        for which in range(2):
            self.gain_cb[which] = gains[which][0]
            self.gain_cr[which] = gains[which][1]

    def __repr__(self) -> str:
        return f"Unmixing(gains={[(self.gain_cb[k], self.gain_cr[k]) for k in (0, 1)]})"

    def shares(self, cb: int, cr: int) -> tuple[int, int]:
        """(team, identity) of a pixel in 1/256, as they count."""
        return self.share(0, cb - 128, cr - 128), self.share(1, cb - 128, cr - 128)

    def share(self, which: int, cb: int, cr: int) -> int:
        """Share of the team (0) or the identity (1) in a chroma, 0 where it is too small to count."""
        weight = (self.gain_cb[which] * cb + self.gain_cr[which] * cr) >> _SHIFT
        if weight < _LEAST:
            return 0
        return weight if weight < _MOST else _MOST

    def centroids(
        self, pixels: bytearray, regions: Regions, team: int, identity: int, rival_area: int
    ) -> None:
        """Weighs the pixels around two regions of the window that `regions` looked at last.

        A pixel belongs to the region if it lies in its box with a margin, and no other region of at least `rival_area`
        pixels is nearer by its centroid: patches of other robots.
        """
        self.rivals = 0
        for index in range(regions.count):
            if index != team and index != identity and regions.area[index] >= rival_area and self.rivals < 64:
                self.rival[self.rivals] = index
                self.rivals += 1
        self.weigh(0, pixels, regions, team)
        self.weigh(1, pixels, regions, identity)

    def weigh(self, which: int, pixels: bytearray, regions: Regions, index: int) -> None:
        """The sums of one region's shares."""
        total = 0
        total_u = 0
        total_v = 0
        left = max(0, regions.left[index] - _MARGIN)
        right = min(regions.width, regions.right[index] + _MARGIN)
        for row in range(
            max(0, regions.top[index] - _MARGIN), min(regions.height, regions.bottom[index] + _MARGIN)
        ):
            at = 3 * (row * regions.width + left)
            for column in range(left, right):
                weight = self.share(which, pixels[at + 1] - 128, pixels[at + 2] - 128)
                at += 3
                if weight == 0:
                    continue
                if self.rivals != 0 and not self.nearest(regions, index, column, row):
                    continue
                total += weight
                total_u += weight * (2 * column + 1)
                total_v += weight * (2 * row + 1)
        self.out_weight[which] = total
        self.out_u[which] = total_u
        self.out_v[which] = total_v

    def nearest(self, regions: Regions, index: int, column: int, row: int) -> bool:
        """Whether a pixel is nearer to this region's centroid than to any rival's."""
        own = self.distance(regions, index, column, row)
        place = 0
        while place < self.rivals and self.distance(regions, self.rival[place], column, row) >= own:
            place += 1
        return place == self.rivals

    def distance(self, regions: Regions, index: int, column: int, row: int) -> int:
        """Square of the distance from a pixel to a centroid, in 1/256 px^2, rounded down per axis to 1/16 px."""
        along = 16 * column + 8 - 8 * regions.sum_u[index] // regions.area[index]
        down = 16 * row + 8 - 8 * regions.sum_v[index] // regions.area[index]
        return along * along + down * down


def _gains(team: tuple[int, int], identity: tuple[int, int]) -> list[tuple[int, int]]:
    """Factors of Cb and Cr for both shares, in 2^_SHIFT / 256 a level."""
    cross = team[0] * identity[1] - team[1] * identity[0]
    squares = [colour[0] * colour[0] + colour[1] * colour[1] for colour in (team, identity)]
    if min(squares) == 0:
        raise ValueError("a colour without chroma has no share in a pixel")
    scale = _UNIT << (_SHIFT + 8)
    if (
        9 * cross * cross > squares[0] * squares[1]
    ):  # the angle between them is more than 19 degrees from 0 and 180
        return [
            (scale * identity[1] // cross, -scale * identity[0] // cross),
            (-scale * team[1] // cross, scale * team[0] // cross),
        ]
    return [
        (scale * colour[0] // square, scale * colour[1] // square)
        for colour, square in zip((team, identity), squares, strict=True)
    ]
