"""The camera: robots and the scene behind them, sampled into windows of a picture.

A pixel is 4 x 4 samples for each instant of the exposure. A sample's ray falls from the height of the robots' tops to
the floor; in a robot's axes that is a straight line from `top` on by `fall`:

    top of a robot     the line begins inside its square: nothing is higher, so nothing hides it
    side of a robot    the line enters the square on its way down
    else               the scene without robots, unless the ball hides the side

Of several sides the highest is seen; where robots stand in each other, the first one is. All in um and integers.
`fall` is taken at the middle of the pixel.

The samples of a pixel lie around its middle, no further from it than `spread_um` along the robot's axes. So where that
is far enough from all edges, no sample is looked at; and any pixel gives the same bits in any window. Where it is so by
more than a robot moves while the shutter is open (`drift_um`), one look does for all instants.
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
_CORNER_UM = 53_034  # from the middle of a robot's top to its corner, rounded up
_ROUNDED_UM = 8  # what rounding adds
_TOP, _TEAM, _IDENTITY, _RAYS = 0, 1, 2, 3
_OUT = -1
_UNSURE = -1
_FAR_UM = 1 << 29
_MIXED = 255
_WIDTH = 320
_HEIGHT = 240
_CORNERS = 321


class Camera:
    """A camera above the pitch; also the picture that it took last, a window at a time.

    Bodies are put into the scene with `robot` and `ball`, then `begin` takes a frame of them, then any windows of it
    may be read, in any order. Nothing of it is state: a frame is a function of where things stand and its number.
    """

    NOT_STATE = (
        *("parameters", "settings", "pattern", "rays", "scene", "sensor", "width", "height", "sets"),
        *("field_sets", "side", "black", "robots", "team_paint", "identity_paint", "x", "y", "cos", "sin"),
        *("spread_um", "drift_um", "near", "near_count", "span_first", "span_end", "seers", "seer_count"),
        *("first", "samples", "cornered", "top_x", "top_y", "low_u", "high_u", "low_v", "high_v"),
        *("corner_u", "corner_v", "more_um", "around_um", "middle_u", "middle_v", "fall_u", "fall_v"),
        *("sure", "sampled", "u", "v", "seen", "height_um"),
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
        self.low_u = [u - half_um for u, _, half_um in boxes] + [0]
        self.high_u = [u + half_um for u, _, half_um in boxes] + [0]
        self.low_v = [v - half_um for _, v, half_um in boxes] + [0]
        self.high_v = [v + half_um for _, v, half_um in boxes] + [0]
        self.robots = 0
        self.team_paint = [0] * 10
        self.identity_paint = [0] * 10
        self.x = [0] * 60
        self.y = [0] * 60
        self.cos = [0] * 60
        self.sin = [0] * 60
        self.spread_um = [0] * 60
        self.drift_um = [0] * 10
        self.near = [0] * 10
        self.near_count = 0
        self.span_first = [0] * 10
        self.span_end = [0] * 10
        self.seers = [0] * 10
        self.seer_count = 0
        self.first = 0
        self.samples = 16
        self.cornered = -1
        self.top_x = [0] * 4
        self.top_y = [0] * 4
        self.corner_u = [0] * 4
        self.corner_v = [0] * 4
        self.more_um = 0
        self.around_um = 0
        self.middle_u = 0
        self.middle_v = 0
        self.fall_u = 0
        self.fall_v = 0
        self.sure = True
        self.sampled = False
        self.u = [0] * 16
        self.v = [0] * 16
        self.seen = [0] * 16
        self.height_um = [0] * 16

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
            aside = self.rays.aside_um * (abs(self.cos[place]) + abs(self.sin[place])) >> 15
            self.spread_um[place] = min(self.rays.spread_um, aside + 2)  # of a pixel along the robot's axes
        self._bound(body)
        self.robots = body + 1

    def _bound(self, body: int) -> None:
        """How far, at most, a place of the robot is at any instant from where it is at the middle one."""
        first = body * _SETS
        middle = first + self.sets // 2
        drift = 0
        for place in range(first, first + self.sets):
            way = abs(self.x[place] - self.x[middle]) + abs(self.y[place] - self.y[middle])
            turn = abs(self.cos[place] - self.cos[middle]) + abs(self.sin[place] - self.sin[middle])
            drift = max(drift, way + (_CORNER_UM * turn >> 15))
        self.drift_um[body] = drift + _ROUNDED_UM if drift else 0

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
        self._gather(first, top, end - first, height)
        for row in range(top, top + height):
            self.scene.show(self.sensor, row, first, end, self.field_sets)
            if self.near_count:
                self._draw_robots(row, first, end)
            self.sensor.write(row, left, width, out, 3 * width * (row - top))

    def _gather(self, left: int, top: int, width: int, height: int) -> None:
        """Which bodies may be seen in the window: neighbouring pixels are no further apart than two spreads."""
        pixel = (top + height // 2) * _WIDTH + left + width // 2
        reach = (width // 2 + height // 2 + 3) * 2 * self.rays.spread_um + self.rays.longest_fall_um
        self.near_count = 0
        for body in range(self.robots):
            if self._beyond(body, pixel) <= reach:
                self.near[self.near_count] = body
                self.near_count += 1

    def _beyond(self, body: int, pixel: int) -> int:
        """How far the ray of a pixel's middle stays beside a robot, at least; below 0 where its samples may meet it."""
        place = body * _SETS + self.sets // 2
        cosine, sine = self.cos[place], self.sin[place]
        x = self.rays.middle_x[pixel] - self.x[place]
        y = self.rays.middle_y[pixel] - self.y[place]
        u = (x * cosine + y * sine) >> 15
        v = (y * cosine - x * sine) >> 15
        x = self.rays.fall_x[pixel]
        y = self.rays.fall_y[pixel]
        end_u = u + ((x * cosine + y * sine) >> 15)
        end_v = v + ((y * cosine - x * sine) >> 15)
        aside = max(min(u, end_u), -max(u, end_u), min(v, end_v), -max(v, end_v))
        return aside - _HALF_UM - self.drift_um[body] - self.rays.spread_um - _ROUNDED_UM

    def _find_span(self, index: int, row: int, first: int, end: int) -> None:
        """Between which columns of a line a robot may be seen: where it is far, as many pixels are left out."""
        step = 2 * self.rays.spread_um + _ROUNDED_UM
        body = self.near[index]
        while first < end:
            beyond = self._beyond(body, row * _WIDTH + first)
            if beyond <= 0:
                break
            first += 1 + (beyond - 1) // step
        while first < end:
            beyond = self._beyond(body, row * _WIDTH + end - 1)
            if beyond <= 0:
                break
            end -= 1 + (beyond - 1) // step
        self.span_first[index], self.span_end[index] = first, end

    def _draw_robots(self, row: int, first: int, end: int) -> None:
        """Those pixels of a line in which a robot may be seen."""
        left, right = end, first
        for index in range(self.near_count):
            self._find_span(index, row, first, end)
            if self.span_first[index] < self.span_end[index]:
                left = min(left, self.span_first[index])
                right = max(right, self.span_end[index])
        for column in range(left, right):
            passing = 0
            last = 0
            for index in range(self.near_count):
                if self.span_first[index] <= column < self.span_end[index]:
                    passing += 1
                    last = self.near[index]
            if passing:
                pixel = row * _WIDTH + column
                total = self._steady(last, pixel) if passing == 1 else _UNSURE
                if total == _UNSURE:
                    total = 0
                    for at in range(self.sets):
                        total += self._instant(pixel, column, at)
                self.sensor.put(column, total, self.scene.light(pixel))

    def _steady(self, body: int, pixel: int) -> int:
        """The paints of all samples of a pixel, added, if they are the same at all instants of the exposure."""
        self.first, self.samples = 0, 16
        self.more_um = self.drift_um[body]
        total = self._alone(body * _SETS + self.sets // 2, pixel)
        return total * self.field_sets if total != _UNSURE else _UNSURE

    def _instant(self, pixel: int, column: int, at: int) -> int:
        """The samples of one instant: all 16, or the 8 of its field."""
        if self.sets != self.field_sets:
            self.first, self.samples = 8 * (at // self.field_sets), 8
        self.more_um = 0
        self.seer_count = 0
        for index in range(self.near_count):
            if self.span_first[index] <= column < self.span_end[index]:
                self.seers[self.seer_count] = self.near[index] * _SETS + at
                self.seer_count += 1
        total = self._alone(self.seers[0], pixel) if self.seer_count == 1 else _UNSURE
        return total if total != _UNSURE else self._samples(pixel)

    def _turn(self, place: int, pixel: int) -> None:
        """Where the pixel's middle is in the axes of a robot at an instant, and how far from it its samples are."""
        self.sampled = False
        self.around_um = self.spread_um[place] + self.more_um
        x = self.rays.middle_x[pixel] - self.x[place]
        y = self.rays.middle_y[pixel] - self.y[place]
        self.middle_u = (x * self.cos[place] + y * self.sin[place]) >> 15
        self.middle_v = (y * self.cos[place] - x * self.sin[place]) >> 15

    def _fall(self, place: int, pixel: int) -> None:
        """How far rays fall in a robot's axes, and between which places they begin that may meet it."""
        x = self.rays.fall_x[pixel]
        y = self.rays.fall_y[pixel]
        self.fall_u = (x * self.cos[place] + y * self.sin[place]) >> 15
        self.fall_v = (y * self.cos[place] - x * self.sin[place]) >> 15
        self.low_u[_RAYS] = self.low_u[_TOP] - max(self.fall_u, 0)
        self.high_u[_RAYS] = self.high_u[_TOP] - min(self.fall_u, 0)
        self.low_v[_RAYS] = self.low_v[_TOP] - max(self.fall_v, 0)
        self.high_v[_RAYS] = self.high_v[_TOP] - min(self.fall_v, 0)

    def _alone(self, place: int, pixel: int) -> int:
        """The samples where only one robot may be seen, by how many see what; or _UNSURE."""
        scene = self.scene
        self._turn(place, pixel)
        self.sure = True
        on_top = entered = self._within(place, pixel, _TOP)
        total = 0
        if on_top < self.samples:
            self._fall(place, pixel)
            entered = self._within(place, pixel, _RAYS)
            if entered:
                entered = self._across(place, pixel, entered)
            if entered == 0 and self.samples == 16 and self.sure:
                return scene.total[pixel]
            behind = scene.paint[pixel]
            if not self.sure or (entered < self.samples and behind == _MIXED) or scene.shows_ball(pixel):
                return _UNSURE
            if entered < self.samples:
                total = (self.samples - entered) * scene.packed[behind]
            total += (entered - on_top) * scene.packed[self.side]
        if on_top:
            team = self._within(place, pixel, _TEAM)
            identity = self._within(place, pixel, _IDENTITY) if team < on_top else 0
            body = place // _SETS
            total += team * scene.packed[self.team_paint[body]]
            total += identity * scene.packed[self.identity_paint[body]]
            total += (on_top - team - identity) * scene.packed[self.black]
        return total if self.sure else _UNSURE

    def _within(self, place: int, pixel: int, box: int) -> int:
        """How many samples lie in a rectangle."""
        low_u, high_u = self.low_u[box] - self.middle_u, self.high_u[box] - self.middle_u
        low_v, high_v = self.low_v[box] - self.middle_v, self.high_v[box] - self.middle_v
        around = self.around_um
        if low_u > around or high_u < -around or low_v > around or high_v < -around:
            return 0
        if low_u <= -around and high_u >= around and low_v <= -around and high_v >= around:
            return self.samples
        return self._count(place, pixel, low_u - 1, high_u + 1, low_v - 1, high_v + 1)

    def _count(self, place: int, pixel: int, low_u: int, high_u: int, low_v: int, high_v: int) -> int:
        """How many samples lie between these distances from the middle."""
        if not self.sampled:
            self._sample(place, pixel)
        within = 0
        for sample in range(16):
            inside_u = (self.u[sample] > low_u) & (self.u[sample] < high_u)
            within += inside_u & (self.v[sample] > low_v) & (self.v[sample] < high_v)
        return within

    def _across(self, place: int, pixel: int, within: int) -> int:
        """How many of the samples between the right places see any of a robot: as `_enters`."""
        fall_u, fall_v = self.fall_u, self.fall_v
        reach = abs(fall_u) + abs(fall_v)
        middle = self.middle_u * fall_v - self.middle_v * fall_u
        low, high = -_HALF_UM * reach - middle, _HALF_UM * reach - middle
        around = self.around_um * reach
        if low > around or high < -around:
            return 0
        if low <= -around and high >= around:
            return within
        if not self.sampled:
            self._sample(place, pixel)
        low_u, high_u = self.low_u[_RAYS] - self.middle_u, self.high_u[_RAYS] - self.middle_u
        low_v, high_v = self.low_v[_RAYS] - self.middle_v, self.high_v[_RAYS] - self.middle_v
        entered = 0
        for sample in range(16):
            u, v = self.u[sample], self.v[sample]
            if low_u <= u <= high_u and low_v <= v <= high_v and low <= u * fall_v - v * fall_u <= high:
                entered += 1
        return entered

    def _sample(self, place: int, pixel: int) -> None:
        """How far samples lie from the middle in a robot's axes; those of the other field lie far away."""
        self.sampled = True
        if self.more_um:
            self.sure = False
            return
        if self.cornered != pixel:
            self._find_corners(pixel)
        u, v = self.corner_u, self.corner_v
        cosine, sine = self.cos[place], self.sin[place]
        for corner in range(4):
            x = self.top_x[corner] - self.x[place]
            y = self.top_y[corner] - self.y[place]
            u[corner] = ((x * cosine + y * sine) >> 15) - self.middle_u
            v[corner] = ((y * cosine - x * sine) >> 15) - self.middle_v
        self._spread(self.u, u[0], u[1], u[2], u[3])
        self._spread(self.v, v[0], v[1], v[2], v[3])
        if self.samples < 16:
            for column in range(8):
                self.u[8 - self.first + column] = _FAR_UM

    def _spread(self, samples: list[int], a: int, b: int, c: int, d: int) -> None:
        """Sixteen samples, row by row, between corners: a b above, c d below; as `rays.between`."""
        twist = a - b - c + d
        for column in range(4):
            p = 2 * column + 1
            at = 64 * a + 8 * p * (b - a)
            by = 8 * (c - a) + p * twist
            samples[column] = (at + by) >> 6
            samples[4 + column] = (at + 3 * by) >> 6
            samples[8 + column] = (at + 5 * by) >> 6
            samples[12 + column] = (at + 7 * by) >> 6

    def _find_corners(self, pixel: int) -> None:
        """Where the pixel's corners are at the height of the tops; corners in rows: two above, two below."""
        first = pixel // _WIDTH * _CORNERS + pixel % _WIDTH
        for corner in range(4):
            ray = first + (corner >> 1) * _CORNERS + (corner & 1)
            self.top_x[corner] = self.rays.top_x(ray)
            self.top_y[corner] = self.rays.top_y(ray)
        self.cornered = pixel

    def _samples(self, pixel: int) -> int:
        """The samples of a pixel at one instant, one by one."""
        scene = self.scene
        behind = scene.paint[pixel]
        ball_seen = scene.shows_ball(pixel)
        for sample in range(self.first, self.first + self.samples):
            self.seen[sample] = _OUT
            self.height_um[sample] = -1
        for index in range(self.seer_count):
            self._see(self.seers[index], pixel)
        total = 0
        for sample in range(self.first, self.first + self.samples):
            paint = self.seen[sample]
            if paint == _OUT:
                paint = behind if behind != _MIXED else scene.sample(pixel, sample)
            elif ball_seen and self.height_um[sample] < _TOP_UM:
                ball = scene.ball_above(pixel, sample, self.height_um[sample])
                paint = ball if ball >= 0 else paint
            total += scene.packed[paint]
        return total

    def _see(self, place: int, pixel: int) -> None:
        """What samples see of one robot, where it is higher than what they have seen."""
        self._turn(place, pixel)
        self._fall(place, pixel)
        if self._within(place, pixel, _RAYS) == 0:
            return
        self._sample(place, pixel)
        for sample in range(self.first, self.first + self.samples):
            if self.height_um[sample] == _TOP_UM:
                continue
            u, v = self.middle_u + self.u[sample], self.middle_v + self.v[sample]
            if -_HALF_UM <= u <= _HALF_UM and -_HALF_UM <= v <= _HALF_UM:
                self.seen[sample] = self._top(place // _SETS, u, v)
                self.height_um[sample] = _TOP_UM
            elif _enters(u, v, self.fall_u, self.fall_v):
                height = _entry(u, v, self.fall_u, self.fall_v)
                if height > self.height_um[sample]:
                    self.seen[sample] = self.side
                    self.height_um[sample] = height

    def _top(self, body: int, u: int, v: int) -> int:
        """The paint of a place on the top."""
        if self.low_u[_TEAM] <= u <= self.high_u[_TEAM] and self.low_v[_TEAM] <= v <= self.high_v[_TEAM]:
            return self.team_paint[body]
        if self.low_u[_IDENTITY] <= u <= self.high_u[_IDENTITY]:
            if self.low_v[_IDENTITY] <= v <= self.high_v[_IDENTITY]:
                return self.identity_paint[body]
        return self.black


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
