"""The rays of all pixel corners, in integers: the camera's geometry, computed once.

       camera                        corner (i, j) of pixel (i, j), 321 x 241 of them
         /\\                          slope: how far a ray goes for each unit that it falls, times 2^22
        /  \\                         top: where it passes the height of the robots' tops, in um
    ---/----\\---  robots' tops      fall: how much further it goes from there to the floor
      /      \\
    -/--------\\-  floor             A pixel is sampled on a grid of 4 x 4 points between its corners (bilinear).
"""

from __future__ import annotations

import math
from array import array
from functools import lru_cache

from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.lens import Lens

_WIDTH = 320
_HEIGHT = 240
_CORNERS = 321
_TOP_UM = 75_000
_HALF_UM = 37_500
_MOST = 8 << 22  # a slope of 8 is 83 degrees: products of slopes and lengths stay within 64 bits
_MARGIN_SPARE_UM = 4  # what rounding adds: a bilinear mean, and a turn into a robot's axes


class Rays:
    """The rays of one camera. Constant. All lengths in um, in the paper's axes.

    `spread_um`: no sample of a pixel is further than this from the mean of its corners, on the floor and at the top,
    rounding included. `stride_um`: nor are the middles of two neighbours from each other, at the top.
    """

    NOT_STATE = ("*",)

    def __init__(self, parameters: CameraParameters) -> None:
        """Raises ValueError for a camera that looks near to the horizon, or at what its lens cannot draw."""
        lens = Lens(parameters)
        self.x_um = _um(parameters.x_m)
        self.y_um = _um(parameters.y_m)
        self.height_um = _um(parameters.height_m)
        self.slope_x = array("i", bytes(4 * 77364))
        self.slope_y = array("i", bytes(4 * 77364))
        self.top_x = array("i", bytes(4 * 77364))
        self.top_y = array("i", bytes(4 * 77364))
        self.middle_x = array("i", bytes(4 * 76800))
        self.middle_y = array("i", bytes(4 * 76800))
        self.fall_x = array("i", bytes(4 * 76800))
        self.fall_y = array("i", bytes(4 * 76800))
        self._cast(lens)
        self._gather()

    def __repr__(self) -> str:
        return f"Rays(({self.x_um}, {self.y_um}, {self.height_um}) um, spread {self.spread_um} um)"

    def _cast(self, lens: Lens) -> None:
        for j in range(_HEIGHT + 1):
            for i in range(_WIDTH + 1):
                lens.slopes(float(i), float(j))
                exact_x = lens.out_x * 4194304.0 + 0.5
                exact_y = lens.out_y * 4194304.0 + 0.5
                if not (-_MOST < exact_x < _MOST and -_MOST < exact_y < _MOST):
                    raise ValueError(f"pixel ({i}, {j}) looks too near to the horizon")
                x, y = int(exact_x // 1.0), int(exact_y // 1.0)
                corner = j * _CORNERS + i
                self.slope_x[corner] = x
                self.slope_y[corner] = y
                self.top_x[corner] = self.x_um + ((self.height_um - _TOP_UM) * x >> 22)
                self.top_y[corner] = self.y_um + ((self.height_um - _TOP_UM) * y >> 22)

    def _gather(self) -> None:
        """The means of each pixel's corners, and how far from them corners and neighbours are."""
        spread = stride = 0
        for pixel in range(_WIDTH * _HEIGHT):
            a = pixel + pixel // _WIDTH
            c = a + _CORNERS
            x = self.slope_x[a] + self.slope_x[a + 1] + self.slope_x[c] + self.slope_x[c + 1]
            y = self.slope_y[a] + self.slope_y[a + 1] + self.slope_y[c] + self.slope_y[c + 1]
            self.fall_x[pixel] = _TOP_UM * x >> 24
            self.fall_y[pixel] = _TOP_UM * y >> 24
            x = self.top_x[a] + self.top_x[a + 1] + self.top_x[c] + self.top_x[c + 1]
            y = self.top_y[a] + self.top_y[a + 1] + self.top_y[c] + self.top_y[c + 1]
            self.middle_x[pixel] = (x + 2) >> 2
            self.middle_y[pixel] = (y + 2) >> 2
            for corner in range(4):  # on the floor
                at = a + (corner >> 1) * _CORNERS + (corner & 1)
                x = self.top_x[at] + (_TOP_UM * self.slope_x[at] >> 22)
                y = self.top_y[at] + (_TOP_UM * self.slope_y[at] >> 22)
                x -= self.middle_x[pixel] + self.fall_x[pixel]
                y -= self.middle_y[pixel] + self.fall_y[pixel]
                spread = max(spread, x * x + y * y)
            for step in range(2):  # to the left and above, at the height of the tops
                other = pixel - (1 if step else _WIDTH)
                if pixel % _WIDTH if step else other >= 0:
                    x = self.middle_x[pixel] - self.middle_x[other]
                    y = self.middle_y[pixel] - self.middle_y[other]
                    stride = max(stride, x * x + y * y)
        self.spread_um = math.isqrt(spread) + 1 + _MARGIN_SPARE_UM
        self.stride_um = math.isqrt(stride) + 1 + _MARGIN_SPARE_UM


def enters(u: int, v: int, fall_u: int, fall_v: int) -> bool:
    """True if the line from (u, v) on by the fall meets the square of a robot (separating axes)."""
    if (u < -_HALF_UM and u + fall_u < -_HALF_UM) or (u > _HALF_UM and u + fall_u > _HALF_UM):
        return False  # both ends are beyond one side
    if (v < -_HALF_UM and v + fall_v < -_HALF_UM) or (v > _HALF_UM and v + fall_v > _HALF_UM):
        return False
    most = _HALF_UM * (abs(fall_u) + abs(fall_v))
    return -most <= u * fall_v - v * fall_u <= most


def entry(u: int, v: int, fall_u: int, fall_v: int) -> int:
    """The height at which such a line, which begins outside the square of a robot, enters it."""
    latest = 0
    if abs(u) > _HALF_UM and fall_u != 0:
        latest = (abs(u) - _HALF_UM << 16) // abs(fall_u)
    if abs(v) > _HALF_UM and fall_v != 0:
        latest = max(latest, (abs(v) - _HALF_UM << 16) // abs(fall_v))
    return _TOP_UM - (_TOP_UM * latest >> 16)


def _um(metres: float) -> int:
    return math.floor(metres * 1e6 + 0.5)


@lru_cache(maxsize=4)
def rays_of(parameters: CameraParameters) -> Rays:
    """The rays of a camera. Working them out takes longer than building a world: each camera has them once."""
    assert (WIDTH, HEIGHT) == (_WIDTH, _HEIGHT)
    return Rays(parameters)
