"""Random scenes for the camera: anywhere in the picture, crowded, at borders, with every setting."""

from typing import NamedTuple

from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import PATTERNS, Pattern
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.picture_settings import PictureSettings
from tests.naive.camera import Body, NaiveCamera

SIZES = ((32, 32), (32, 32), (8, 8), (33, 1), (1, 17), (64, 5))


class Rig(NamedTuple):
    """A camera and its settings."""

    lens: CameraParameters
    picture: PictureSettings
    pattern: Pattern
    stream: Stream

    def camera(self):
        return Camera(self.lens, self.picture, self.pattern, self.stream)

    def naive(self):
        return NaiveCamera(self.lens, self.picture, self.pattern, self.stream)


class Scene(NamedTuple):
    """What stands there, when, and the window to look at: left, top, width, height."""

    bodies: list[Body]
    ball: tuple[float, float] | None
    frame: int
    tick: int
    window: tuple[int, int, int, int]

    def put(self, camera):
        """Into the camera's view, and takes the frame."""
        camera.clear()
        if self.ball is not None:
            camera.ball(*self.ball)
        for body in self.bodies:
            camera.robot(*body)
        camera.begin(self.frame, self.tick)

    def drawn_by(self, naive):
        """The window, from the slow twin."""
        naive.bodies, naive.ball = self.bodies, self.ball
        return naive.window(*self.window, self.frame, self.tick)


def rig(draw):
    """A camera that hangs somewhere above the pitch and has any settings."""
    lens = CameraParameters(
        x_m=draw.uniform(0.4, 0.7),
        y_m=draw.uniform(0.2, 0.5),
        height_m=draw.uniform(1.6, 2.4),
        tilt_x_rad=draw.uniform(-0.05, 0.05),
        tilt_y_rad=draw.uniform(-0.05, 0.05),
        turn_rad=draw.choice((0.0, draw.uniform(-3.0, 3.0))),
        k1=draw.uniform(-0.3, 0.2),
        pixel_aspect=draw.choice((1.0, draw.uniform(0.9, 1.1))),
    )
    picture = PictureSettings(
        exposure_s=draw.choice((0.0, 0.004, 1.0 / 60.0)),
        sub_exposures=draw.choice((1, 3)),
        fields=draw.choice((1, 1, 2)),
        black_floor=draw.random() < 0.3,
        light_falloff=draw.choice((0.0, 0.25, 0.9)),
        mains_hz=draw.choice((50, 60)),
        gain=draw.uniform(0.5, 1.5),
        offset=draw.choice((0.0, 0.05)),
        chroma_bandwidth_hz=draw.choice((0.0, 0.4e6, 0.6e6, 1.3e6)),
        line_jitter_px=draw.choice((0.0, 0.0, 0.7)),
        bits=draw.choice((8, 8, 6, 3)),
    )
    pattern = PATTERNS[draw.choice(("diagonal", "strip"))]
    return Rig(lens, picture, pattern, Stream(draw.randrange(1 << 40), "scene"))


def scene(draw, lens):
    """Up to five robots, which may touch and hide each other, and perhaps the ball, around a window."""
    width, height = draw.choice(SIZES)
    left = draw.choice((0, 320 - width, draw.randrange(321 - width)))
    top = draw.choice((0, 240 - height, draw.randrange(241 - height)))
    x_m, y_m = Lens(lens).ground(left + width / 2, top + height / 2, 0.03)
    bodies = [
        Body(
            draw.randrange(2),
            number,
            x_m + draw.gauss(0.0, 0.06),
            y_m + draw.gauss(0.0, 0.06),
            draw.uniform(-7.0, 7.0),
            draw.choice((0.0, draw.uniform(-1.5, 1.5))),
            draw.choice((0.0, draw.uniform(-6.0, 6.0))),
        )
        for number in range(draw.randrange(6))
    ]
    near = (x_m + draw.gauss(0.0, 0.05), y_m + draw.gauss(0.0, 0.05))
    return Scene(
        bodies=bodies,
        ball=near if draw.random() < 0.6 else None,
        frame=draw.randrange(1 << 20),
        tick=draw.randrange(1 << 40),
        window=(left, top, width, height),
    )
