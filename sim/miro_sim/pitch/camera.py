"""The camera: robots and the scene behind them, sampled into windows of a picture.

A pixel is 4 x 4 samples for each instant of the exposure. A sample's ray falls from the height of the robots' tops to
the floor; in a robot's axes that is a straight line from `top` on by `fall`:

    top of a robot     the line begins inside its square: nothing is higher, so nothing hides it
    side of a robot    the line enters the square on its way down
    else               the scene without robots, unless the ball hides the side

Of several sides the highest is seen; where robots stand in each other, the first one is. All in um and integers.
`fall` is taken at the middle of the pixel.

Each corner of a pixel has a code, which tells beyond which edges it lies: of the top, of its patches, of all that is
seen of the robot (outcodes, after Cohen and Sutherland). The samples lie between the corners: where these are on one
side of an edge, no sample is compared with it. So any pixel gives the same bits in any window.
"""

from __future__ import annotations

import math

from miro_exact.dmath import sincos
from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.patterns import IDENTITIES, PATCH_MM, TEAMS, Pattern
from miro_sim.pitch.paints import NUMBERS
from miro_sim.pitch.picture_settings import PictureSettings
from miro_sim.pitch.rays import Rays, rays_of
from miro_sim.pitch.scene import Scene, scene_of
from miro_sim.pitch.sensor import Sensor

MOST_ROBOTS = 10
FIELD_S = 1001.0 / 60000.0
_SETS = 6  # at most: two fields of three instants
_HALF_UM = 37_500
_TOP_UM = 75_000
_ROUNDED_UM = 8  # what rounding adds
_TOP, _TEAM, _IDENTITY, _REACH, _BASE = 0, 1, 2, 3, 4  # rectangles in a robot's axes
_EDGES = 20  # of a robot at an instant: for each rectangle the last u before it and the last u in it, then v
_V = 10
_LOW, _HIGH = 0x401, 0x802  # bits of a code for the edges of the first rectangle
_CROSSED_U, _CROSSED_V = 0x3, 0xC00  # both edges along an axis
_RAYS = 1200  # after the edges of all robots: where those rays begin that may meet one
_OUT = -1
_FAR_UM = 1 << 29
_MIXED = 255
_WIDTH = 320
_HEIGHT = 240
_CORNERS = 321
_LINE = 352  # places of a line of corners or pixels
_BAND = 4096  # pixels that are worked on at once
_SURE, _UNSURE = 1, 2  # whether the samples of a pixel in which robots may be seen are known


class Camera:
    """A camera above the pitch; also the picture that it took last, a window at a time.

    Bodies are put into the scene with `robot` and `ball`, then `begin` takes a frame of them, then any windows of it
    may be read, in any order. Nothing of it is state: a frame is a function of where things stand and its number.
    """

    NOT_STATE = (
        *("parameters", "settings", "pattern", "rays", "scene", "sensor", "width", "height", "sets"),
        *("field_sets", "side", "black", "boxes", "robots", "team_paint", "identity_paint", "x", "y"),
        *("cos", "sin", "shift_u", "shift_v", "edges", "near_low", "near_high", "drift_um"),
        *("span_first", "span_end", "corner_u", "corner_v", "code", "every", "some", "always", "ever"),
        *("covered", "covered_first", "covered_end", "total", "first", "samples", "upper", "lower"),
        *("above", "below", "fall_u", "fall_v"),
        *("u", "v", "seen", "height_um"),
    )

    def __init__(
        self, parameters: CameraParameters, settings: PictureSettings, pattern: Pattern, stream: Stream
    ) -> None:
        self.parameters = parameters
        self.settings = settings
        self.pattern = pattern
        self.width = WIDTH
        self.height = HEIGHT
        self.rays: Rays = rays_of(parameters)
        self.scene: Scene = scene_of(parameters, settings, None)
        self.sensor = Sensor(settings, stream)
        self.field_sets = settings.sub_exposures
        self.sets = settings.sub_exposures * settings.fields
        self.side = NUMBERS["side"]
        self.black = NUMBERS["top"]
        boxes = [(0, 0, _HALF_UM), *((1000 * u, 1000 * v, 500 * PATCH_MM) for u, v in pattern)]
        self.boxes = [(u - half, u + half, v - half, v + half) for u, v, half in boxes]
        self.robots = 0
        self.team_paint = [0] * 10
        self.identity_paint = [0] * 10
        self.x = [0] * 60
        self.y = [0] * 60
        self.cos = [0] * 60
        self.sin = [0] * 60
        self.shift_u = [0] * 60
        self.shift_v = [0] * 60
        self.edges = [0] * 1220
        self.near_low = [0] * 10
        self.near_high = [0] * 10
        self.drift_um = [0] * 10
        self.span_first = 0
        self.span_end = 0
        self.corner_u = [0] * 4224
        self.corner_v = [0] * 4224
        self.code = [0] * 4224
        self.every = [0] * 2112
        self.some = [0] * 2112
        self.always = [0] * 352
        self.ever = [0] * 352
        self.covered = [0] * 4096
        self.covered_first = 0
        self.covered_end = 0
        self.total = [0] * 4096
        self.first = 0
        self.samples = 16
        self.upper = -1
        self.lower = -1
        self.above = 0
        self.below = 0
        self.fall_u = 0
        self.fall_v = 0
        self.u = [0] * 16
        self.v = [0] * 16
        self.seen = [0] * 96
        self.height_um = [0] * 96

    def __repr__(self) -> str:
        return f"Camera({self.rays!r}, {self.robots} robots, {self.sensor!r})"

    def clear(self) -> None:
        """Takes all robots and the ball off the pitch."""
        self.clear_robots()
        self.scene = scene_of(self.parameters, self.settings, None)

    def clear_robots(self) -> None:
        """Takes all robots off the pitch; the ball stays."""
        self.robots = 0

    def ball(self, x_m: float, y_m: float) -> None:
        """Puts the ball on the floor, its centre above this place."""
        self.scene = scene_of(self.parameters, self.settings, (_um(x_m), _um(y_m)))

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
        self.team_paint[body] = NUMBERS[TEAMS[team]]
        self.identity_paint[body] = NUMBERS[IDENTITIES[identity]]
        self.near_low[body] = self.near_high[body] = 0
        for at in range(self.sets):
            field = at // self.field_sets
            share = (at % self.field_sets * 2 + 1) / (2.0 * self.field_sets) - 0.5
            after_s = (field - 0.5 * (self.settings.fields - 1)) * FIELD_S + share * self.settings.exposure_s
            way_m = v_m_s * after_s
            sine, cosine = sincos(theta_rad + 0.5 * w_rad_s * after_s)
            place = body * _SETS + at
            self.x[place] = _um(x_m + way_m * cosine)
            self.y[place] = _um(y_m + way_m * sine)
            sine, cosine = sincos(theta_rad + w_rad_s * after_s)
            self.cos[place] = math.floor(cosine * 32768.0 + 0.5)
            self.sin[place] = math.floor(sine * 32768.0 + 0.5)
            self._stand(place)
        self._bound(body)
        self.robots = body + 1

    def _stand(self, place: int) -> None:
        """What follows from where a robot is: what moves places into its axes, and the edges there.

        The ray through the middle of its top falls by `fall`, that from a place u beside it by `fall` + u top / drop:
        it ends at `fall` + u camera / drop. What may be seen of the robot begins in `_REACH`; what begins in `_BASE`
        ends under the robot. An edge of the top is near if rays from beyond it may fall towards the robot.
        """
        cosine, sine = self.cos[place], self.sin[place]
        self.shift_u[place] = self.x[place] * cosine + self.y[place] * sine
        self.shift_v[place] = self.y[place] * cosine - self.x[place] * sine
        at = _EDGES * place
        for box, (low_u, high_u, low_v, high_v) in enumerate(self.boxes):
            self.edges[at + 2 * box], self.edges[at + 2 * box + 1] = low_u - 1, high_u
            self.edges[at + 2 * box + _V], self.edges[at + 2 * box + _V + 1] = low_v - 1, high_v
        drop = self.rays.height_um - _TOP_UM
        x = _TOP_UM * (self.x[place] - self.rays.x_um) // drop
        y = _TOP_UM * (self.y[place] - self.rays.y_um) // drop
        self._surround(place, at, _LOW & _CROSSED_U, (x * cosine + y * sine) >> 15)
        self._surround(place, at + _V, _LOW & _CROSSED_V, (y * cosine - x * sine) >> 15)

    def _surround(self, place: int, at: int, low: int, fall: int) -> None:
        """The edges that depend on the fall, along u or along v; `low`: the bit of the top's lower one."""
        camera = self.rays.height_um
        drop = camera - _TOP_UM
        margin = self.rays.spread_um // 4 + 2 * _ROUNDED_UM  # all rays of a pixel are taken to fall alike
        self.edges[at + 2 * _REACH] = min(-_HALF_UM, (-_HALF_UM - fall - margin) * drop // camera) - 1
        self.edges[at + 2 * _REACH + 1] = max(_HALF_UM, (_HALF_UM - fall + margin) * drop // camera + 1)
        self.edges[at + 2 * _BASE] = (-_HALF_UM - fall + margin) * drop // camera + 1
        self.edges[at + 2 * _BASE + 1] = (_HALF_UM - fall - margin) * drop // camera
        if fall > -margin:
            self.near_low[place // _SETS] |= low
        if fall < margin:
            self.near_high[place // _SETS] |= low << 1

    def _bound(self, body: int) -> None:
        """How far, at most, a place of the robot is at any instant from where it is at the middle one."""
        first = body * _SETS
        middle = first + self.sets // 2
        reach = _EDGES * middle + 2 * _REACH
        length = self.edges[reach + 1] - self.edges[reach]
        length += self.edges[reach + _V + 1] - self.edges[reach + _V]
        drift = 0
        for place in range(first, first + self.sets):
            way = abs(self.x[place] - self.x[middle]) + abs(self.y[place] - self.y[middle])
            turn = abs(self.cos[place] - self.cos[middle]) + abs(self.sin[place] - self.sin[middle])
            drift = max(drift, way + way // 4 + (length * turn >> 15))
        self.drift_um[body] = drift + _ROUNDED_UM

    def begin(self, frame: int, tick: int) -> None:
        """Takes frame number `frame` (below 2^24) of what stands there now; `tick`: the middle of the exposure."""
        self.sensor.begin(frame, tick, 16 * self.field_sets)

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """A window's pixels: see `miro_host.eye.grabber`. Raises ValueError for one that is not inside the picture."""
        if min(left, top, width - 1, height - 1) < 0 or left + width > _WIDTH or top + height > _HEIGHT:
            raise ValueError(
                f"window {width} x {height} at ({left}, {top}) is not inside {_WIDTH} x {_HEIGHT}"
            )
        out = bytearray(3 * width * height)
        self._draw(left, top, width, height, out)
        return out

    def _draw(self, left: int, top: int, width: int, height: int, out: bytearray) -> None:
        first = max(0, left - self.sensor.side)
        end = min(_WIDTH, left + width + self.sensor.side)
        band = _BAND // (end - first)
        for above in range(top, top + height, band):
            below = min(top + height, above + band)
            self._cover(above, below, first, end)
            for row in range(above, below):
                self.scene.show(self.sensor, row, first, end, self.field_sets)
                self._put_robots(row, (row - above) * (end - first) - first)
                self.sensor.write(row, left, width, out, 3 * width * (row - top))

    def _put_robots(self, row: int, at: int) -> None:
        """Those pixels of a line in which a robot may be seen; `at`: where column 0 would be in the band."""
        for column in range(self.covered_first, self.covered_end):
            if self.covered[at + column]:
                sure = self.covered[at + column] == _SURE
                total = self.total[at + column] if sure else self._samples(row, column)
                self.sensor.put(column, total, self.scene.light(row * _WIDTH + column))

    # ---- one robot

    def _cover(self, top: int, bottom: int, first: int, end: int) -> None:
        """Finds the pixels of a band in which robots may be seen, and their paints where it is one robot."""
        width, height = end - first, bottom - top
        for at in range(width * height):
            self.covered[at] = 0
        self.covered_first, self.covered_end = _WIDTH, 0
        pixel = (top + height // 2) * _WIDTH + first + width // 2
        most = (width + height + 6) * self.rays.spread_um  # neighbours are no further apart than two spreads
        for body in range(self.robots):
            if self._beside(body, pixel) <= most:
                self._cover_with(body, top, bottom, first, end)

    def _cover_with(self, body: int, top: int, bottom: int, first: int, end: int) -> None:
        """The same for one robot: line by line, between the corners above and below."""
        self._find_span(body, top, first, end)
        self._find_corners(body, top, self.span_first, self.span_end)
        at = 0 - first
        for row in range(top, bottom):
            left, right = self.span_first, self.span_end
            self.covered_first = min(self.covered_first, left)
            self.covered_end = max(self.covered_end, right)
            self._find_span(body, row + 1, first, end if row + 1 < bottom else first)
            self._find_corners(body, row + 1, min(left, self.span_first), max(right, self.span_end))
            self._join(row, left, right)
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
        place = body * _SETS + self.sets // 2
        edges = _EDGES * place + 2 * _REACH
        x, y = self.rays.middle_x[pixel], self.rays.middle_y[pixel]
        u = (x * self.cos[place] + y * self.sin[place] - self.shift_u[place]) >> 15
        v = (y * self.cos[place] - x * self.sin[place] - self.shift_v[place]) >> 15
        beside_u = max(self.edges[edges] - u, u - self.edges[edges + 1])
        beside_v = max(self.edges[edges + _V] - v, v - self.edges[edges + _V + 1])
        return max(beside_u, beside_v) - self.drift_um[body] - self.rays.spread_um - _ROUNDED_UM

    def _find_corners(self, body: int, row: int, left: int, right: int) -> None:
        """The corners above a line, from `left` to `right`, in the axes of a robot at each instant, and their codes."""
        rays = self.rays
        for at in range(self.sets):
            place = body * _SETS + at
            cosine, sine = self.cos[place], self.sin[place]
            shift_u, shift_v = self.shift_u[place], self.shift_v[place]
            line = (2 * at + (row & 1)) * _LINE
            corner = row * _CORNERS
            for column in range(left, right + 1):
                x, y = rays.top_x[corner + column], rays.top_y[corner + column]
                self.corner_u[line + column] = (x * cosine + y * sine - shift_u) >> 15
                self.corner_v[line + column] = (y * cosine - x * sine - shift_v) >> 15
            self._encode(_EDGES * place, line + left, line + right + 1)

    def _encode(self, at: int, first: int, end: int) -> None:
        """The codes of corners: bit k tells whether u is beyond edge k, bit 10 + k the same of v."""
        edges = self.edges
        a, b, c, d, e = edges[at + 9], edges[at + 8], edges[at + 7], edges[at + 6], edges[at + 5]
        f, g, h, i, j = edges[at + 4], edges[at + 3], edges[at + 2], edges[at + 1], edges[at]
        for corner in range(first, end, 4):  # as many together
            for lane in range(4):
                u = self.corner_u[corner + lane]
                high = 2 * (2 * (2 * (2 * (u > a) + (u > b)) + (u > c)) + (u > d)) + (u > e)
                high = 2 * (2 * (2 * (2 * high + (u > f)) + (u > g)) + (u > h)) + (u > i)
                self.code[corner + lane] = 2 * high + (u > j)
        at += _V
        a, b, c, d, e = edges[at + 9], edges[at + 8], edges[at + 7], edges[at + 6], edges[at + 5]
        f, g, h, i, j = edges[at + 4], edges[at + 3], edges[at + 2], edges[at + 1], edges[at]
        for corner in range(first, end, 4):
            for lane in range(4):
                v = self.corner_v[corner + lane]
                high = 2 * (2 * (2 * (2 * (v > a) + (v > b)) + (v > c)) + (v > d)) + (v > e)
                high = 2 * (2 * (2 * (2 * high + (v > f)) + (v > g)) + (v > h)) + (v > i)
                self.code[corner + lane] |= (2 * high + (v > j)) << _V

    def _join(self, row: int, left: int, right: int) -> None:
        """What the codes of a pixel's corners have all (`every`) and what one of them has (`some`), at each instant.

        `always` and `ever`: the same over all instants.
        """
        for column in range(left, right, 4):
            for lane in range(4):
                self.always[column + lane] = -1
                self.ever[column + lane] = 0
        for at in range(self.sets):
            above = (2 * at + (row & 1)) * _LINE
            below = (2 * at + (~row & 1)) * _LINE
            joined = at * _LINE
            for column in range(left, right, 4):
                for lane in range(4):
                    a, b = self.code[above + column + lane], self.code[above + column + lane + 1]
                    c, d = self.code[below + column + lane], self.code[below + column + lane + 1]
                    self.every[joined + column + lane] = a & b & c & d
                    self.some[joined + column + lane] = a | b | c | d
                    self.always[column + lane] &= a & b & c & d
                    self.ever[column + lane] |= a | b | c | d

    def _cover_pixel(self, body: int, row: int, column: int, index: int) -> None:
        """A pixel in which a robot may be seen: its paints, added over all samples and instants."""
        if _outside(_REACH, self.always[column], self.ever[column]):
            return
        if self.covered[index]:
            self.covered[index] = _UNSURE
            return
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
        on_top = self._within(body, row, column, _TOP)
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
        if on_top:
            team = self._within(body, row, column, _TEAM)
            identity = self._within(body, row, column, _IDENTITY) if team < on_top else 0
            total += team * scene.packed[self.team_paint[body]]
            total += identity * scene.packed[self.identity_paint[body]]
            total += (on_top - team - identity) * scene.packed[self.black]
        return total

    def _within(self, body: int, row: int, column: int, box: int) -> int:
        """How many samples of all instants lie in a rectangle."""
        if _outside(box, self.always[column], self.ever[column]):
            return 0
        if _inside(box, self.always[column], self.ever[column]):
            return 16 * self.field_sets
        return self._count_within(body, row, column, box)

    def _count_within(self, body: int, row: int, column: int, box: int) -> int:
        """The same, instant by instant."""
        low, high = _LOW << 2 * box, _HIGH << 2 * box
        within = 0
        for at in range(self.sets):
            every, some = self.every[at * _LINE + column], self.some[at * _LINE + column]
            if not _outside(box, every, some):
                crossed = ((every & low) | (some & high)) ^ low
                self._turn(row, column, at)
                edges = _EDGES * (body * _SETS + at) + 2 * box
                within += self._count(edges, crossed >> 2 * box) if crossed else self.samples
        return within

    def _turn(self, row: int, column: int, at: int) -> None:
        """Turns to a pixel at an instant: where its corners are, and its samples: 16, or the 8 of its field."""
        self.above = (2 * at + (row & 1)) * _LINE + column
        self.below = (2 * at + (~row & 1)) * _LINE + column
        if self.sets != self.field_sets:
            self.first, self.samples = 8 * (at // self.field_sets), 8
            self.upper, self.lower = self.first // 8 - 1, 0 - self.first // 8

    def _count(self, at: int, crossed: int) -> int:
        """How many samples lie in a rectangle; `crossed`: its edges on both sides of which they lie."""
        if not crossed & _CROSSED_V:
            return self._count_along(self.corner_u, at, crossed)
        if not crossed & _CROSSED_U:
            return self._count_along(self.corner_v, at + _V, crossed >> _V)
        self._spread(self.u, self.corner_u)
        self._spread(self.v, self.corner_v)
        u, v = self.corner_u[self.above], self.corner_v[self.above]
        low_u, high_u = self.edges[at] - u, self.edges[at + 1] - u
        low_v, high_v = self.edges[at + _V] - v, self.edges[at + _V + 1] - v
        within = 0
        for sample in range(16):
            inside_u = (self.u[sample] > low_u) & (self.u[sample] <= high_u)
            within += inside_u & (self.v[sample] > low_v) & (self.v[sample] <= high_v)
        return within

    def _count_along(self, corners: list[int], at: int, crossed: int) -> int:
        """The same where edges are crossed along one axis only."""
        within = self._count_beyond(corners, self.edges[at]) if crossed & 1 else self.samples
        return within - self._count_beyond(corners, self.edges[at + 1]) if crossed & 2 else within

    def _count_beyond(self, corners: list[int], edge: int) -> int:
        """How many samples lie beyond an edge: those that `_spread` would find there."""
        a = corners[self.above]
        b, c, d = corners[self.above + 1] - a, corners[self.below] - a, corners[self.below + 1] - a
        edge = 64 * (edge - a) + 63
        upper, lower = self.upper, self.lower
        beyond = 0
        for column in range(4):
            p = 2 * column + 1
            by = 8 * c + p * (d - b - c)
            at = 8 * p * b + by
            above = (at > edge) + (at + 2 * by > edge)
            below = (at + 4 * by > edge) + (at + 6 * by > edge)
            beyond += (above & upper) + (below & lower)
        return beyond

    def _entered(self, body: int, row: int, column: int, on_top: int) -> int:
        """How many samples of all instants see any of a robot, `on_top` of them its top."""
        every, some = self.always[column], self.ever[column]
        near = self.near_low[body]
        if ((every & near) | (some & self.near_high[body])) == near:
            return on_top
        if _inside(_BASE, every, some):
            return 16 * self.field_sets
        entered = 0
        for at in range(self.sets):
            every, some = self.every[at * _LINE + column], self.some[at * _LINE + column]
            if not _outside(_REACH, every, some):
                self._turn(row, column, at)
                inside = _inside(_BASE, every, some)
                entered += self.samples if inside else self._enter(body * _SETS + at, row * _WIDTH + column)
        return entered

    def _enter(self, place: int, pixel: int) -> int:
        """How many samples of an instant see any of a robot: as `_enters`."""
        self._fall(place, pixel)
        a, b = self.corner_u[self.above], self.corner_u[self.above + 1]
        c, d = self.corner_u[self.below], self.corner_u[self.below + 1]
        least_u, most_u = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
        a, b = self.corner_v[self.above], self.corner_v[self.above + 1]
        c, d = self.corner_v[self.below], self.corner_v[self.below + 1]
        least_v, most_v = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
        low_u, high_u = self.edges[_RAYS], self.edges[_RAYS + 1]
        low_v, high_v = self.edges[_RAYS + _V], self.edges[_RAYS + _V + 1]
        if most_u <= low_u or least_u > high_u or most_v <= low_v or least_v > high_v:
            return 0
        crossed = (least_u <= low_u) + 2 * (most_u > high_u)
        crossed |= (least_v <= low_v) + 2 * (most_v > high_v) << _V
        within = self._count(_RAYS, crossed) if crossed else self.samples
        u, v = (least_u + most_u) >> 1, (least_v + most_v) >> 1
        return self._across(within, u, v, most_u - u, most_v - v) if within else 0

    def _fall(self, place: int, pixel: int) -> None:
        """How far rays fall in a robot's axes, and between which edges they begin that may meet it."""
        x, y = self.rays.fall_x[pixel], self.rays.fall_y[pixel]
        self.fall_u = (x * self.cos[place] + y * self.sin[place]) >> 15
        self.fall_v = (y * self.cos[place] - x * self.sin[place]) >> 15
        self.edges[_RAYS] = -_HALF_UM - 1 - max(self.fall_u, 0)
        self.edges[_RAYS + 1] = _HALF_UM - min(self.fall_u, 0)
        self.edges[_RAYS + _V] = -_HALF_UM - 1 - max(self.fall_v, 0)
        self.edges[_RAYS + _V + 1] = _HALF_UM - min(self.fall_v, 0)

    def _across(self, within: int, u: int, v: int, around_u: int, around_v: int) -> int:
        """How many of the samples between the right edges see any of a robot; all lie around (u, v)."""
        fall_u, fall_v = self.fall_u, self.fall_v
        most = _HALF_UM * (abs(fall_u) + abs(fall_v))
        middle = u * fall_v - v * fall_u
        around = around_u * abs(fall_v) + around_v * abs(fall_u)
        if abs(middle) - around > most:
            return 0
        if abs(middle) + around <= most:
            return within
        return self._count_entering()

    def _count_entering(self) -> int:
        """How many samples see any of a robot, one by one: as `_enters`."""
        self._spread(self.u, self.corner_u)
        self._spread(self.v, self.corner_v)
        fall_u, fall_v = self.fall_u, self.fall_v
        u, v = self.corner_u[self.above], self.corner_v[self.above]
        low_u, high_u = self.edges[_RAYS] - u, self.edges[_RAYS + 1] - u
        low_v, high_v = self.edges[_RAYS + _V] - v, self.edges[_RAYS + _V + 1] - v
        most = _HALF_UM * (abs(fall_u) + abs(fall_v))
        low, high = -most - u * fall_v + v * fall_u, most - u * fall_v + v * fall_u
        entered = 0
        for sample in range(16):
            u, v = self.u[sample], self.v[sample]
            if low_u < u <= high_u and low_v < v <= high_v and low <= u * fall_v - v * fall_u <= high:
                entered += 1
        return entered

    def _spread(self, samples: list[int], corners: list[int]) -> None:
        """How far samples lie from a pixel's first corner: as `rays.between`; those of the other field lie far away."""
        a = corners[self.above]
        b, c, d = corners[self.above + 1] - a, corners[self.below] - a, corners[self.below + 1] - a
        for column in range(4):
            p = 2 * column + 1
            at = 8 * p * b
            by = 8 * c + p * (d - b - c)
            samples[column] = (at + by) >> 6
            samples[4 + column] = (at + 3 * by) >> 6
            samples[8 + column] = (at + 5 * by) >> 6
            samples[12 + column] = (at + 7 * by) >> 6
        if self.samples < 16:
            for column in range(8):
                samples[8 - self.first + column] = _FAR_UM

    # ---- several robots, or much in the background

    def _samples(self, row: int, column: int) -> int:
        """The samples of a pixel at all instants, one by one."""
        pixel = row * _WIDTH + column
        scene = self.scene
        behind = scene.behind(pixel)
        ball_seen = scene.shows_ball(pixel)
        for at in range(16 * self.sets):
            self.seen[at] = _OUT
            self.height_um[at] = -1
        for body in range(self.robots):
            if self._beside(body, pixel) <= 0:
                self._find_corners(body, row, column, column + 1)
                self._find_corners(body, row + 1, column, column + 1)
                for at in range(self.sets):
                    self._turn(row, column, at)
                    self._see(body, at, pixel)
        total = 0
        for at in range(self.sets):
            self._turn(row, column, at)
            for sample in range(self.first, self.first + self.samples):
                paint, height = self.seen[16 * at + sample], self.height_um[16 * at + sample]
                if paint == _OUT:
                    paint = behind if behind != _MIXED else scene.sample(pixel, sample)
                elif ball_seen and height < _TOP_UM:
                    ball = scene.ball_above(pixel, sample, height)
                    paint = ball if ball >= 0 else paint
                total += scene.packed[paint]
        return total

    def _see(self, body: int, at: int, pixel: int) -> None:
        """What the samples of an instant see of one robot, where it is higher than what they have seen."""
        place = body * _SETS + at
        self._fall(place, pixel)
        self._spread(self.u, self.corner_u)
        self._spread(self.v, self.corner_v)
        for sample in range(self.first, self.first + self.samples):
            u, v = self.corner_u[self.above] + self.u[sample], self.corner_v[self.above] + self.v[sample]
            index = 16 * at + sample
            if self.height_um[index] == _TOP_UM:
                continue
            if self._lies_in(place, _TOP, u, v):
                self.seen[index] = self._top(body, u, v)
                self.height_um[index] = _TOP_UM
            elif _enters(u, v, self.fall_u, self.fall_v):
                height = _entry(u, v, self.fall_u, self.fall_v)
                if height > self.height_um[index]:
                    self.seen[index] = self.side
                    self.height_um[index] = height

    def _top(self, body: int, u: int, v: int) -> int:
        """The paint of a place on the top."""
        if self._lies_in(body * _SETS, _TEAM, u, v):
            return self.team_paint[body]
        return self.identity_paint[body] if self._lies_in(body * _SETS, _IDENTITY, u, v) else self.black

    def _lies_in(self, place: int, box: int, u: int, v: int) -> bool:
        """Whether a place lies in a rectangle."""
        at = _EDGES * place + 2 * box
        inside_u = self.edges[at] < u <= self.edges[at + 1]
        return inside_u and self.edges[at + _V] < v <= self.edges[at + _V + 1]


def _inside(box: int, every: int, some: int) -> bool:
    """Whether all corners with such codes, and so all samples between them, lie in a rectangle."""
    low, high = _LOW << 2 * box, _HIGH << 2 * box
    return ((every & low) | (some & high)) == low


def _outside(box: int, every: int, some: int) -> bool:
    """Whether all lie beyond the same side of it."""
    low, high = _LOW << 2 * box, _HIGH << 2 * box
    return ((some & low) | (every & high)) != low


def _um(metres: float) -> int:
    return math.floor(metres * 1e6 + 0.5)


def _enters(u: int, v: int, fall_u: int, fall_v: int) -> bool:
    """Whether the line from (u, v) on by the fall meets the square of a robot (separating axes)."""
    if (u < -_HALF_UM and u + fall_u < -_HALF_UM) or (u > _HALF_UM and u + fall_u > _HALF_UM):
        return False  # both ends are beyond one side
    if (v < -_HALF_UM and v + fall_v < -_HALF_UM) or (v > _HALF_UM and v + fall_v > _HALF_UM):
        return False
    most = _HALF_UM * (abs(fall_u) + abs(fall_v))
    return -most <= u * fall_v - v * fall_u <= most


def _entry(u: int, v: int, fall_u: int, fall_v: int) -> int:
    """The height at which such a line, which begins outside the square of a robot, enters it."""
    latest = 0
    if abs(u) > _HALF_UM and fall_u != 0:
        latest = (abs(u) - _HALF_UM << 16) // abs(fall_u)
    if abs(v) > _HALF_UM and fall_v != 0:
        latest = max(latest, (abs(v) - _HALF_UM << 16) // abs(fall_v))
    return _TOP_UM - (_TOP_UM * latest >> 16)
