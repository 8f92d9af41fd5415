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
in any window. Corners and samples are worked out four in a vector.
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
_SETS = 6  # places for instants: two fields of up to three
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
_LINES = 704  # the corners above and below a line of pixels
_AXIS = 4224  # those at all instants: along u, then along v
_SAMPLES = 96  # of a pixel at all instants: along u, then along v
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
        self.after_s = [0.0] * 6  # after the tick of the frame
        self.samples = 16 // self.fields  # of a pixel at an instant
        for number in range(self.sets):
            at, field = divmod(number, self.fields)
            share = (at * 2 + 1) / (2.0 * self.field_sets) - 0.5
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
        self.x, self.y = [0] * 60, [0] * 60
        self.cos, self.sin = [0] * 60, [0] * 60
        self.fall_u, self.fall_v = 0, 0
        self.drift_um = [0] * 10
        self.span_first, self.span_end = 0, 0
        self.worked = self.times = 1  # instants that are worked out, and how often each of them counts
        self.corner = [0] * 8448
        self.line_least, self.line_most = [0] * 1408, [0] * 1408  # of corners side by side, at all instants
        self.least_u, self.most_u, self.least_v, self.most_v = 0, 0, 0, 0  # of all corners of a pixel
        self.place_of = [0] * 192  # of each sample
        self.spread = [-1] * 2  # of which pixel, along u and along v
        self.stood: list[object] = [()] * 10  # how each robot was put on the pitch
        self.changes = 0  # of robots and of the scene, so far
        self.changed = [0] * 10  # the last one of each robot
        self.scene_changed = 0
        self.place = 0  # of the band that is worked on
        self.covers: list[object] = [()] * 4  # of what `covered` and `total` tell in each place
        self.covered = [0] * 16384
        self.covered_first, self.covered_end = [0] * 4, [0] * 4
        self.total = [0] * 16384
        self.seen, self.height_um = [0] * 96, [0] * 96

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
            place = body * _SETS + number
            self.x[place] = _um(x_m + way_m * cosine)
            self.y[place] = _um(y_m + way_m * sine)
            sine, cosine = sincos(theta_rad + w_rad_s * after_s)
            self.cos[place] = _rounded(cosine * 32768.0)
            self.sin[place] = _rounded(sine * 32768.0)
            # How the ray through the middle of the top falls.
            drop = self.rays.height_um - _TOP_UM
            x = _TOP_UM * (self.x[place] - self.rays.x_um) // drop
            self._turn(place, x, _TOP_UM * (self.y[place] - self.rays.y_um) // drop)
            least_u, most_u = min(least_u, self.fall_u), max(most_u, self.fall_u)
            least_v, most_v = min(least_v, self.fall_v), max(most_v, self.fall_v)
        self._surround(12 * body + _LOW_U, least_u, most_u)
        self._surround(12 * body + _LOW_V, least_v, most_v)
        self._bound(body)
        self.changes += 1
        self.changed[body] = self.changes
        self.stood[body] = stood
        self.robots = body + 1

    def _turn(self, place: int, x: int, y: int) -> None:
        """Transforms a way into the axes of a robot at an instant."""
        self.fall_u = (x * self.cos[place] + y * self.sin[place]) >> 15
        self.fall_v = (y * self.cos[place] - x * self.sin[place]) >> 15

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
        """Largest distance of any place of the robot, at any instant, from its position at the middle instant."""
        middle = body * _SETS + self.sets // 2
        reach = 12 * body + 4 * _REACH
        length = self.edges[reach + _HIGH_U] - self.edges[reach + _LOW_U]
        length += self.edges[reach + _HIGH_V] - self.edges[reach + _LOW_V]
        drift = 0
        for number in range(self.sets):
            place = body * _SETS + number
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
        """Draws the pixels of a line in which a robot may be seen; `at`: index of column 0 in the bands."""
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
        """Marks the pixels that one robot covers: line by line, between the corners above and below.

        Where it stands still, all instants of a field are like its first one.
        """
        still = self.drift_um[body] == _ROUNDED_UM
        self.worked = self.fields if still else self.sets
        self.times = self.field_sets if still else 1
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
        """Distance of a pixel's samples from everything seen of a robot; 0 or less if they may meet it."""
        place = body * _SETS + self.sets // 2
        reach = 12 * body + 4 * _REACH
        self._turn(
            place, self.rays.middle_x[pixel] - self.x[place], self.rays.middle_y[pixel] - self.y[place]
        )
        u, v = self.fall_u, self.fall_v
        beside_u = max(self.edges[reach + _LOW_U] - u, u - self.edges[reach + _HIGH_U])
        beside_v = max(self.edges[reach + _LOW_V] - v, v - self.edges[reach + _HIGH_V])
        return max(beside_u, beside_v) - self.drift_um[body] - self.rays.spread_um - _ROUNDED_UM

    def _find_corners(self, body: int, row: int, left: int, right: int) -> None:
        """The corners above a line, from `left` to `right`, in a robot's axes: in doubles, which hold them exactly."""
        rays = self.rays
        self.spread[0] = self.spread[1] = -1
        x, y, u, v = [0.0] * 4, [0.0] * 4, [0] * 4, [0] * 4
        for number in range(self.worked):
            place = body * _SETS + number
            cosine, sine = self.cos[place] / 32768.0, self.sin[place] / 32768.0
            for column in range(left, right + 1, 4):  # as many together
                corner, at = row * _CORNERS + column, number * _LINES + (row & 1) * _LINE + column
                for lane in range(4):
                    x[lane] = rays.top_x[corner + lane] - self.x[place]
                for lane in range(4):
                    y[lane] = rays.top_y[corner + lane] - self.y[place]
                for lane in range(4):
                    u[lane] = int(x[lane] * cosine + y[lane] * sine + _LIFT)
                for lane in range(4):
                    v[lane] = int(y[lane] * cosine - x[lane] * sine + _LIFT)
                for lane in range(4):
                    self.corner[at + lane] = u[lane] - _LIFT
                for lane in range(4):
                    self.corner[_AXIS + at + lane] = v[lane] - _LIFT
        self._bound_line(row, left, right)

    def _bound_line(self, row: int, left: int, right: int) -> None:
        """Between which bounds the corners above pixels lie at all instants; as many are bounded together."""
        least, most = [0] * 4, [0] * 4
        for axis in range(2):
            line = axis * _LINES + (row & 1) * _LINE
            for column in range(left, right, 4):
                for lane in range(4):
                    least[lane], most[lane] = _LIFT, -_LIFT
                for number in range(self.worked):
                    at = axis * _AXIS + number * _LINES + (row & 1) * _LINE + column
                    for lane in range(4):
                        first, other = self.corner[at + lane], self.corner[at + lane + 1]
                        least[lane] = min(least[lane], min(first, other))
                        most[lane] = max(most[lane], max(first, other))
                for lane in range(4):
                    self.line_least[line + column + lane] = least[lane]
                    self.line_most[line + column + lane] = most[lane]

    def _bound_pixel(self, column: int) -> None:
        """Bounds between the corners above and below a pixel."""
        least, most = self.line_least, self.line_most
        self.least_u = min(least[column], least[_LINE + column])
        self.most_u = max(most[column], most[_LINE + column])
        self.least_v = min(least[_LINES + column], least[_LINES + _LINE + column])
        self.most_v = max(most[_LINES + column], most[_LINES + _LINE + column])

    def _inside(self, at: int) -> bool:
        """True if all samples of a pixel lie in a rectangle at all instants; `at`: where its edges are."""
        return (
            self.least_u > self.edges[at]
            and self.most_u <= self.edges[at + 1]
            and self.least_v > self.edges[at + 2]
            and self.most_v <= self.edges[at + 3]
        )

    def _outside(self, at: int) -> bool:
        """True if all lie beyond the same side of it."""
        return (
            self.most_u <= self.edges[at]
            or self.least_u > self.edges[at + 1]
            or self.most_v <= self.edges[at + 2]
            or self.least_v > self.edges[at + 3]
        )

    def _cover_pixel(self, body: int, row: int, column: int, index: int) -> None:
        """A pixel in which a robot may be seen: its paints, added up by how many samples of all instants see them."""
        self._bound_pixel(column)
        if self._outside(12 * body + 4 * _REACH):
            return
        if self.covered[index] or self.drift_um[body] > _FAST_UM:
            self.covered[index] = _UNSURE
            return
        scene, packed = self.scene, self.scene.packed
        whole = entered = 16 * self.field_sets
        on_top = self._within(row, column, _TOP)
        behind = 0
        if on_top < whole:
            pixel = row * _WIDTH + column
            entered = self._entered(body, row, column, on_top)
            if entered == 0:
                return
            behind = scene.behind(pixel)
            if (entered < whole and behind == _MIXED) or scene.shows_ball(pixel):
                self.covered[index] = _UNSURE
                return
        total = (entered - on_top) * packed[self.side]
        if entered < whole:
            total += (whole - entered) * packed[behind]
        if on_top:
            team = self._within(row, column, _TEAM)
            identity = self._within(row, column, _IDENTITY) if team < on_top else 0
            total += (on_top - team - identity) * packed[self.black]
            total += team * packed[self.team_paint[body]] + identity * packed[self.identity_paint[body]]
        self.covered[index] = _SURE
        self.total[index] = total

    def _within(self, row: int, column: int, box: int) -> int:
        """Number of samples, over all instants, in a rectangle."""
        at = 4 * box
        if self._inside(at):
            return 16 * self.field_sets
        if self._outside(at):
            return 0
        return self.times * self._count(
            row,
            column,
            0,
            self.worked * self.samples,
            self.edges[at],
            self.edges[at + 1],
            self.edges[at + 2],
            self.edges[at + 3],
        )

    def _count(
        self, row: int, column: int, first: int, end: int, low_u: int, high_u: int, low_v: int, high_v: int
    ) -> int:
        """Number of these samples in a rectangle: compared along the axes where edges are crossed."""
        across_u = self.least_u <= low_u or self.most_u > high_u
        across_v = self.least_v <= low_v or self.most_v > high_v
        if not (across_u or across_v):
            return end - first
        u, v = 0, _SAMPLES
        if across_u:
            self._spread(row, column, 0)
        else:
            u, low_u, high_u = v, low_v, high_v
        if across_v:
            self._spread(row, column, 1)
        else:
            v, low_v, high_v = u, low_u, high_u
        within = [0] * 4
        for at in range(first, end, 4):
            for lane in range(4):
                place_u, other = self.place_of[u + at + lane], self.place_of[v + at + lane]
                within[lane] += ((place_u > low_u) - (place_u > high_u)) & (
                    (other > low_v) - (other > high_v)
                )
        return within[0] + within[1] + within[2] + within[3]

    def _spread(self, row: int, column: int, axis: int) -> None:
        """Positions of a pixel's samples at all instants, line by line: between its corners, as in the scene."""
        pixel = row * _WIDTH + column
        if self.spread[axis] == pixel:
            return
        self.spread[axis] = pixel
        upper = axis * _AXIS + (row & 1) * _LINE + column
        lower = axis * _AXIS + (~row & 1) * _LINE + column
        at, by = [0] * 4, [0] * 4
        for number in range(self.worked):
            a, c = self.corner[number * _LINES + upper], self.corner[number * _LINES + lower]
            b, d = self.corner[number * _LINES + upper + 1] - a, self.corner[number * _LINES + lower + 1] - c
            line = 1 + 4 * (number & self.fields - 1)
            for lane in range(4):
                by[lane] = 8 * (c - a) + (2 * lane + 1) * (d - b)
            for lane in range(4):
                at[lane] = 8 * line * (c - a) + (2 * lane + 1) * (8 * b + line * (d - b))
            first = axis * _SAMPLES + number * self.samples
            for sample in range(first, first + self.samples, 4):
                for lane in range(4):
                    self.place_of[sample + lane] = a + (at[lane] >> 6)
                    at[lane] += 2 * by[lane]

    def _entered(self, body: int, row: int, column: int, on_top: int) -> int:
        """Number of samples, over all instants, that see any of a robot, `on_top` of them its top."""
        if self._inside(12 * body + 4 * _NEAR):
            return on_top
        if self._inside(12 * body + 4 * _BASE):
            return 16 * self.field_sets
        pixel = row * _WIDTH + column
        entered = 0
        for number in range(self.worked):
            self._turn(body * _SETS + number, self.rays.fall_x[pixel], self.rays.fall_y[pixel])
            entered += self._enter(row, column, number)
        return entered * self.times

    def _enter(self, row: int, column: int, number: int) -> int:
        """Number of an instant's samples that see any of a robot: one by one where some may pass its square by a
        corner.
        """
        fall_u, fall_v = self.fall_u, self.fall_v
        upper = number * _LINES + (row & 1) * _LINE + column
        lower = number * _LINES + (~row & 1) * _LINE + column
        above, below_it = self._across(upper), self._across(upper + 1)
        below, other = self._across(lower), self._across(lower + 1)
        least, most = (
            min(min(above, below_it), min(below, other)),
            max(max(above, below_it), max(below, other)),
        )
        first, end = number * self.samples, (number + 1) * self.samples
        fall = abs(fall_u) + abs(fall_v)
        if least > (_HALF_UM + 1) * fall or most < (-_HALF_UM - 1) * fall:
            return 0
        if least >= (1 - _HALF_UM) * fall and most <= (_HALF_UM - 1) * fall:
            low_u, high_u = -_HALF_UM - 1 - max(fall_u, 0), _HALF_UM - min(fall_u, 0)
            low_v, high_v = -_HALF_UM - 1 - max(fall_v, 0), _HALF_UM - min(fall_v, 0)
            return self._count(row, column, first, end, low_u, high_u, low_v, high_v)
        self._spread(row, column, 0)
        self._spread(row, column, 1)
        entered = 0
        for at in range(first, end):
            entered += enters(self.place_of[at], self.place_of[_SAMPLES + at], fall_u, fall_v)
        return entered

    def _across(self, corner: int) -> int:
        """Distance of a corner's ray from the middle of a robot, times the ray's fall."""
        return self.corner[corner] * self.fall_v - self.corner[_AXIS + corner] * self.fall_u

    # ---- several robots, or much in the background

    def _samples(self, row: int, column: int) -> int:
        """The samples of a pixel at all instants, one by one."""
        pixel = row * _WIDTH + column
        scene = self.scene
        behind = scene.behind(pixel)
        ball_seen = scene.shows_ball(pixel)
        scene.spread(pixel)
        for at in range(96):
            self.seen[at] = _OUT
            self.height_um[at] = -1
        self.worked = self.sets
        for body in range(self.robots):
            if self._beside(body, pixel) <= 0:
                self._find_corners(body, row, column, column + 1)
                self._find_corners(body, row + 1, column, column + 1)
                self._spread(row, column, 0)
                self._spread(row, column, 1)
                for number in range(self.sets):
                    self._see(body, number, pixel)
        total = 0
        for sample in range(16):
            field = sample >> 3 if self.fields == 2 else 0
            open_paint = -1
            for instant in range(self.field_sets):
                at = (instant * self.fields + field) * self.samples + sample - 8 * field
                paint, height = self.seen[at], self.height_um[at]
                if paint == _OUT:
                    if open_paint < 0:
                        open_paint = behind if behind != _MIXED else scene.sample(sample)
                    paint = open_paint
                elif ball_seen and height < _TOP_UM:
                    ball = scene.ball_above(sample, height)
                    paint = ball if ball >= 0 else paint
                total += scene.packed[paint]
        return total

    def _see(self, body: int, number: int, pixel: int) -> None:
        """Updates an instant's samples with one robot, where it is higher than what they have seen."""
        self._turn(body * _SETS + number, self.rays.fall_x[pixel], self.rays.fall_y[pixel])
        for at in range(number * self.samples, (number + 1) * self.samples):
            u, v = self.place_of[at], self.place_of[_SAMPLES + at]
            if self.height_um[at] == _TOP_UM:
                continue
            if self._lies_in(_TOP, u, v):
                self.seen[at] = self._top(body, u, v)
                self.height_um[at] = _TOP_UM
            elif enters(u, v, self.fall_u, self.fall_v):
                height = entry(u, v, self.fall_u, self.fall_v)
                if height > self.height_um[at]:
                    self.seen[at] = self.side
                    self.height_um[at] = height

    def _top(self, body: int, u: int, v: int) -> int:
        """The paint of a place on the top."""
        if self._lies_in(_TEAM, u, v):
            return self.team_paint[body]
        return self.identity_paint[body] if self._lies_in(_IDENTITY, u, v) else self.black

    def _lies_in(self, box: int, u: int, v: int) -> bool:
        """True if a place lies in a rectangle."""
        at = 4 * box
        return self.edges[at] < u <= self.edges[at + 1] and self.edges[at + 2] < v <= self.edges[at + 3]


def _um(metres: float) -> int:
    """A place in um, no further away than what is further than anything that may be seen."""
    return _rounded(max(-_FAR_UM, min(_FAR_UM, metres * 1e6)))


def _rounded(x: float) -> int:
    """The nearest whole number, the greater one of two."""
    below = math.floor(x + 0.5)
    return int(below)
