"""The camera: robots and the scene behind them, sampled into windows of a picture.

A pixel is 4 x 4 samples for each instant of the exposure. A sample's ray falls from the height of the robots' tops to
the floor; in a robot's axes that is a straight line from `top` on by `fall`:

    top of a robot     the line begins inside its square: nothing is higher, so nothing hides it
    side of a robot    the line enters the square on its way down
    else               the scene without robots, unless the ball hides the side

Of several sides the highest is seen; where robots stand in
each other, the first one is. All in um and integers. `fall` is taken at the middle of the pixel.

A pixel whose samples are sure to see one paint is not sampled: if its middle sees that paint, and would still do so if
all edges were nearer by what a pixel is wide along the robot's axes (`spread_um`). So any pixel gives the same bits in
any window. One test does for all instants of the exposure if its edges are nearer by as much more as the robot moves
between them (`margin_um`).
"""

from __future__ import annotations

import math

from miro_exact.dmath import sincos
from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.patterns import IDENTITIES, PATCH_MM, TEAMS, Pattern
from miro_sim.pitch.paints import NUMBERS
from miro_sim.pitch.picture_settings import PictureSettings
from miro_sim.pitch.rays import Rays, between, rays_of
from miro_sim.pitch.scene import Scene, scene_of
from miro_sim.pitch.sensor import Sensor

MOST_ROBOTS = 10
FIELD_S = 1001.0 / 60000.0
_SETS = 6  # at most: two fields of three instants
_HALF_UM = 37_500
_TOP_UM = 75_000
_CORNER_UM = 53_034  # from the middle of a robot's top to its corner, rounded up
_NEAR_UM = (
    75_000  # no place within the square of a robot, widened by the largest margin, is further along an axis
)
_MOST_MARGIN_UM = 12_500
_OUT = -1
_UNSURE = -2
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
        *("field_sets", "side", "black", "team_u", "team_v", "identity_u", "identity_v", "patch_um"),
        *(
            "robots",
            "team_paint",
            "identity_paint",
            "x",
            "y",
            "cos",
            "sin",
            "spread_um",
            "near",
            "near_count",
        ),
        *("moving", "code", "seen", "height_um", "least_x", "most_x", "least_y", "most_y", "margin_um"),
        *("still", "count", "corner_u", "corner_v", "top_x", "top_y", "cornered", "fall_u", "fall_v", "seer"),
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
        self.team_u, self.team_v = (1000 * part for part in pattern.team_mm)
        self.identity_u, self.identity_v = (1000 * part for part in pattern.identity_mm)
        self.patch_um = 500 * PATCH_MM
        self.robots = 0
        self.team_paint = [0] * 10
        self.identity_paint = [0] * 10
        self.x = [0] * 60
        self.y = [0] * 60
        self.cos = [0] * 60
        self.sin = [0] * 60
        self.spread_um = [0] * 60
        self.near = [0] * 10
        self.near_count = 0
        self.code = [0] * 60
        self.least_x = [0] * 10
        self.most_x = [0] * 10
        self.least_y = [0] * 10
        self.most_y = [0] * 10
        self.margin_um = [0] * 10
        self.still = [0] * 10
        self.moving = False
        self.seen = [0] * 16
        self.height_um = [0] * 16
        self.corner_u = [0] * 40
        self.corner_v = [0] * 40
        self.top_x = [0] * 4
        self.top_y = [0] * 4
        self.cornered = -1
        self.fall_u = [0] * 10
        self.fall_v = [0] * 10
        self.seer = [0] * 10
        self.count = 0

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
        """Between which places a pixel's middle may see a robot at any instant, and what margin does for all of them.

        A place within the square lies elsewhere in it at another instant, but by no more than the robot's way, plus
        its turn times the distance from the middle, plus 4 um for what is rounded. No margin (0) if that is too much.
        """
        first = body * _SETS
        middle = first + self.sets // 2
        drift = way_x = way_y = 0
        for place in range(first, first + self.sets):
            x, y = abs(self.x[place] - self.x[middle]), abs(self.y[place] - self.y[middle])
            turn = abs(self.cos[place] - self.cos[middle]) + abs(self.sin[place] - self.sin[middle])
            drift = max(drift, x + y + (_NEAR_UM * turn >> 15))
            way_x, way_y = max(way_x, x), max(way_y, y)
        far = _CORNER_UM + self.rays.spread_um
        self.least_x[body], self.most_x[body] = self.x[middle] - way_x - far, self.x[middle] + way_x + far
        self.least_y[body], self.most_y[body] = self.y[middle] - way_y - far, self.y[middle] + way_y + far
        margin = self.spread_um[middle] + drift + 4
        self.margin_um[body] = margin if margin <= _MOST_MARGIN_UM else 0
        self.still[body] = drift == 0

    def begin(self, frame: int, tick: int) -> None:
        """Takes frame number `frame` (below 2^24) of what stands there now; `tick`: the middle of the exposure."""
        self.sensor.begin(frame, tick, 16 * self.field_sets)

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """A window's pixels: see `miro_host.eye.frame`. Raises ValueError for one that is not inside the picture."""
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
        self.moving = False
        x = self.rays.middle_x[pixel]
        y = self.rays.middle_y[pixel]
        for body in range(self.robots):
            if self.least_x[body] - reach <= x <= self.most_x[body] + reach:
                if self.least_y[body] - reach <= y <= self.most_y[body] + reach:
                    self.near[self.near_count] = body
                    self.near_count += 1
                    self.moving = self.moving or not self.still[body]

    def _draw_robots(self, row: int, first: int, end: int) -> None:
        """Those pixels of a line in which a robot is seen."""
        middle_x, middle_y = self.rays.middle_x, self.rays.middle_y
        fall_x, fall_y = self.rays.fall_x, self.rays.fall_y
        for column in range(first, end):
            pixel = row * _WIDTH + column
            x, y = middle_x[pixel], middle_y[pixel]
            end_x, end_y = x + fall_x[pixel], y + fall_y[pixel]
            for index in range(self.near_count):
                if self._passes(self.near[index], x, y, end_x, end_y):
                    total = self._total(pixel, x, y, end_x, end_y)
                    if total >= 0:
                        self.sensor.put(column, total, self.scene.light(pixel))
                    break

    def _total(self, pixel: int, x: int, y: int, end_x: int, end_y: int) -> int:
        """The paints of all samples of a pixel, added; -1 if none is a robot's."""
        seen = False
        for index in range(self.near_count):
            body = self.near[index]
            common = _OUT
            if self._passes(body, x, y, end_x, end_y):
                margin = self.margin_um[body]
                common = self._code(body, self.sets // 2, pixel, margin) if margin else _UNSURE
            for at in range(self.sets):
                code = common
                if common == _UNSURE and not self.still[body]:
                    code = self._code(body, at, pixel, self.spread_um[body * _SETS + at])
                self.code[index * _SETS + at] = code
                if code != _OUT:
                    seen = True
        if not seen:
            return -1
        total = part = 0
        for at in range(self.sets):
            if self.moving or at % self.field_sets == 0:
                part = self._instant(pixel, at)
            total += part
        return total

    def _instant(self, pixel: int, at: int) -> int:
        """The samples of one instant: all 16, or the 8 of its field."""
        samples = 16 if self.sets == self.field_sets else 8
        paint = _OUT
        for index in range(self.near_count):
            code = self.code[index * _SETS + at]
            if code >= 0 and code != self.side and paint == _OUT:  # a top: nothing hides it
                return self.scene.packed[code] * samples
            if code != _OUT:
                paint = code if paint == _OUT else _UNSURE
        if paint >= 0 and not self.scene.shows_ball(pixel):
            return self.scene.packed[paint] * samples
        if paint == _OUT and samples == 16:
            return self.scene.total[pixel]
        return self._samples(pixel, at)

    def _passes(self, body: int, x: int, y: int, end_x: int, end_y: int) -> bool:
        """Whether lines from (x, y) to the end may meet a robot at any instant, looked at along each axis alone."""
        least, most = self.least_x[body], self.most_x[body]
        if (x < least and end_x < least) or (x > most and end_x > most):
            return False
        least, most = self.least_y[body], self.most_y[body]
        return not ((y < least and end_y < least) or (y > most and end_y > most))

    def _code(self, body: int, at: int, pixel: int, spread: int) -> int:
        """The one paint of a robot seen from a pixel's middle and `spread` around it, or _OUT, or _UNSURE."""
        place = body * _SETS + at
        x = self.rays.middle_x[pixel] - self.x[place]
        y = self.rays.middle_y[pixel] - self.y[place]
        u = (x * self.cos[place] + y * self.sin[place]) >> 15
        v = (y * self.cos[place] - x * self.sin[place]) >> 15
        away = max(abs(u), abs(v))
        if away <= _HALF_UM - spread:
            return self._sure_top(body, u, v, spread)
        x = self.rays.fall_x[pixel]
        y = self.rays.fall_y[pixel]
        fall_u = (x * self.cos[place] + y * self.sin[place]) >> 15
        fall_v = (y * self.cos[place] - x * self.sin[place]) >> 15
        if not _enters(u, v, fall_u, fall_v, _HALF_UM + spread):
            return _OUT
        if away > _HALF_UM + spread and _enters(u, v, fall_u, fall_v, _HALF_UM - spread):
            return self.side
        return _UNSURE

    def _sure_top(self, body: int, u: int, v: int, spread: int) -> int:
        """The one paint around a place on the top, or _UNSURE."""
        away = max(abs(u - self.team_u), abs(v - self.team_v)) - self.patch_um
        if away <= 0 - spread:
            return self.team_paint[body]
        other = max(abs(u - self.identity_u), abs(v - self.identity_v)) - self.patch_um
        if other <= 0 - spread:
            return self.identity_paint[body]
        return self.black if away > spread and other > spread else _UNSURE

    def _top(self, body: int, u: int, v: int) -> int:
        """The paint of a place on the top."""
        if max(abs(u - self.team_u), abs(v - self.team_v)) <= self.patch_um:
            return self.team_paint[body]
        if max(abs(u - self.identity_u), abs(v - self.identity_v)) <= self.patch_um:
            return self.identity_paint[body]
        return self.black

    def _samples(self, pixel: int, at: int) -> int:
        """The samples of a pixel at one instant, one by one."""
        first, end = 0, 16
        if self.sets != self.field_sets:
            first = 8 * (at // self.field_sets)
            end = first + 8
        scene = self.scene
        behind = scene.paint[pixel]
        ball_seen = scene.shows_ball(pixel)
        if self.cornered != pixel:
            self._find_corners(pixel)
        self.count = 0
        for index in range(self.near_count):
            if self.code[index * _SETS + at] != _OUT:
                self._turn(self.near[index], at, pixel)
        if self.count == 1 and behind != _MIXED and not ball_seen:
            return self._alone(scene.packed[behind], first, end)
        for sample in range(first, end):
            self.seen[sample] = _OUT
            self.height_um[sample] = -1
        for slot in range(self.count):
            self._see(slot, first, end)
        total = 0
        for sample in range(first, end):
            paint = self.seen[sample]
            if paint == _OUT:
                paint = behind if behind != _MIXED else scene.sample(pixel, sample)
            elif ball_seen and self.height_um[sample] < _TOP_UM:
                ball = scene.ball_above(pixel, sample, self.height_um[sample])
                paint = ball if ball >= 0 else paint
            total += scene.packed[paint]
        return total

    def _turn(self, body: int, at: int, pixel: int) -> None:
        """The pixel's corners and its fall in the axes of one more robot; corners in rows: a b above, c d below."""
        place = body * _SETS + at
        cosine, sine = self.cos[place], self.sin[place]
        slot = self.count
        for corner in range(4):
            x = self.top_x[corner] - self.x[place]
            y = self.top_y[corner] - self.y[place]
            self.corner_u[4 * slot + corner] = (x * cosine + y * sine) >> 15
            self.corner_v[4 * slot + corner] = (y * cosine - x * sine) >> 15
        x = self.rays.fall_x[pixel]
        y = self.rays.fall_y[pixel]
        self.fall_u[slot] = (x * cosine + y * sine) >> 15
        self.fall_v[slot] = (y * cosine - x * sine) >> 15
        self.seer[slot] = body
        self.count = slot + 1

    def _find_corners(self, pixel: int) -> None:
        """Where the pixel's corners are at the height of the tops."""
        first = pixel // _WIDTH * _CORNERS + pixel % _WIDTH
        for corner in range(4):
            ray = first + (corner >> 1) * _CORNERS + (corner & 1)
            self.top_x[corner] = self.rays.top_x(ray)
            self.top_y[corner] = self.rays.top_y(ray)
        self.cornered = pixel

    def _alone(self, behind: int, first: int, end: int) -> int:
        """The samples where only one robot may be seen, before one paint: as `_see`, but nothing is compared."""
        body = self.seer[0]
        fall_u, fall_v = self.fall_u[0], self.fall_v[0]
        top, side = self.scene.packed[self.black], self.scene.packed[self.side]
        team = self.scene.packed[self.team_paint[body]]
        identity = self.scene.packed[self.identity_paint[body]]
        # `_enters`, with what is the same for all samples worked out before
        least_u, most_u = -_HALF_UM - max(fall_u, 0), _HALF_UM - min(fall_u, 0)
        least_v, most_v = -_HALF_UM - max(fall_v, 0), _HALF_UM - min(fall_v, 0)
        most = _HALF_UM * (abs(fall_u) + abs(fall_v))
        team_u, team_v, identity_u, identity_v = self.team_u, self.team_v, self.identity_u, self.identity_v
        patch = self.patch_um
        total = 0
        for row in range(first >> 2, end >> 2):
            q = 2 * row + 1
            u = self.corner_u[0] * (8 - q) + self.corner_u[2] * q
            v = self.corner_v[0] * (8 - q) + self.corner_v[2] * q
            step_u = self.corner_u[1] * (8 - q) + self.corner_u[3] * q - u
            step_v = self.corner_v[1] * (8 - q) + self.corner_v[3] * q - v
            u = 8 * u + step_u
            v = 8 * v + step_v
            for _ in range(4):
                at_u = u >> 6
                at_v = v >> 6
                u += 2 * step_u
                v += 2 * step_v
                if -_HALF_UM <= at_u <= _HALF_UM and -_HALF_UM <= at_v <= _HALF_UM:
                    if -patch <= at_u - team_u <= patch and -patch <= at_v - team_v <= patch:
                        total += team
                    elif -patch <= at_u - identity_u <= patch and -patch <= at_v - identity_v <= patch:
                        total += identity
                    else:
                        total += top
                elif at_u < least_u or at_u > most_u or at_v < least_v or at_v > most_v:
                    total += behind
                elif -most <= at_u * fall_v - at_v * fall_u <= most:
                    total += side
                else:
                    total += behind
        return total

    def _see(self, slot: int, first: int, end: int) -> None:
        """What samples see of one robot, where it is higher than what they have seen."""
        body = self.seer[slot]
        fall_u, fall_v = self.fall_u[slot], self.fall_v[slot]
        for sample in range(first, end):
            if self.height_um[sample] == _TOP_UM:
                continue
            a = 4 * slot
            u = between(
                self.corner_u[a], self.corner_u[a + 1], self.corner_u[a + 2], self.corner_u[a + 3], sample
            )
            v = between(
                self.corner_v[a], self.corner_v[a + 1], self.corner_v[a + 2], self.corner_v[a + 3], sample
            )
            if -_HALF_UM <= u <= _HALF_UM and -_HALF_UM <= v <= _HALF_UM:
                self.seen[sample] = self._top(body, u, v)
                self.height_um[sample] = _TOP_UM
            elif _enters(u, v, fall_u, fall_v, _HALF_UM):
                height = _entry(u, v, fall_u, fall_v)
                if height > self.height_um[sample]:
                    self.seen[sample] = self.side
                    self.height_um[sample] = height


def _um(metres: float) -> int:
    return math.floor(metres * 1e6 + 0.5)


def _enters(u: int, v: int, fall_u: int, fall_v: int, half: int) -> bool:
    """Whether the line from (u, v) on by the fall meets the square of `half` around the origin (separating axes)."""
    if (u < -half and u + fall_u < -half) or (u > half and u + fall_u > half):
        return False  # both ends are beyond one side
    if (v < -half and v + fall_v < -half) or (v > half and v + fall_v > half):
        return False
    most = half * (abs(fall_u) + abs(fall_v))
    return -most <= u * fall_v - v * fall_u <= most


def _entry(u: int, v: int, fall_u: int, fall_v: int) -> int:
    """The height at which such a line, which begins outside the square of a robot, enters it."""
    latest = 0
    if abs(u) > _HALF_UM and fall_u != 0:
        latest = (abs(u) - _HALF_UM << 16) // abs(fall_u)
    if abs(v) > _HALF_UM and fall_v != 0:
        latest = max(latest, (abs(v) - _HALF_UM << 16) // abs(fall_v))
    return _TOP_UM - (_TOP_UM * latest >> 16)
