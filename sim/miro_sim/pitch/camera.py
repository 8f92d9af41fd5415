"""The camera: robots and the scene behind them, sampled into windows of a picture.

A pixel is 4 x 4 samples for each instant of the exposure. A sample's ray falls from the height of the robots' tops to
the floor; in a robot's axes that is a straight line from `top` on by `fall`:

    top of a robot     the line begins inside its square: nothing is higher, so nothing hides it
    side of a robot    the line enters the square on its way down
    else               the scene without robots, unless the ball hides the side

Of several sides the highest is seen; where robots stand in each other, the first one is. All in um and integers.
`fall` is taken at the middle of the pixel.

The samples of a pixel lie between its corners. Where the corners of all instants are on one side of an edge (of the
top, of its patches, of all that is seen of the robot), no sample is compared with it. So any pixel gives the same bits
in any window. Samples are counted for the instants of a field at once, four in a vector.
"""

from __future__ import annotations

import math

from miro_exact.dmath import sincos
from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.patterns import IDENTITIES, PATCH_MM, TEAMS, Pattern
from miro_sim.pitch.paints import NUMBERS
from miro_sim.pitch.picture_settings import PictureSettings, checked
from miro_sim.pitch.rays import Rays, enters, entry, rays_of
from miro_sim.pitch.scene import Scene, scene_of
from miro_sim.pitch.sensor import Sensor

MOST_ROBOTS = 10
FIELD_S = 1001.0 / 60000.0
_SETS = 8  # places for instants: two fields of up to three, each in a vector of four
_HALF_UM = 37_500
_TOP_UM = 75_000
_ROUNDED_UM = 8  # what rounding adds
_TOP, _TEAM, _IDENTITY = 0, 1, 2  # rectangles in the axes of any robot
_REACH, _BASE, _NEAR = 3, 4, 5  # and those of one robot, three for each
_LOW_U, _HIGH_U = 0, 1  # edges: the last u before a rectangle, the last u in it, then v
_LOW_V, _HIGH_V = 2, 3
_OUT = -1
_FAR_UM = 1 << 29
_MIXED = 255
_WIDTH = 320
_HEIGHT = 240
_CORNERS = 321
_LINE = 352  # places of a line of corners or pixels
_FIELD = 704  # two lines: the corners above and below a line of pixels
_LIFT = 1 << 30  # makes lengths positive, so that what is cut off is rounded down
_FAST_UM = 1 << 23  # who drifts further is drawn sample by sample
_BAND = 4096  # pixels that are worked on at once
_PLACES = 4  # bands that are kept: a window of each robot of a team
_SURE, _UNSURE = 1, 2  # whether the samples of a pixel in which robots may be seen are known


class Camera:
    """A camera above the pitch; also the picture that it took last, a window at a time.

    Bodies are put into the scene with `robot` and `ball`, then `begin` takes a frame of them, then any windows of it
    may be read, in any order. Nothing of it is state: a frame is a function of where things stand and its number.
    """

    NOT_STATE = ("*",)

    def __init__(
        self, parameters: CameraParameters, settings: PictureSettings, pattern: Pattern, stream: Stream
    ) -> None:
        self.parameters = parameters
        self.settings = settings = checked(settings)
        self.width, self.height = WIDTH, HEIGHT
        self.rays: Rays = rays_of(parameters)
        self.scene: Scene = scene_of(parameters, settings, None)
        self.sensor = Sensor(settings, stream)
        self.field_sets = settings.sub_exposures
        self.fields = settings.fields
        self.sets = settings.sub_exposures * settings.fields
        self.instants = [0] * 6
        self.after_s = [0.0] * 6  # after the tick of the frame
        for number in range(self.sets):
            field, at = divmod(number, self.field_sets)
            share = (at * 2 + 1) / (2.0 * self.field_sets) - 0.5
            self.instants[number] = 4 * field + at
            self.after_s[number] = (field - 0.5 * (self.fields - 1)) * FIELD_S + share * settings.exposure_s
        self.side = NUMBERS["side"]
        self.black = NUMBERS["top"]
        self.edges = [0] * 132  # of each rectangle
        for box, (u, v, half) in enumerate(
            [(0, 0, _HALF_UM), *((1000 * u, 1000 * v, 500 * PATCH_MM) for u, v in pattern)]
        ):
            self.edges[4 * box + _LOW_U], self.edges[4 * box + _HIGH_U] = u - half - 1, u + half
            self.edges[4 * box + _LOW_V], self.edges[4 * box + _HIGH_V] = v - half - 1, v + half
        self.robots = 0
        self.team_paint, self.identity_paint = [0] * 10, [0] * 10
        self.x, self.y = [0] * 80, [0] * 80
        self.cos, self.sin = [0] * 84, [0] * 84
        self.shift_u, self.shift_v = [0] * 80, [0] * 80
        self.drift_um = [0] * 10
        self.span_first, self.span_end = 0, 0
        self.corner_u, self.corner_v = [0] * 5632, [0] * 5632
        self.line_least_u = [0] * 704  # of corners above and below a line of pixels, over all instants
        self.line_most_u = [0] * 704
        self.line_least_v, self.line_most_v = [0] * 704, [0] * 704
        self.least_u, self.most_u = [0] * 352, [0] * 352  # of pixels: between their corners
        self.least_v, self.most_v = [0] * 352, [0] * 352
        self.stood: list[object] = [()] * 10  # how each robot was put on the pitch
        self.changes = 0  # of robots and of the scene, so far
        self.changed = [0] * 10  # the last one of each robot
        self.scene_changed = 0
        self.place = 0  # of the band that is worked on
        self.covers: list[object] = [()] * 4  # of what `covered` and `total` tell in each place
        self.covered = [0] * 16384
        self.covered_first, self.covered_end = [0] * 4, [0] * 4
        self.total = [0] * 16384
        self.first, self.samples = 0, 16
        self.lanes = self.times = 1  # instants of a field that are worked out, and how often each one counts
        self.upper, self.lower = -1, -1
        self.above, self.below = 0, 0
        self.fall_u, self.fall_v = [0] * 4, [0] * 4
        self.low_u, self.high_u = [0] * 4, [0] * 4
        self.low_v, self.high_v = [0] * 4, [0] * 4
        self.u, self.v = [0] * 16, [0] * 16
        self.seen, self.height_um = [0] * 128, [0] * 128

    def __repr__(self) -> str:
        return f"Camera({self.rays!r}, {self.robots} robots, {self.sensor!r})"

    def clear(self) -> None:
        """Takes all robots and the ball off the pitch."""
        self.clear_robots()
        self._look_at(None)

    def clear_robots(self) -> None:
        """Takes all robots off the pitch; the ball stays."""
        self.robots = 0

    def ball(self, x_m: float, y_m: float) -> None:
        """Puts the ball on the floor, its centre above this place."""
        self._look_at((_um(x_m), _um(y_m)))

    def _look_at(self, ball: tuple[int, int] | None) -> None:
        self.scene = scene_of(self.parameters, self.settings, ball)
        self.changes += 1
        self.scene_changed = self.changes

    def robot(
        self,
        team: int,
        identity: int,
        x_m: float,
        y_m: float,
        theta_rad: float,
        v_m_s: float = 0.0,
        w_rad_s: float = 0.0,
    ) -> None:
        """Puts a robot on the pitch, as it stands at the frame's tick; before and after it moves on as it does there.

        Raises ValueError for the eleventh, and for a team or an identity that has no colour.
        """
        body = self.robots
        if body >= MOST_ROBOTS:
            raise ValueError(f"there is room for {MOST_ROBOTS} robots on the pitch")
        if not (0 <= team < len(TEAMS) and 0 <= identity < len(IDENTITIES)):
            raise ValueError(f"no robot {identity} of team {team} has colours")
        stood = (team, identity, x_m, y_m, theta_rad, v_m_s, w_rad_s)
        if stood == self.stood[body]:
            self.robots = body + 1
            return
        self.stood[body] = ()
        self.team_paint[body] = NUMBERS[TEAMS[team]]
        self.identity_paint[body] = NUMBERS[IDENTITIES[identity]]
        least_u, most_u, least_v, most_v = _FAR_UM, -_FAR_UM, _FAR_UM, -_FAR_UM
        for number in range(self.sets):
            after_s = self.after_s[number]
            way_m = v_m_s * after_s
            sine, cosine = sincos(theta_rad + 0.5 * w_rad_s * after_s)
            place = body * _SETS + self.instants[number]
            self.x[place] = _um(x_m + way_m * cosine)
            self.y[place] = _um(y_m + way_m * sine)
            sine, cosine = sincos(theta_rad + w_rad_s * after_s)
            self.cos[place] = _rounded(cosine * 32768.0)
            self.sin[place] = _rounded(sine * 32768.0)
            self._stand(place)
            least_u, most_u = min(least_u, self.fall_u[0]), max(most_u, self.fall_u[0])
            least_v, most_v = min(least_v, self.fall_v[0]), max(most_v, self.fall_v[0])
        self._surround(12 * body + _LOW_U, least_u, most_u)
        self._surround(12 * body + _LOW_V, least_v, most_v)
        self._bound(body)
        self.changes += 1
        self.changed[body] = self.changes
        self.stood[body] = stood
        self.robots = body + 1

    def _stand(self, place: int) -> None:
        """What moves places into the axes of a robot, and how the ray through the middle of its top falls there."""
        cosine, sine = self.cos[place], self.sin[place]
        self.shift_u[place] = self.x[place] * cosine + self.y[place] * sine
        self.shift_v[place] = self.y[place] * cosine - self.x[place] * sine
        drop = self.rays.height_um - _TOP_UM
        x = _TOP_UM * (self.x[place] - self.rays.x_um) // drop
        y = _TOP_UM * (self.y[place] - self.rays.y_um) // drop
        self.fall_u[0] = (x * cosine + y * sine) >> 15
        self.fall_v[0] = (y * cosine - x * sine) >> 15

    def _surround(self, at: int, least: int, most: int) -> None:
        """Edges along u or v of a robot's rectangles, at all instants; rays through its middle fall `least` to `most`.

        The ray from a place u beside the middle falls by u top / drop more: it ends at `fall` + u camera / drop. What
        may be seen of the robot begins in `_REACH`; what begins in `_BASE` ends under the robot. `_NEAR` is the top,
        without an end where no ray from beyond it falls towards the robot.
        """
        camera = self.rays.height_um
        drop = camera - _TOP_UM
        margin = self.rays.spread_um // 4 + 2 * _ROUNDED_UM  # all rays of a pixel are taken to fall alike
        self.edges[at + 4 * _REACH] = min(-_HALF_UM, (-_HALF_UM - most - margin) * drop // camera) - 1
        self.edges[at + 4 * _REACH + 1] = max(_HALF_UM, (_HALF_UM - least + margin) * drop // camera + 1)
        self.edges[at + 4 * _BASE] = (-_HALF_UM - least + margin) * drop // camera + 1
        self.edges[at + 4 * _BASE + 1] = (_HALF_UM - most - margin) * drop // camera
        self.edges[at + 4 * _NEAR] = -_HALF_UM - 1 if most > -margin else -_FAR_UM
        self.edges[at + 4 * _NEAR + 1] = _HALF_UM if least < margin else _FAR_UM

    def _bound(self, body: int) -> None:
        """How far, at most, a place of the robot is at any instant from where it is at the middle one."""
        middle = body * _SETS + self.instants[self.sets // 2]
        reach = 12 * body + 4 * _REACH
        length = self.edges[reach + _HIGH_U] - self.edges[reach + _LOW_U]
        length += self.edges[reach + _HIGH_V] - self.edges[reach + _LOW_V]
        drift = 0
        for number in range(self.sets):
            place = body * _SETS + self.instants[number]
            way = abs(self.x[place] - self.x[middle])
            way += abs(self.y[place] - self.y[middle])  # in two steps: 32 bits may not hold the sum
            turn = abs(self.cos[place] - self.cos[middle]) + abs(self.sin[place] - self.sin[middle])
            drift = max(drift, way + way // 4 + (length * turn >> 15))
        self.drift_um[body] = drift + _ROUNDED_UM

    def begin(self, frame: int, tick: int) -> None:
        """Takes frame number `frame` (below 2^24) of what stands there now; `tick`: the middle of the exposure."""
        self.sensor.begin(frame, tick, 16 * self.field_sets)
        self.place = -1

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """A window's pixels: see `miro_host.eye.grabber`. Raises ValueError for one that is not inside the picture."""
        # no sum, which may overflow
        if not (width > 0 and height > 0 and 0 <= left <= _WIDTH - width and 0 <= top <= _HEIGHT - height):
            raise ValueError(
                f"window {width} x {height} at ({left}, {top}) is not inside {_WIDTH} x {_HEIGHT}"
            )
        out = bytearray(3 * width * height)
        first = max(0, left - self.sensor.side)
        end = min(_WIDTH, left + width + self.sensor.side)
        band = _BAND // (end - first)
        for above in range(top, top + height, band):
            below = min(top + height, above + band)
            self._cover(above, below, first, end)
            for row in range(above, below):
                self.scene.show(self.sensor, row, first, end, self.field_sets)
                self._put_robots(row, self.place * _BAND + (row - above) * (end - first) - first)
                self.sensor.write(row, left, width, out, 3 * width * (row - top))
        return out

    def _put_robots(self, row: int, at: int) -> None:
        """Those pixels of a line in which a robot may be seen; `at`: where column 0 would be in the bands."""
        for column in range(self.covered_first[self.place], self.covered_end[self.place]):
            if self.covered[at + column]:
                if self.covered[at + column] == _UNSURE:
                    self.total[at + column] = self._samples(row, column)
                    self.covered[at + column] = _SURE
                self.sensor.put(column, self.total[at + column], self.scene.light[row * _WIDTH + column])

    # ---- one robot

    def _cover(self, top: int, bottom: int, first: int, end: int) -> None:
        """Finds the pixels of a band in which robots may be seen, and their paints where it is one robot.

        They are kept where all robots nearby stand as in the band that was in its place before.
        """
        width, height = end - first, bottom - top
        pixel = (top + height // 2) * _WIDTH + first + width // 2
        most = (width // 2 + height // 2 + 3) * self.rays.stride_um
        near, newest = 0, self.scene_changed
        for body in range(self.robots):
            if self._beside(body, pixel) <= most:
                near |= 1 << body
                newest = max(newest, self.changed[body])
        place = self.place = (self.place + 1) % _PLACES
        cover = (top, bottom, first, end, near, newest)
        if cover == self.covers[place]:
            return
        self.covers[place] = cover
        for at in range(place * _BAND, place * _BAND + width * height):
            self.covered[at] = 0
        self.covered_first[place], self.covered_end[place] = _WIDTH, 0
        for body in range(self.robots):
            if near >> body & 1:
                self._cover_with(body, top, bottom, first, end)

    def _cover_with(self, body: int, top: int, bottom: int, first: int, end: int) -> None:
        """The same for one robot: line by line, between the corners above and below."""
        self._find_span(body, top, first, end)
        self._find_corners(body, top, self.span_first, self.span_end)
        place = self.place
        at = place * _BAND - first
        for row in range(top, bottom):
            left, right = self.span_first, self.span_end
            self.covered_first[place] = min(self.covered_first[place], left)
            self.covered_end[place] = max(self.covered_end[place], right)
            self._find_span(body, row + 1, first, end if row + 1 < bottom else first)
            self._find_corners(body, row + 1, min(left, self.span_first), max(right, self.span_end))
            self._bound_pixels(left, right)
            for column in range(left, right):
                self._cover_pixel(body, row, column, at + column)
            at += end - first

    def _find_span(self, body: int, row: int, first: int, end: int) -> None:
        """Between which columns of a line a robot may be seen: where it is far, as many pixels are left out.

        Where it is not seen at all, the span begins after its end.
        """
        step = self.rays.stride_um + _ROUNDED_UM
        left, right = first, end
        while left < right:
            beside = self._beside(body, row * _WIDTH + left)
            if beside <= 0:
                break
            left += 1 + (beside - 1) // step
        while left < right:
            beside = self._beside(body, row * _WIDTH + right - 1)
            if beside <= 0:
                break
            right -= 1 + (beside - 1) // step
        self.span_first = left if left < right else _WIDTH
        self.span_end = right if left < right else 0

    def _beside(self, body: int, pixel: int) -> int:
        """How far the samples of a pixel stay beside all that is seen of a robot; 0 or less where they may meet it."""
        place = body * _SETS + self.instants[self.sets // 2]
        reach = 12 * body + 4 * _REACH
        x, y = self.rays.middle_x[pixel], self.rays.middle_y[pixel]
        u = (x * self.cos[place] + y * self.sin[place] - self.shift_u[place]) >> 15
        v = (y * self.cos[place] - x * self.sin[place] - self.shift_v[place]) >> 15
        beside_u = max(self.edges[reach + _LOW_U] - u, u - self.edges[reach + _HIGH_U])
        beside_v = max(self.edges[reach + _LOW_V] - v, v - self.edges[reach + _HIGH_V])
        return max(beside_u, beside_v) - self.drift_um[body] - self.rays.spread_um - _ROUNDED_UM

    def _find_corners(self, body: int, row: int, left: int, right: int) -> None:
        """The corners above a line, from `left` to `right`, in the axes of a robot; their bounds over all instants.

        Where a robot stands still, all instants of a field are like its first one.
        """
        bounds = (row & 1) * _LINE
        for column in range(bounds + left, bounds + right + 1, 4):  # as many together
            for lane in range(4):
                self.line_least_u[column + lane] = self.line_least_v[column + lane] = _LIFT
                self.line_most_u[column + lane] = self.line_most_v[column + lane] = -_LIFT
        still = self.drift_um[body] == _ROUNDED_UM
        self.lanes = 1 if still else self.field_sets
        self.times = self.field_sets if still else 1
        for number in range(self.sets):
            if number % self.times == 0:
                at = self.instants[number]
                line = 4 * ((at >> 2) * _FIELD + bounds) + (at & 3)
                self._turn_corners(body * _SETS + at, row * _CORNERS, line, bounds, left, right)

    def _turn_corners(self, place: int, corner: int, line: int, bounds: int, left: int, right: int) -> None:
        """The same at one instant. In doubles, which hold these products exactly."""
        rays = self.rays
        x, y, u, v = [0.0] * 4, [0.0] * 4, [0] * 4, [0] * 4
        cosine, sine = self.cos[place] / 32768.0, self.sin[place] / 32768.0
        shift_u, shift_v = self.shift_u[place] / 32768.0 - _LIFT, self.shift_v[place] / 32768.0 - _LIFT
        for column in range(left, right + 1, 4):  # as many together
            for lane in range(4):
                x[lane] = rays.top_x[corner + column + lane]
            for lane in range(4):
                y[lane] = rays.top_y[corner + column + lane]
            for lane in range(4):
                u[lane] = int(x[lane] * cosine + y[lane] * sine - shift_u)
            for lane in range(4):
                v[lane] = int(y[lane] * cosine - x[lane] * sine - shift_v)
            for lane in range(4):
                u[lane] -= _LIFT
                self.corner_u[line + 4 * (column + lane)] = u[lane]
            for lane in range(4):
                at = bounds + column + lane
                self.line_least_u[at] = min(self.line_least_u[at], u[lane])
                self.line_most_u[at] = max(self.line_most_u[at], u[lane])
            for lane in range(4):
                v[lane] -= _LIFT
                self.corner_v[line + 4 * (column + lane)] = v[lane]
            for lane in range(4):
                at = bounds + column + lane
                self.line_least_v[at] = min(self.line_least_v[at], v[lane])
                self.line_most_v[at] = max(self.line_most_v[at], v[lane])

    def _bound_pixels(self, left: int, right: int) -> None:
        """Between which bounds the corners of pixels lie at all instants; as many are bounded together."""
        for column in range(left, right, 4):
            for lane in range(4):
                at = column + lane
                one = min(self.line_least_u[at], self.line_least_u[at + 1])
                other = min(self.line_least_u[at + _LINE], self.line_least_u[at + _LINE + 1])
                self.least_u[at] = min(one, other)
            for lane in range(4):
                at = column + lane
                one = max(self.line_most_u[at], self.line_most_u[at + 1])
                other = max(self.line_most_u[at + _LINE], self.line_most_u[at + _LINE + 1])
                self.most_u[at] = max(one, other)
            for lane in range(4):
                at = column + lane
                one = min(self.line_least_v[at], self.line_least_v[at + 1])
                other = min(self.line_least_v[at + _LINE], self.line_least_v[at + _LINE + 1])
                self.least_v[at] = min(one, other)
            for lane in range(4):
                at = column + lane
                one = max(self.line_most_v[at], self.line_most_v[at + 1])
                other = max(self.line_most_v[at + _LINE], self.line_most_v[at + _LINE + 1])
                self.most_v[at] = max(one, other)

    def _inside(self, column: int, at: int) -> bool:
        """Whether all samples of a pixel lie in a rectangle at all instants; `at`: where its edges are."""
        return (
            self.least_u[column] > self.edges[at]
            and self.most_u[column] <= self.edges[at + 1]
            and self.least_v[column] > self.edges[at + 2]
            and self.most_v[column] <= self.edges[at + 3]
        )

    def _outside(self, column: int, at: int) -> bool:
        """Whether all lie beyond the same side of it."""
        return (
            self.most_u[column] <= self.edges[at]
            or self.least_u[column] > self.edges[at + 1]
            or self.most_v[column] <= self.edges[at + 2]
            or self.least_v[column] > self.edges[at + 3]
        )

    def _cover_pixel(self, body: int, row: int, column: int, index: int) -> None:
        """A pixel in which a robot may be seen: its paints, added over all samples and instants."""
        whole = self._inside(column, 4 * _TOP)
        if not whole and self._outside(column, 12 * body + 4 * _REACH):
            return
        if self.covered[index] or self.drift_um[body] > _FAST_UM:
            self.covered[index] = _UNSURE
            return
        if whole:
            total = self._paint_top(body, row, column, 16 * self.field_sets)
        else:
            total = self._alone(body, row, column)
        if total != 0:
            self.covered[index] = _SURE if total > 0 else _UNSURE
            self.total[index] = total

    def _alone(self, body: int, row: int, column: int) -> int:
        """The samples of a pixel where one robot may be seen, by how many see what.

        0 if none sees the robot: no paint is. -1 if what they see is not told by how many there are.
        """
        scene = self.scene
        whole = 16 * self.field_sets
        total = 0
        on_top = self._within(row, column, _TOP)
        if on_top < whole:
            pixel = row * _WIDTH + column
            behind = scene.behind(pixel)
            entered = self._entered(body, row, column, on_top)
            if entered == 0:
                return 0
            if (entered < whole and behind == _MIXED) or scene.shows_ball(pixel):
                return -1
            if entered < whole:
                total = (whole - entered) * scene.packed[behind]
            total += (entered - on_top) * scene.packed[self.side]
        return total + self._paint_top(body, row, column, on_top) if on_top else total

    def _paint_top(self, body: int, row: int, column: int, on_top: int) -> int:
        """The paints of those samples of a pixel that see the top."""
        packed = self.scene.packed
        team = self._within(row, column, _TEAM)
        identity = self._within(row, column, _IDENTITY) if team < on_top else 0
        total = (on_top - team - identity) * packed[self.black]
        if team:
            total += team * packed[self.team_paint[body]]
        if identity:
            total += identity * packed[self.identity_paint[body]]
        return total

    def _within(self, row: int, column: int, box: int) -> int:
        """How many samples of all instants lie in a rectangle."""
        at = 4 * box
        if self._outside(column, at):
            return 0
        if self._inside(column, at):
            return 16 * self.field_sets
        return self._count_within(row, column, at)

    def _count_within(self, row: int, column: int, at: int) -> int:
        """The same, sample by sample, along the axes where edges are crossed."""
        across_u = self.least_u[column] <= self.edges[at] or self.most_u[column] > self.edges[at + 1]
        across_v = self.least_v[column] <= self.edges[at + 2] or self.most_v[column] > self.edges[at + 3]
        for lane in range(4):
            self.low_u[lane], self.high_u[lane] = self.edges[at], self.edges[at + 1]
            self.low_v[lane], self.high_v[lane] = self.edges[at + 2], self.edges[at + 3]
        within = 0
        for first in range(0, 4 * self.fields, 4):
            self._turn(row, column, first)
            within += self._count(across_u, across_v)
        return within

    def _turn(self, row: int, column: int, at: int) -> None:
        """Turns to a pixel at an instant: where its corners are, and its samples: 16, or the 8 of its field."""
        self.above = 4 * ((at >> 2) * _FIELD + (row & 1) * _LINE + column) + (at & 3)
        self.below = 4 * ((at >> 2) * _FIELD + (~row & 1) * _LINE + column) + (at & 3)
        if self.fields == 2:
            self.first, self.samples = 8 * (at >> 2), 8
            self.upper, self.lower = (at >> 2) - 1, 0 - (at >> 2)

    def _lay(
        self, corners: list[int], at: list[int], by: list[int], right: list[int], bend: list[int]
    ) -> None:
        """How the samples of a pixel lie along one axis at each instant of a field, times 64.

        The one of the first row and column lies at `at` + `by`, each further row 2 `by` on. In the next column `at` is
        `right` more, `by` is `bend` more.
        """
        above, below = self.above, self.below
        for lane in range(4):
            a, b = corners[above + lane], corners[above + lane + 4] - corners[above + lane]
            c, d = corners[below + lane] - a, corners[below + lane + 4] - corners[below + lane] - b
            at[lane] = 64 * a + 8 * b
            by[lane] = 8 * c + d
            right[lane] = 16 * b
            bend[lane] = 2 * d

    def _count(self, across_u: int, across_v: int) -> int:
        """How many samples at the instants of a field lie in its rectangles; along which axes edges are crossed."""
        if not across_v:
            return self._count_along(self.corner_u, self.low_u, self.high_u)
        if not across_u:
            return self._count_along(self.corner_v, self.low_v, self.high_v)
        return self._count_both()

    def _count_along(self, corners: list[int], low: list[int], high: list[int]) -> int:
        """The same along one axis."""
        at, by, right, bend, within = [0] * 4, [0] * 4, [0] * 4, [0] * 4, [0] * 4
        self._lay(corners, at, by, right, bend)
        upper, lower = self.upper, self.lower
        for _ in range(4):
            for lane in range(4):
                least, most = 64 * low[lane] + 63, 64 * high[lane] + 63
                down = by[lane] + by[lane]
                a = at[lane] + by[lane]
                b = a + down
                c = b + down
                d = c + down
                above = (a > least) - (a > most) + (b > least) - (b > most)
                below = (c > least) - (c > most) + (d > least) - (d > most)
                within[lane] += (above & upper) + (below & lower)
                at[lane] += right[lane]
                by[lane] += bend[lane]
        return self._add(within)

    def _add(self, within: list[int]) -> int:
        """What is counted at the instants of a field."""
        return within[0] + within[1] + within[2] if self.lanes == 3 else within[0] * self.times

    def _count_both(self) -> int:
        """The same along both axes."""
        at_u, by_u, right_u, bend_u = [0] * 4, [0] * 4, [0] * 4, [0] * 4
        at_v, by_v, right_v, bend_v, within = [0] * 4, [0] * 4, [0] * 4, [0] * 4, [0] * 4
        self._lay(self.corner_u, at_u, by_u, right_u, bend_u)
        self._lay(self.corner_v, at_v, by_v, right_v, bend_v)
        upper, lower = self.upper, self.lower
        for _ in range(4):
            for lane in range(4):
                low_u, high_u = 64 * self.low_u[lane] + 63, 64 * self.high_u[lane] + 63
                low_v, high_v = 64 * self.low_v[lane] + 63, 64 * self.high_v[lane] + 63
                u, v = at_u[lane] + by_u[lane], at_v[lane] + by_v[lane]
                down_u, down_v = by_u[lane] + by_u[lane], by_v[lane] + by_v[lane]
                above = ((u > low_u) - (u > high_u)) & ((v > low_v) - (v > high_v))
                u += down_u
                v += down_v
                above += ((u > low_u) - (u > high_u)) & ((v > low_v) - (v > high_v))
                u += down_u
                v += down_v
                below = ((u > low_u) - (u > high_u)) & ((v > low_v) - (v > high_v))
                u += down_u
                v += down_v
                below += ((u > low_u) - (u > high_u)) & ((v > low_v) - (v > high_v))
                within[lane] += (above & upper) + (below & lower)
            for lane in range(4):
                at_u[lane] += right_u[lane]
                by_u[lane] += bend_u[lane]
                at_v[lane] += right_v[lane]
                by_v[lane] += bend_v[lane]
        return self._add(within)

    def _entered(self, body: int, row: int, column: int, on_top: int) -> int:
        """How many samples of all instants see any of a robot, `on_top` of them its top."""
        if self._inside(column, 12 * body + 4 * _NEAR):
            return on_top
        if self._inside(column, 12 * body + 4 * _BASE):
            return 16 * self.field_sets
        entered = 0
        for first in range(0, 4 * self.fields, 4):
            self._turn(row, column, first)
            entered += self._enter(body * _SETS + first, row * _WIDTH + column)
        return entered

    def _enter(self, place: int, pixel: int) -> int:
        """How many samples at the instants of a field see any of a robot: as `rays.enters`."""
        least_u, most_u, least_v, most_v = [0] * 4, [0] * 4, [0] * 4, [0] * 4
        self._bound_corners(self.corner_u, least_u, most_u)
        self._bound_corners(self.corner_v, least_v, most_v)
        self._fall(place, pixel)
        outside, across_u, across_v, off, over = [0] * 4, [0] * 4, [0] * 4, [0.0] * 4, [0.0] * 4
        for lane in range(4):
            fall_u, fall_v = self.fall_u[lane], self.fall_v[lane]
            low_u, high_u = -_HALF_UM - 1 - max(fall_u, 0), _HALF_UM - min(fall_u, 0)
            low_v, high_v = -_HALF_UM - 1 - max(fall_v, 0), _HALF_UM - min(fall_v, 0)
            self.low_u[lane], self.high_u[lane] = low_u, high_u
            self.low_v[lane], self.high_v[lane] = low_v, high_v
            outside[lane] = (most_u[lane] <= low_u) | (least_u[lane] > high_u)
            outside[lane] |= (most_v[lane] <= low_v) | (least_v[lane] > high_v)
            across_u[lane] = (least_u[lane] <= low_u) | (most_u[lane] > high_u)
            across_v[lane] = (least_v[lane] <= low_v) | (most_v[lane] > high_v)
        for lane in range(4):
            u, v = (least_u[lane] + most_u[lane]) >> 1, (least_v[lane] + most_v[lane]) >> 1
            along_u, along_v = self.fall_u[lane], self.fall_v[lane]
            middle = abs(u * along_v - v * along_u) - _HALF_UM * (abs(along_u) + abs(along_v))
            around = (most_u[lane] - u) * abs(along_v) + (most_v[lane] - v) * abs(along_u)
            off[lane], over[lane] = middle - around, middle + around
        gone = crossed_u = crossed_v = crossed = 0
        for lane in range(self.lanes):
            gone += outside[lane] | (off[lane] > 0.0)
            crossed |= over[lane] > 0.0
            crossed_u |= across_u[lane]
            crossed_v |= across_v[lane]
        if gone == self.lanes:
            return 0
        if crossed:
            return self._count_entering()
        return self._count(crossed_u, crossed_v) if crossed_u | crossed_v else self.samples * self.field_sets

    def _bound_corners(self, corners: list[int], least: list[int], most: list[int]) -> None:
        """Between which bounds a pixel's corners lie along one axis, at each instant of a field."""
        above, below = self.above, self.below
        for lane in range(4):
            a, b = corners[above + lane], corners[above + lane + 4]
            c, d = corners[below + lane], corners[below + lane + 4]
            least[lane] = min(min(a, b), min(c, d))
            most[lane] = max(max(a, b), max(c, d))

    def _fall(self, place: int, pixel: int) -> None:
        """How far rays fall in a robot's axes, at an instant and the next ones of its field."""
        x, y = self.rays.fall_x[pixel] / 32768.0, self.rays.fall_y[pixel] / 32768.0
        for lane in range(4):
            self.fall_u[lane] = int(x * self.cos[place + lane] + y * self.sin[place + lane] + _LIFT)
            self.fall_v[lane] = int(y * self.cos[place + lane] - x * self.sin[place + lane] + _LIFT)
        for lane in range(4):
            self.fall_u[lane] -= _LIFT
            self.fall_v[lane] -= _LIFT

    def _count_entering(self) -> int:
        """How many samples see any of a robot, one by one."""
        at_u, by_u, right_u, bend_u = [0] * 4, [0] * 4, [0] * 4, [0] * 4
        at_v, by_v, right_v, bend_v, within = [0] * 4, [0] * 4, [0] * 4, [0] * 4, [0] * 4
        self._lay(self.corner_u, at_u, by_u, right_u, bend_u)
        self._lay(self.corner_v, at_v, by_v, right_v, bend_v)
        fall_u, fall_v, most = [0.0] * 4, [0.0] * 4, [0.0] * 4
        for lane in range(4):
            fall_u[lane], fall_v[lane] = self.fall_u[lane], self.fall_v[lane]
            most[lane] = _HALF_UM * (abs(fall_u[lane]) + abs(fall_v[lane]))
        u, v = [0] * 4, [0] * 4
        for _ in range(4):
            for lane in range(4):
                u[lane], v[lane] = at_u[lane] + by_u[lane], at_v[lane] + by_v[lane]
            for row in range(4):
                shown = self.upper if row < 2 else self.lower
                for lane in range(4):
                    one, other = u[lane] >> 6, v[lane] >> 6
                    inside = (one > self.low_u[lane]) & (one <= self.high_u[lane])
                    inside &= (other > self.low_v[lane]) & (other <= self.high_v[lane])
                    across = one * fall_v[lane] - other * fall_u[lane]
                    within[lane] += inside & (-most[lane] <= across) & (across <= most[lane]) & shown
                for lane in range(4):
                    u[lane] += 2 * by_u[lane]
                    v[lane] += 2 * by_v[lane]
            for lane in range(4):
                at_u[lane] += right_u[lane]
                by_u[lane] += bend_u[lane]
                at_v[lane] += right_v[lane]
                by_v[lane] += bend_v[lane]
        return self._add(within)

    def _spread(self, samples: list[int], corners: list[int]) -> None:
        """How far samples lie from a pixel's first corner: as in the scene; those of the other field lie far away."""
        a = corners[self.above]
        b, c, d = corners[self.above + 4] - a, corners[self.below] - a, corners[self.below + 4] - a
        for column in range(4):
            p = 2 * column + 1
            at = 8 * p * b
            by = 8 * c + p * (d - b - c)
            samples[column] = (at + by) >> 6
            samples[4 + column] = (at + 3 * by) >> 6
            samples[8 + column] = (at + 5 * by) >> 6
            samples[12 + column] = (at + 7 * by) >> 6

    # ---- several robots, or much in the background

    def _samples(self, row: int, column: int) -> int:
        """The samples of a pixel at all instants, one by one."""
        pixel = row * _WIDTH + column
        scene = self.scene
        behind = scene.behind(pixel)
        ball_seen = scene.shows_ball(pixel)
        for at in range(128):
            self.seen[at] = _OUT
            self.height_um[at] = -1
        for body in range(self.robots):
            if self._beside(body, pixel) <= 0:
                self._find_corners(body, row, column, column + 1)
                self._find_corners(body, row + 1, column, column + 1)
                for number in range(self.sets):
                    at = self.instants[number]
                    self._turn(row, column, at if self.times == 1 else at & 4)
                    self._see(body, at, pixel)
        total = 0
        for sample in range(16):
            first = (sample >> 3) * 4 if self.fields == 2 else 0
            open_paint = -1
            for at in range(first, first + self.field_sets):
                paint, height = self.seen[16 * at + sample], self.height_um[16 * at + sample]
                if paint == _OUT:
                    if open_paint < 0:
                        open_paint = behind if behind != _MIXED else scene.sample(pixel, sample)
                    paint = open_paint
                elif ball_seen and height < _TOP_UM:
                    ball = scene.ball_above(pixel, sample, height)
                    paint = ball if ball >= 0 else paint
                total += scene.packed[paint]
        return total

    def _see(self, body: int, at: int, pixel: int) -> None:
        """What the samples of an instant see of one robot, where it is higher than what they have seen."""
        self._fall(body * _SETS + at, pixel)
        fall_u, fall_v = self.fall_u[0], self.fall_v[0]
        self._spread(self.u, self.corner_u)
        self._spread(self.v, self.corner_v)
        for sample in range(self.first, self.first + self.samples):
            u, v = self.corner_u[self.above] + self.u[sample], self.corner_v[self.above] + self.v[sample]
            index = 16 * at + sample
            if self.height_um[index] == _TOP_UM:
                continue
            if self._lies_in(_TOP, u, v):
                self.seen[index] = self._top(body, u, v)
                self.height_um[index] = _TOP_UM
            elif enters(u, v, fall_u, fall_v):
                height = entry(u, v, fall_u, fall_v)
                if height > self.height_um[index]:
                    self.seen[index] = self.side
                    self.height_um[index] = height

    def _top(self, body: int, u: int, v: int) -> int:
        """The paint of a place on the top."""
        if self._lies_in(_TEAM, u, v):
            return self.team_paint[body]
        return self.identity_paint[body] if self._lies_in(_IDENTITY, u, v) else self.black

    def _lies_in(self, box: int, u: int, v: int) -> bool:
        """Whether a place lies in a rectangle."""
        at = 4 * box
        return self.edges[at] < u <= self.edges[at + 1] and self.edges[at + 2] < v <= self.edges[at + 3]


def _um(metres: float) -> int:
    """A place in um, no further away than what is further than anything that may be seen."""
    return _rounded(max(-_FAR_UM, min(_FAR_UM, metres * 1e6)))


def _rounded(x: float) -> int:
    """The nearest whole number, the greater one of two."""
    below = math.floor(x + 0.5)
    return int(below)
