"""Random scenes for the camera: anywhere in the picture, crowded, at borders, with every setting.

`python -m tests.sim.pitch.scenes --count 100000` looks at windows beside the slow twin, once a scene, and beside the
whole picture, 200 times.
"""

import argparse
import hashlib
import random
import sys
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


WINDOWS = 200
"""Of one scene that are compared with the whole picture."""
SCENES = 5
"""With one camera."""


def digest(scenes=4):
    """SHA-256 over windows of random scenes."""
    draw, found = random.Random(5), hashlib.sha256()
    for _ in range(scenes):
        drawn = rig(draw)
        one, camera = scene(draw, drawn.lens), drawn.camera()
        one.put(camera)
        found.update(camera.window(*one.window))
    return found.hexdigest()


def cut(whole, left, top, width, height):
    """The window of a picture of 320 x 240."""
    lines = [3 * (320 * row + left) for row in range(top, top + height)]
    return b"".join(bytes(whole[at : at + 3 * width]) for at in lines)


def check_rig(draw, windows=WINDOWS):
    """Scenes of one camera. Returns how many windows were compared; raises AssertionError for one that differs."""
    drawn = rig(draw)
    camera, naive = drawn.camera(), drawn.naive()
    for _ in range(SCENES):
        one = scene(draw, drawn.lens)
        one.put(camera)
        assert camera.window(*one.window) == one.drawn_by(naive), (drawn, one)
        whole = camera.window(0, 0, 320, 240)
        for _ in range(windows):
            width, height = draw.randint(1, 48), draw.randint(1, 48)
            left, top = draw.randrange(321 - width), draw.randrange(241 - height)
            found = camera.window(left, top, width, height)
            assert found == cut(whole, left, top, width, height), (drawn, one, left, top, width, height)
    return SCENES * (windows + 1)


def main():
    parser = argparse.ArgumentParser(description="Windows beside the whole picture and the slow twin.")
    parser.add_argument("--count", type=int, default=100_000, help="windows (default 100000)")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    draw = random.Random(args.seed)
    done = 0
    while done < args.count:
        done += check_rig(draw)
        print(f"\r{done} windows equal", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{done} windows: each is that part of the whole picture, and one in {WINDOWS + 1} the slow twin's")


if __name__ == "__main__":
    main()
