"""Slow, obvious twin of the camera: every pixel of a window from all of its samples, no shortcut.

Arrays hold all samples of a window at once: [row, column, sample row, sample column].
"""

import hashlib
import math
from typing import NamedTuple

import numpy as np

from miro_exact.dmath import sincos
from miro_exact.rng import philox4x32
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import IDENTITIES, TEAMS
from miro_sim.pitch import sensor as ours
from miro_sim.pitch.paints import BLACK_FLOOR, NUMBERS, PAINTS


class Body(NamedTuple):
    """A robot as it stands at the middle of the first exposure, and how it moves."""

    team: int
    identity: int
    x_m: float
    y_m: float
    theta_rad: float
    v_m_s: float = 0.0
    w_rad_s: float = 0.0


def um(metres):
    return math.floor(metres * 1e6 + 0.5)


class NaiveCamera:
    """The same arguments as the camera, and `bodies` and `ball` (x_m, y_m) for the scene."""

    def __init__(self, parameters, settings, pattern, stream):
        self.parameters = parameters
        self.lens = Lens(parameters)
        self.settings = settings
        self.pattern = pattern
        self.stream = stream
        self.bodies = []
        self.ball = None

    def window(self, left, top, width, height, frame, tick):
        """The bytes of a window."""
        reach = len(ours._taps(self.settings.chroma_bandwidth_hz)) - 1
        first, end = max(0, left - reach - 1), min(320, left + width + reach + 1)
        slope_x, slope_y = self._slopes(first, top, end - first, height)
        totals = np.zeros((height, end - first, 3), np.int64)
        instants = self.settings.sub_exposures
        for field in range(self.settings.fields):
            rows = slice(0, 4) if self.settings.fields == 1 else (slice(0, 2) if field == 0 else slice(2, 4))
            falls = self._falls(slope_x, slope_y)
            for instant in range(instants):
                paints = self._seen(slope_x[:, :, rows], slope_y[:, :, rows], falls, field, instant)
                totals += self._colours()[paints].sum(axis=(2, 3))
        shown = self._shown(totals, self._light(slope_x, slope_y, first, top), tick, 16 * instants)
        return self._written(shown, first, left, top, width, height, frame, reach)

    def _slopes(self, left, top, width, height):
        corners = np.zeros((2, height + 1, width + 1), np.int64)
        for j in range(height + 1):
            for i in range(width + 1):
                self.lens.slopes(float(left + i), float(top + j))
                corners[0, j, i] = math.floor(self.lens.out_x * 4194304.0 + 0.5)
                corners[1, j, i] = math.floor(self.lens.out_y * 4194304.0 + 0.5)
        self.corners = corners
        return between(corners[0]), between(corners[1])

    def _falls(self, slope_x, slope_y):
        """From the tops to the floor, at the middle of each pixel."""
        c = self.corners
        summed = c[:, :-1, :-1] + c[:, :-1, 1:] + c[:, 1:, :-1] + c[:, 1:, 1:]
        falls = 75_000 * summed >> 24
        return falls[0][:, :, None, None], falls[1][:, :, None, None]

    def _tops(self, corners, camera_um):
        return camera_um + ((um(self.parameters.height_m) - 75_000) * corners >> 22)

    def _seen(self, slope_x, slope_y, falls, field, instant):
        """The paint of each sample: the highest thing that its ray hits."""
        rows = slice(0, 4) if self.settings.fields == 1 else slice(2 * field, 2 * field + 2)
        paint = self._still(slope_x, slope_y)
        ball_height, ring = self._ball(slope_x, slope_y)
        paint = np.where(ring >= 0, NUMBERS["ball rim"] + ring, paint)
        height = ball_height
        top_x = self._tops(self.corners[0], um(self.parameters.x_m))
        top_y = self._tops(self.corners[1], um(self.parameters.y_m))
        for body in self.bodies:
            x, y, cosine, sine = self._stands(body, field, instant)
            u = between(((top_x - x) * cosine + (top_y - y) * sine) >> 15)[:, :, rows]
            v = between(((top_y - y) * cosine - (top_x - x) * sine) >> 15)[:, :, rows]
            fall_u = (falls[0] * cosine + falls[1] * sine) >> 15
            fall_v = (falls[1] * cosine - falls[0] * sine) >> 15
            on_top = (np.maximum(abs(u), abs(v)) <= 37_500) & (
                height < 75_000
            )  # the first robot's, if two overlap
            entry = entries(u, v, fall_u, fall_v)
            side = ~on_top & meets(u, v, fall_u, fall_v) & (entry > height)
            paint = np.where(side, NUMBERS["side"], paint)
            height = np.where(side, entry, height)
            paint = np.where(on_top, self._top(body, u, v), paint)
            height = np.where(on_top, 75_000, height)
        return paint

    def _stands(self, body, field, instant):
        instants = self.settings.sub_exposures
        share = (instant * 2 + 1) / (2.0 * instants) - 0.5
        field_s = (field - 0.5 * (self.settings.fields - 1)) * (1001.0 / 60000.0)
        after_s = field_s + share * self.settings.exposure_s
        sine, cosine = sincos(body.theta_rad + 0.5 * body.w_rad_s * after_s)
        way_m = body.v_m_s * after_s
        x, y = um(body.x_m + way_m * cosine), um(body.y_m + way_m * sine)
        sine, cosine = sincos(body.theta_rad + body.w_rad_s * after_s)
        return x, y, math.floor(cosine * 32768.0 + 0.5), math.floor(sine * 32768.0 + 0.5)

    def _top(self, body, u, v):
        team_u, team_v = self.pattern.team_mm
        own_u, own_v = self.pattern.identity_mm
        team = np.maximum(abs(u - 1000 * team_u), abs(v - 1000 * team_v)) <= 17_500
        own = np.maximum(abs(u - 1000 * own_u), abs(v - 1000 * own_v)) <= 17_500
        paint = np.where(own, NUMBERS[IDENTITIES[body.identity]], NUMBERS["top"])
        return np.where(team, NUMBERS[TEAMS[body.team]], paint)

    def _at(self, slope, camera_um, height_um):
        return camera_um + ((um(self.parameters.height_m) - height_um) * slope >> 22)

    def _still(self, slope_x, slope_y):
        """Walls and floor."""
        camera_x, camera_y = um(self.parameters.x_m), um(self.parameters.y_m)
        x, y = (
            abs(self._at(slope_x, camera_x, 50_000) - 550_000),
            abs(self._at(slope_y, camera_y, 50_000) - 350_000),
        )
        over = inside(x, y)
        ring = ((x <= 675_000) & (y <= 475_000)) | ((x <= 825_000) & (y <= 225_000))
        x, y = (abs(self._at(slope_x, camera_x, 0) - 550_000), abs(self._at(slope_y, camera_y, 0) - 350_000))
        paint = np.where(on_line(x, y), NUMBERS["line"], NUMBERS["floor"])
        paint = np.where(inside(x, y), paint, NUMBERS["wall face"])
        return np.where(over, paint, np.where(ring, NUMBERS["wall top"], NUMBERS["outside"]))

    def _ball(self, slope_x, slope_y):
        """Height at which it is seen, and its ring; -1 where it is not."""
        nowhere = np.full(slope_x.shape, -1, np.int64)
        if self.ball is None:
            return nowhere, nowhere
        radius = 21_350
        x = self._at(slope_x, um(self.parameters.x_m), radius) - um(self.ball[0])
        y = self._at(slope_y, um(self.parameters.y_m), radius) - um(self.ball[1])
        near = np.maximum(abs(x), abs(y)) <= 2 * radius
        x, y = np.where(near, x, 2 * radius), np.where(near, y, 2 * radius)
        s, t = slope_x >> 10, slope_y >> 10
        along = x * s + y * t
        stretch = (1 << 24) + s * s + t * t
        distance = (x * x + y * y) * stretch - along * along
        rim = radius * radius * stretch
        ring = np.where(distance > 0, 3 - 4 * (distance - 1) // rim, 3)
        hit = near & (distance <= rim)
        height = radius - (along << 12) // stretch
        return np.where(hit, height, -1), np.where(hit, ring, -1)

    def _colours(self):
        paints = {**PAINTS, "floor": BLACK_FLOOR} if self.settings.black_floor else PAINTS
        return np.array([[4095 * part // 1000 for part in paint] for paint in paints.values()], np.int64)

    def _light(self, slope_x, slope_y, left, top):
        """Of each pixel, times 4096."""
        far = 625e9
        falloff = math.floor(self.settings.light_falloff * 4096.0 * 4503599627370496.0 / far + 0.5)
        x = self._tops(self.corners[0], um(self.parameters.x_m))
        y = self._tops(self.corners[1], um(self.parameters.y_m))
        x = ((x[:-1, :-1] + x[:-1, 1:] + x[1:, :-1] + x[1:, 1:] + 2) >> 2) - 550_000
        y = ((y[:-1, :-1] + y[:-1, 1:] + y[1:, :-1] + y[1:, 1:] + 2) >> 2) - 350_000
        return np.maximum(0, 4096 - ((x * x + y * y >> 20) * falloff >> 32))

    def _shown(self, totals, light, tick, samples):
        """Y, Cb, Cr with four fraction bits."""
        settings = self.settings
        turns = settings.exposure_s * 2 * settings.mains_hz
        phase = float(tick * 2 * settings.mains_hz % 24_000_000) / 24_000_000
        sine_end, _ = sincos(6.283185307179586 * (phase + 0.5 * turns))
        sine_begin, cosine = sincos(6.283185307179586 * (phase - 0.5 * turns))
        mean = (sine_end - sine_begin) / (6.283185307179586 * turns) if turns > 1e-6 else cosine
        lamps = 1.0 + settings.flicker * mean
        scale = math.floor(settings.gain * lamps / samples * 16777216.0 + 0.5)
        value = ((totals * light[:, :, None] >> 12) * scale >> 24) + math.floor(
            settings.offset * 4095.0 + 0.5
        )
        gamma = np.array(gamma_table(settings), np.int64)
        red, green, blue = np.moveaxis(gamma[np.minimum(value, 4095)], 2, 0)
        return np.stack(
            [
                (77 * red + 150 * green + 29 * blue + 128) >> 8,
                2048 + ((-43 * red - 85 * green + 128 * blue + 128) >> 8),
                2048 + ((128 * red - 107 * green - 21 * blue + 128) >> 8),
            ],
            2,
        )

    def _written(self, shown, first, left, top, width, height, frame, reach):
        settings = self.settings
        taps = ours._taps(settings.chroma_bandwidth_hz)
        normals = ours._normals()
        luma = [math.floor(normal * settings.luma_noise / 4096.0 + 0.5) for normal in normals]
        chroma = [math.floor(normal * settings.chroma_noise / 4096.0 + 0.5) for normal in normals]
        jitter = math.floor(settings.line_jitter_px * 256.0 + 0.5)
        out = bytearray()
        for row in range(top, top + height):
            line = [[int(value) for value in shown[row - top, :, part]] for part in range(3)]
            at = {part: {first + k: value for k, value in enumerate(line[part])} for part in range(3)}
            if jitter:
                words = self._words(frame * 32768 + 240 * 107 + row // 4)
                by = ((words[row % 4] >> 16) * (2 * jitter + 1) >> 16) - jitter
                at = {part: moved(at[part], by) for part in range(3)}
            for column in range(left, left + width):
                words = self._words(frame * 32768 + row * 107 + column // 3)
                part = column % 3
                draws = (
                    words[part] & 4095,
                    words[part] >> 12 & 4095,
                    words[part] >> 24 | (words[3] >> 4 * part & 15) << 8,
                )
                y = at[0][column] + luma[draws[0]]
                cb = filtered(at[1], column, taps) + chroma[draws[1]]
                cr = filtered(at[2], column, taps) + chroma[draws[2]]
                out += bytes(quantised(value, settings.bits) for value in (y, cb, cr))
        return out

    def _words(self, block):
        s = self.stream
        tag = hashlib.sha256(s.name.encode()).digest()
        names = int.from_bytes(tag[0:4], "little"), int.from_bytes(tag[4:8], "little")
        return philox4x32(block & 0xFFFFFFFF, block >> 32, *names, s.seed & 0xFFFFFFFF, s.seed >> 32)


def between(corners):
    """The samples of all pixels between their corners: [row, column, sample row, sample column]."""
    p = np.array([1, 3, 5, 7], np.int64)[None, None, None, :]
    q = np.array([1, 3, 5, 7], np.int64)[None, None, :, None]
    a, b, c, d = (
        part[:, :, None, None]
        for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:])
    )
    found = ((a * (8 - q) + c * q) * (8 - p) + (b * (8 - q) + d * q) * p) >> 6
    return found


def meets(u, v, fall_u, fall_v):
    """Whether the line from (u, v) on by the fall meets the robot's square."""
    half = 37_500
    middle_u, middle_v = 2 * u + fall_u, 2 * v + fall_v
    return (
        (abs(middle_u) <= 2 * half + abs(fall_u))
        & (abs(middle_v) <= 2 * half + abs(fall_v))
        & (abs(middle_u * fall_v - middle_v * fall_u) <= 2 * half * (abs(fall_u) + abs(fall_v)))
    )


def entries(u, v, fall_u, fall_v):
    """The height at which it enters the square, where it does."""
    t_u = np.where(
        (abs(u) > 37_500) & (fall_u != 0), (abs(u) - 37_500 << 16) // np.maximum(abs(fall_u), 1), 0
    )
    t_v = np.where(
        (abs(v) > 37_500) & (fall_v != 0), (abs(v) - 37_500 << 16) // np.maximum(abs(fall_v), 1), 0
    )
    return 75_000 - (75_000 * np.maximum(t_u, t_v) >> 16)


def inside(x, y):
    """Between the walls or in a goal; distances from the middle of the pitch."""
    field = (x <= 650_000) & (y <= 450_000) & (x + y <= 650_000 + 450_000 - 70_000)
    return field | ((y <= 200_000) & (x <= 800_000))


def on_line(x, y):
    """Middle line, circle, goal line and goal area."""
    square = x * x + y * y
    circle = (square >= 248_500**2) & (square <= 251_500**2)
    depth = 650_000 - x
    goal = (y <= 200_000) & (abs(depth) <= 1_500)
    front = (abs(depth - 150_000) <= 1_500) & (y <= 251_500)
    flank = (abs(y - 250_000) <= 1_500) & (depth >= 0) & (depth <= 150_000)
    return (x <= 1_500) | circle | goal | front | flank


def gamma_table(settings):
    """What each of 4096 brightnesses is shown as, with four fraction bits."""
    from miro_exact.dmath import exp, log

    return [0] + [
        math.floor(4080.0 * exp(settings.gamma * log(value / 4095.0)) + 0.5) for value in range(1, 4096)
    ]


def moved(line, by):
    """A line moved by `by`/256 pixels: each value becomes that from so far to its right."""
    if by >= 0:
        return {k: v + ((line.get(k + 1, v) - v) * by >> 8) for k, v in line.items()}
    return {k: v + ((line.get(k - 1, v) - v) * -by >> 8) for k, v in line.items()}


def filtered(line, column, taps):
    """The low-pass; beyond the picture the line goes on as at its border."""
    total = line[column] * taps[0]
    for step, tap in enumerate(taps[1:], 1):
        total += (line[max(column - step, 0)] + line[min(column + step, 319)]) * tap
    return total >> 16


def quantised(value, bits):
    value = min(max((value + 8) >> 4, 0), 255)
    lost = 8 - bits
    return (value >> lost << lost) + ((1 << lost) >> 1)
