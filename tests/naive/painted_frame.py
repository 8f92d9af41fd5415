"""Pictures of robots' tops by plain supersampling: what the tracker is measured with.

Every pixel has 4 x 4 samples; each is traced to the plane of the tops.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import IDENTITIES, PATCH_MM, PATTERNS, ROBOT_HALF_MM, ROBOT_HEIGHT_M

SAMPLES = 4
PAINTS = {
    "yellow": (230, 210, 30),
    "blue": (30, 60, 220),
    "magenta": (220, 30, 140),
    "cyan": (30, 190, 220),
    "green": (20, 160, 60),
    "violet": (130, 40, 210),
    "lime": (150, 220, 40),
    "orange": (240, 110, 20),
    "floor": (15, 60, 35),
    "black": (20, 20, 20),
}
"""Red, green, blue."""
REACH = 4  # pixels: the chroma filter's half length
_NOISE = np.random.default_rng(1997).normal(size=(2 * HEIGHT, 2 * WIDTH, 3)) * (2.0, 4.0, 4.0)


def ycbcr(rgb):
    """ITU-R BT.601, full range."""
    r, g, b = rgb
    y = 0.299 * r + 0.587 * g + 0.114 * b
    return np.array([y, 128.0 + 0.564 * (b - y), 128.0 + 0.713 * (r - y)])


def low_pass():
    """0.6 MHz at 320 pixels in 52.6 us: a sinc under a Hamming window."""
    place = np.arange(-REACH, REACH + 1)
    taps = np.sinc(2 * 0.6 / 6.08 * place) * (0.54 + 0.46 * np.cos(np.pi * place / (REACH + 1)))
    return taps / taps.sum()


@cache
def samples_of(camera):
    """x and y in m, at the tops' height, of every sample of the picture with REACH more columns at each side."""
    lens = Lens(camera)
    shape = (HEIGHT * SAMPLES, (WIDTH + 2 * REACH) * SAMPLES)
    x, y = np.empty(shape), np.empty(shape)
    for row in range(shape[0]):
        for column in range(shape[1]):
            u, v = (column + 0.5) / SAMPLES - REACH, (row + 0.5) / SAMPLES
            x[row, column], y[row, column] = lens.ground(u, v, ROBOT_HEIGHT_M)
    return x, y


class PaintedRobot:
    """A top: posture, team's colour, number, pattern."""

    def __init__(self, posture, team="yellow", number=0, pattern="diagonal"):
        self.posture = posture
        self.team = team
        self.identity = IDENTITIES[number]
        self.pattern = PATTERNS[pattern]

    def paint(self, x, y, picture):
        cos, sin = np.cos(self.posture.theta_rad), np.sin(self.posture.theta_rad)
        dx, dy = 1000.0 * (x - self.posture.x_m), 1000.0 * (y - self.posture.y_m)
        ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
        for centre, half, paint in (
            ((0, 0), ROBOT_HALF_MM, "black"),
            (self.pattern.team_mm, PATCH_MM / 2, self.team),
            (self.pattern.identity_mm, PATCH_MM / 2, self.identity),
        ):
            inside = (abs(ahead - centre[0]) < half) & (abs(left - centre[1]) < half)
            picture[inside] = ycbcr(PAINTS[paint])


class PaintedFrame:
    """A `Frame` of robots. `noise`: number of the noise pattern, None for none; `chroma`: whether it is filtered."""

    width = WIDTH
    height = HEIGHT

    def __init__(
        self,
        robots: Sequence[PaintedRobot],
        camera: CameraParameters = CameraParameters(),  # noqa: B008  # it is frozen
        noise: int | None = None,
        chroma: bool = True,
        light: float = 1.0,
    ):
        self.robots = robots
        self.camera = camera
        self.noise = noise
        self.chroma = chroma
        self.light = light
        self.windows = 0

    def window(self, left, top, width, height):
        assert 0 <= left < left + width <= WIDTH
        assert 0 <= top < top + height <= HEIGHT
        self.windows += 1
        rows = slice(top * SAMPLES, (top + height) * SAMPLES)
        columns = slice(left * SAMPLES, (left + width + 2 * REACH) * SAMPLES)
        x, y = (part[rows, columns] for part in samples_of(self.camera))
        picture = np.empty((*x.shape, 3))
        picture[:] = ycbcr(PAINTS["floor"])
        for robot in self.robots:
            robot.paint(x, y, picture)
        wide = width + 2 * REACH
        pixels = picture.reshape(height, SAMPLES, wide, SAMPLES, 3).mean(axis=(1, 3)) - (0.0, 128.0, 128.0)
        found = self.light * pixels[:, REACH : REACH + width].copy()
        if self.chroma:
            found[:, :, 1:] = 0.0
            for place, tap in enumerate(low_pass()):
                found[:, :, 1:] += self.light * tap * pixels[:, place : place + width, 1:]
        found += (0.0, 128.0, 128.0)
        if self.noise is not None:
            down, right = self.noise * 37 % HEIGHT, self.noise * 101 % WIDTH
            found += _NOISE[down + top : down + top + height, right + left : right + left + width]
        return bytearray(np.clip(np.rint(found), 0, 255).astype(np.uint8).tobytes())


def sampled(count=60, noise=True):
    """Pixels inside patches of each colour, and of the floor."""
    found = {}
    for place, (name, rgb) in enumerate(list(PAINTS.items())[:9]):
        pixels = ycbcr(rgb) + (_NOISE[place, :count] if noise else np.zeros((count, 3)))
        found[name] = [tuple(int(part) for part in pixel) for pixel in np.clip(np.rint(pixels), 0, 255)]
    return found
