"""Centroids of the two patches of a robot, weighted by chroma.

A television signal carries little chroma bandwidth: near an edge a pixel's chroma is a mixture of its neighbours'. With
C the mean chroma vector of a patch's colour and F that of the floor, the share of C in a chroma c is

    g . c    with g = R^-1 C / (C . R^-1 C),  R = n^2 E + F F',

the linear measure that is 1 for the patch and lets through least of noise (n) and floor (Capon 1969). A green floor has
a share in green and cyan all the same. What a share has more than the floor's is the pixel's weight: so weights begin
at 0 and do not jump.

The other patch of the robot must not pull. Solving for the shares of both colours at once would keep them apart, but it
magnifies floor and noise where hues are near (yellow and lime: a floor of 5 % becomes 50 %). So the pixels between two
patches are divided by the line of equal distance from their centroids. What that cuts off is alike on both patches, and
so leaves the robot's position and heading alone. All integers from pixel to centroid.
"""

from __future__ import annotations

from miro_host.eye.regions import Regions

_MARGIN = 3  # pixels around a region in which its colour is sought: how far the chroma filter spreads it
_LEAST = 40  # of 256: noise
_ABOVE = 13  # 5 % of 256: noise on a coloured floor
_UNKNOWN = 77  # 30 %: enough for a floor whose colour is not known
_MOST = 384  # more than a whole patch: noise, light
_UNIT = 16  # of a mean chroma: 1/16 of a level
_NOISE = 256  # n: 16 levels
_SHIFT = 12
_RIVALS = 63


class Weighing:
    """The weights for one team colour and one identity colour. `centroids` leaves its results in the `out_` fields.

    `out_weight`, `out_u`, `out_v`: sum of the weights, and of weight times 2 i + 1 over columns and rows, for the
    team's patch [0] and the identity's [1]: the centroid is out_u / (2 out_weight).
    """

    NOT_STATE = ("*",)

    def __init__(
        self, team: tuple[int, int], identity: tuple[int, int], floor: tuple[int, int] | None = None
    ) -> None:
        """Mean Cb - 128 and Cr - 128 in 1/16 level of both colours and of the floor, None if that is not known.

        Raises ValueError for a colour without chroma.
        """
        self.gain_cb = [0] * 2
        self.gain_cr = [0] * 2
        self.least = [0] * 2
        self.out_weight = [0] * 2
        self.out_u = [0] * 2
        self.out_v = [0] * 2
        self.rival_u = [0] * 64
        self.rival_v = [0] * 64
        self.rivals = 0
        for which in range(2):
            cb, cr = _gain((team, identity)[which], floor or (0, 0))
            self.gain_cb[which], self.gain_cr[which], self.least[which] = cb, cr, _UNKNOWN
            if floor is not None:
                share = (cb * floor[0] + cr * floor[1]) // (_UNIT << _SHIFT)
                self.least[which] = max(_LEAST, share + _ABOVE)

    def __repr__(self) -> str:
        gains = [(self.gain_cb[which], self.gain_cr[which], self.least[which]) for which in (0, 1)]
        return f"Weighing(gains and least={gains})"

    def weight(self, which: int, cb: int, cr: int) -> int:
        """A pixel's share of the team (0) or identity (1) colour beyond the floor's share, in 1/256."""
        share = (self.gain_cb[which] * (cb - 128) + self.gain_cr[which] * (cr - 128)) >> _SHIFT
        return max(0, min(share - self.least[which], _MOST))

    def centroids(
        self, pixels: bytearray, regions: Regions, team: int, identity: int, rival_area: int
    ) -> None:
        """Weighs the pixels around two regions of the window that `regions` looked at last.

        A pixel belongs to a region if it lies in its box with a margin, and neither the other of the two nor any other
        region of at least `rival_area` pixels, a patch of another robot, is nearer by its centroid.
        """
        self.rivals = 1
        for index in range(regions.count):
            if index != team and index != identity and regions.area[index] >= rival_area:
                if self.rivals < _RIVALS:
                    self.place(self.rivals, regions, index)
                    self.rivals += 1
        self.place(0, regions, identity)
        self.weigh(0, pixels, regions, team)
        self.place(0, regions, team)
        self.weigh(1, pixels, regions, identity)

    def place(self, rival: int, regions: Regions, index: int) -> None:
        """Puts down where a rival's centroid is, in 1/16 px, rounded down."""
        self.rival_u[rival] = 8 * regions.sum_u[index] // regions.area[index]
        self.rival_v[rival] = 8 * regions.sum_v[index] // regions.area[index]

    def weigh(self, which: int, pixels: bytearray, regions: Regions, index: int) -> None:
        """The sums of one region's weights."""
        total = total_u = total_v = 0
        own_u = 8 * regions.sum_u[index] // regions.area[index]
        own_v = 8 * regions.sum_v[index] // regions.area[index]
        left = max(0, regions.left[index] - _MARGIN)
        right = min(regions.width, regions.right[index] + _MARGIN)
        top = max(0, regions.top[index] - _MARGIN)
        bottom = min(regions.height, regions.bottom[index] + _MARGIN)
        data = pixels
        for row in range(top, bottom):
            at = 3 * (row * regions.width + left)
            for column in range(left, right):
                weight = self.weight(which, data[at + 1], data[at + 2])
                at += 3
                if weight != 0:
                    u = 16 * column + 8
                    v = 16 * row + 8
                    if self.nearest(u, v, (u - own_u) * (u - own_u) + (v - own_v) * (v - own_v)):
                        total += weight
                        total_u += weight * (2 * column + 1)
                        total_v += weight * (2 * row + 1)
        self.out_weight[which] = total
        self.out_u[which] = total_u
        self.out_v[which] = total_v

    def nearest(self, u: int, v: int, own: int) -> bool:
        """True if no rival is nearer to a point in 1/16 px than `own`, a square of a distance."""
        for rival in range(self.rivals):
            along = u - self.rival_u[rival]
            down = v - self.rival_v[rival]
            if along * along + down * down < own:
                return False
        return True

    def centroid(self, which: int) -> tuple[float, float]:
        """(u, v) of the centroid of the team's patch (0) or the identity's (1) in the window.

        Raises ValueError if no pixel had a weight.
        """
        if self.out_weight[which] == 0:
            raise ValueError("no pixel has a weight")
        weight = self.out_weight[which]
        return 0.5 * self.out_u[which] / weight, 0.5 * self.out_v[which] / weight


def _gain(own: tuple[int, int], floor: tuple[int, int]) -> tuple[int, int]:
    """g of the formula above in 2^_SHIFT / 256 a level: the adjugate of R stands for its inverse."""
    cb_cb = _NOISE * _NOISE + floor[0] * floor[0]
    cb_cr = floor[0] * floor[1]
    cr_cr = _NOISE * _NOISE + floor[1] * floor[1]
    cb = cr_cr * own[0] - cb_cr * own[1]
    cr = cb_cb * own[1] - cb_cr * own[0]
    whole = cb * own[0] + cr * own[1]
    if whole == 0:
        raise ValueError("a colour without chroma has no share in a pixel")
    scale = _UNIT << (_SHIFT + 8)
    return scale * cb // whole, scale * cr // whole
