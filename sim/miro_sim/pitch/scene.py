"""The static scene of the camera: floor, lines, goals, walls and the ball.

        +---------[ 40 cm goal is 15 cm deep ]--+
        |/ 7 cm              |                 \\|      walls 5 cm high, 2.5 cm wide, white inside, black on top
     +--+         circle     |                  +--+    lines 3 mm wide
     |            r 25 cm    |                     |
     +--+  goal area         |                  +--+   130 x 90 cm between the walls
        |\\ 50 x 15 cm        |                 /|
        +--------------------+------------------+

Sizes: FIRA MiroSot game rules (law 1: playground, walls, corners, lines). Chosen: the triangles in the corners are as
high and black as the walls; no penalty areas and no marks. The camera must hang above the pitch: outer faces of walls
are not drawn.

The ball lies on the floor. It is drawn as four rings, brighter towards its middle.

A pixel is sampled when it is first looked at, unless all its samples are sure to see the floor, or what is outside.
What the sensor makes of it is kept too, for the light of one moment.
"""

from __future__ import annotations

import math
from array import array
from functools import lru_cache

from miro_host.eye.camera_parameters import CameraParameters
from miro_sim.pitch.ground import INSET_M, LENGTH_M, WIDTH_M
from miro_sim.pitch.paints import NUMBERS, packed
from miro_sim.pitch.picture_settings import PictureSettings
from miro_sim.pitch.rays import Rays, rays_of
from miro_sim.pitch.sensor import Sensor

_MIXED = 255
_UNKNOWN = 254
_CORNERS = 321
_WIDTH = 320
_PAD = 8
_WALL_HEIGHT_UM = 50_000
_WALL_UM = 25_000
_GOAL_HALF_UM = 200_000
_GOAL_DEPTH_UM = 150_000
_CORNER_UM = 70_000
_LINE_HALF_UM = 1_500
_BALL_UM = 21_350  # radius of a golf ball of 42.7 mm
_CIRCLE_UM = 250_000
_AREA_HALF_UM = 250_000
_AREA_DEPTH_UM = 150_000
_FAR_SQUARE = 625e9  # of the corner of the pitch from its middle, in um^2


class Scene:
    """The scene without robots; `ball`: above which place (um) its centre is, if there is one.

    `paint` of a pixel: a number, or MIXED; `total`: its 16 samples added; `light`: its share of the light, times 4096.
    `y`, `cb`, `cr`: what the sensor makes of it in the light of scale `lit`, in each line between two columns.
    """

    NOT_STATE = ("*",)

    def __init__(self, rays: Rays, picture: PictureSettings, ball: tuple[int, int] | None) -> None:
        self.rays = rays
        self.packed = packed(picture.black_floor)
        self.falloff = math.floor(picture.light_falloff * 4096.0 * 4503599627370496.0 / _FAR_SQUARE + 0.5)
        self.paint = bytearray([_UNKNOWN]) * 76800
        self.total = array("q", bytes(8 * 76800))
        self.light = array("h", bytes(2 * 76800))
        self.lit = array("i", b"\xff" * (4 * 240))  # -1
        self.lit_first = array("i", bytes(4 * 240))
        self.lit_end = array("i", bytes(4 * 240))
        self.y = array("h", bytes(2 * 76816))
        self.cb = array("h", bytes(2 * 76816))
        self.cr = array("h", bytes(2 * 76816))
        self.half_x = round(LENGTH_M * 500_000.0)
        self.half_y = round(WIDTH_M * 500_000.0)
        self.middle_x = self.half_x - round(INSET_M * 1e6)
        self.middle_y = self.half_y - round(INSET_M * 1e6)
        self.floor = NUMBERS["floor"]
        self.line = NUMBERS["line"]
        self.wall_top = NUMBERS["wall top"]
        self.wall_face = NUMBERS["wall face"]
        self.outside = NUMBERS["outside"]
        self.ball_rim = NUMBERS["ball rim"]
        self.has_ball = ball is not None
        self.ball_x, self.ball_y = ball or (0, 0)
        self.slope_x, self.slope_y = [0] * 16, [0] * 16

    def __repr__(self) -> str:
        return f"Scene({self.rays!r}, ball={(self.ball_x, self.ball_y) if self.has_ball else None})"

    def shows_ball(self, pixel: int) -> bool:
        """True if one of a pixel's samples may be the ball's; `behind` has been called."""
        paint = self.paint[pixel]
        return self.has_ball and (paint == _MIXED or paint >= self.ball_rim) and self._near_ball(pixel)

    def _near_ball(self, pixel: int) -> bool:
        """True if the ball may be seen in a pixel: looked at along each axis alone."""
        rays = self.rays
        far = _BALL_UM + rays.spread_um
        x, y = rays.middle_x[pixel] - self.ball_x, rays.middle_y[pixel] - self.ball_y
        end_x, end_y = x + rays.fall_x[pixel], y + rays.fall_y[pixel]
        least, most = max(min(x, end_x), min(y, end_y)), min(max(x, end_x), max(y, end_y))
        return least <= far and most >= 0 - far

    def show(self, sensor: Sensor, row: int, first: int, end: int, instants: int) -> None:
        """Puts the pixels of a line into the sensor's; `instants`: how many times their samples are added."""
        known_first, known_end = self.lit_first[row], self.lit_end[row]
        if self.lit[row] != sensor.scale or end < known_first or first > known_end:
            known_first = known_end = first
            self.lit[row] = sensor.scale
        self._light_up(sensor, row, first, known_first, instants)
        self._light_up(sensor, row, known_end, end, instants)
        self.lit_first[row], self.lit_end[row] = min(first, known_first), max(end, known_end)
        pixel = row * _WIDTH + first
        _copy(self.y, pixel, sensor.y, first + _PAD, end - first)
        _copy(self.cb, pixel, sensor.cb, first + _PAD, end - first)
        _copy(self.cr, pixel, sensor.cr, first + _PAD, end - first)

    def _light_up(self, sensor: Sensor, row: int, first: int, end: int, instants: int) -> None:
        """Keeps what the sensor makes of pixels, with less light further from the middle: by the square."""
        for column in range(first, end):
            pixel = row * _WIDTH + column
            self.behind(pixel)
            x = self.rays.middle_x[pixel] - self.middle_x
            y = self.rays.middle_y[pixel] - self.middle_y
            self.light[pixel] = 4096 - min((x * x + y * y >> 20) * self.falloff >> 32, 4096)
            sensor.put(column, self.total[pixel] * instants, self.light[pixel])
            self.y[pixel] = sensor.y[column + _PAD]
            self.cb[pixel] = sensor.cb[column + _PAD]
            self.cr[pixel] = sensor.cr[column + _PAD]

    def behind(self, pixel: int) -> int:
        """`paint` of a pixel, which is looked at if that was not done before."""
        if self.paint[pixel] == _UNKNOWN:
            self.look(pixel)
        return self.paint[pixel]

    def look(self, pixel: int) -> None:
        """Fills `paint` and `total` of a pixel."""
        paint = self._sure(pixel)
        if paint >= 0:
            self.paint[pixel] = paint
            self.total[pixel] = 16 * self.packed[paint]
            return
        self.spread(pixel)
        first = self.sample(0)
        self.paint[pixel] = first
        self.total[pixel] = self.packed[first]
        for sample in range(1, 16):
            paint = self.sample(sample)
            self.total[pixel] += self.packed[paint]
            if paint != first:
                self.paint[pixel] = _MIXED

    def spread(self, pixel: int) -> None:
        """Turns to the samples of a pixel: their slopes, between its corners, row by row."""
        rays = self.rays
        a = pixel + pixel // _WIDTH
        c = a + _CORNERS
        for line in range(0, 16, 4):
            down = line // 2 + 1
            x = 8 * rays.slope_x[a] + down * (rays.slope_x[c] - rays.slope_x[a])
            y = 8 * rays.slope_y[a] + down * (rays.slope_y[c] - rays.slope_y[a])
            right_x = 8 * rays.slope_x[a + 1] + down * (rays.slope_x[c + 1] - rays.slope_x[a + 1])
            right_y = 8 * rays.slope_y[a + 1] + down * (rays.slope_y[c + 1] - rays.slope_y[a + 1])
            for column in range(4):
                self.slope_x[line + column] = (8 * x + (2 * column + 1) * (right_x - x)) >> 6
                self.slope_y[line + column] = (8 * y + (2 * column + 1) * (right_y - y)) >> 6

    def sample(self, sample: int) -> int:
        """The paint that sample 0 to 15 of this pixel hits."""
        paint = self.ball_above(sample, 0) if self.has_ball else -1
        return paint if paint >= 0 else self._paint_of(self.slope_x[sample], self.slope_y[sample])

    def ball_above(self, sample: int, above: int) -> int:
        """The paint of the ball's ring that a sample sees; -1 if it misses the ball or passes it below `above`.

        With e from the centre to the ray in the plane of the centre, and s the slopes: the ray passes the centre at the
        distance d, d^2 (1 + s^2) = e^2 (1 + s^2) - (e s)^2; it is nearest to it e s / (1 + s^2) below that plane.
        """
        rays = self.rays
        slope_x, slope_y = self.slope_x[sample], self.slope_y[sample]
        drop = rays.height_um - _BALL_UM
        x = rays.x_um + (drop * slope_x >> 22) - self.ball_x
        y = rays.y_um + (drop * slope_y >> 22) - self.ball_y
        if max(abs(x), abs(y)) > 2 * _BALL_UM:
            return -1
        slope_x >>= 10  # 12 fraction bits
        slope_y >>= 10
        along = x * slope_x + y * slope_y
        stretch = (1 << 24) + slope_x * slope_x + slope_y * slope_y
        distance = (x * x + y * y) * stretch - along * along
        rim = _BALL_UM * _BALL_UM * stretch
        if distance > rim or _BALL_UM - along * 4096 // stretch < above:
            return -1
        return self.ball_rim + (3 - 4 * (distance - 1) // rim if distance > 0 else 3)

    def _sure(self, pixel: int) -> int:
        """The floor or the outside if all of a pixel is sure to see it, else -1."""
        rays = self.rays
        spread = rays.spread_um + 2  # for what is rounded here
        x = abs(rays.middle_x[pixel] + rays.fall_x[pixel] // 3 - self.middle_x)  # at the height of the walls
        y = abs(rays.middle_y[pixel] + rays.fall_y[pixel] // 3 - self.middle_y)
        if self.has_ball and self._near_ball(pixel):
            return -1
        if not self._inside(x, y, 0 - spread):
            far = self.half_x + _GOAL_DEPTH_UM + _WALL_UM + spread
            return self.outside if x > far or y > self.half_y + _WALL_UM + spread else -1
        x = abs(rays.middle_x[pixel] + rays.fall_x[pixel] - self.middle_x)
        y = abs(rays.middle_y[pixel] + rays.fall_y[pixel] - self.middle_y)
        return self.floor if self._inside(x, y, 0 - spread) and not self._on_line(x, y, spread) else -1

    def _paint_of(self, slope_x: int, slope_y: int) -> int:
        """The paint that a ray of these slopes hits where there is no ball."""
        rays = self.rays
        drop = rays.height_um - _WALL_HEIGHT_UM
        x = abs(rays.x_um + (drop * slope_x >> 22) - self.middle_x)
        y = abs(rays.y_um + (drop * slope_y >> 22) - self.middle_y)
        if not self._inside(x, y, 0):
            on_wall = (x <= self.half_x + _WALL_UM and y <= self.half_y + _WALL_UM) or (
                x <= self.half_x + _GOAL_DEPTH_UM + _WALL_UM and y <= _GOAL_HALF_UM + _WALL_UM
            )
            return self.wall_top if on_wall else self.outside
        drop = rays.height_um
        x = abs(rays.x_um + (drop * slope_x >> 22) - self.middle_x)
        y = abs(rays.y_um + (drop * slope_y >> 22) - self.middle_y)
        if not self._inside(x, y, 0):
            return self.wall_face
        return self.line if self._on_line(x, y, 0) else self.floor

    def _inside(self, x: int, y: int, more: int) -> bool:
        """True if a place (distances from the middle) is between the walls or in a goal, both `more` wide each way."""
        if y <= _GOAL_HALF_UM + more and x <= self.half_x + _GOAL_DEPTH_UM + more:
            return True
        if x > self.half_x + more or y > self.half_y + more:
            return False
        return x + y <= self.half_x + self.half_y - _CORNER_UM + 2 * more

    def _on_line(self, x: int, y: int, more: int) -> bool:
        """Middle line, circle, goal areas and goal lines, `more` wider each way."""
        half = _LINE_HALF_UM + more
        if x <= half:
            return True
        square = x * x + y * y
        inner = _CIRCLE_UM - half
        outer = _CIRCLE_UM + half
        if inner * inner <= square <= outer * outer:
            return True
        depth = self.half_x - x
        if y <= _GOAL_HALF_UM + more and abs(depth) <= half:
            return True
        if abs(depth - _AREA_DEPTH_UM) <= half and y <= _AREA_HALF_UM + half:
            return True
        return abs(y - _AREA_HALF_UM) <= half and 0 - more <= depth <= _AREA_DEPTH_UM + more


def _copy(kept: array[int], pixel: int, line: list[int], column: int, count: int) -> None:
    """Copies `count` values into a line, and a few more."""
    values = [0] * 16
    for at in range(0, count, 16):
        for lane in range(16):
            values[lane] = kept[pixel + at + lane]
        for lane in range(16):
            line[column + at + lane] = values[lane]


@lru_cache(maxsize=3)
def scene_of(lens: CameraParameters, picture: PictureSettings, ball: tuple[int, int] | None) -> Scene:
    """The scene as a camera sees it; worlds with the same one share what was looked at."""
    return Scene(rays_of(lens), picture, ball)
