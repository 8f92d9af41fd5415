"""The colours as a camera shows them: what somebody would sample who holds each robot under it once."""

from __future__ import annotations

import math
from functools import lru_cache

from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.colours import FLOOR, ColourClasses, Samples, classes_of
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import BALL, IDENTITIES, PATTERNS, ROBOT_HEIGHT_M, TEAMS, PatternName
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.picture_settings import PictureSettings

PLACES_M = ((0.55, 0.30), (0.15, 0.05), (0.95, 0.65), (0.15, 0.65), (0.95, 0.05))
"""Spread over the pitch, because the light is not the same everywhere; no white line in the floor's samples."""
BALL_RADIUS_M = 0.02135


def samples_of(
    lens: CameraParameters, picture: PictureSettings, pattern: PatternName, ball: bool = True
) -> Samples:
    """Sampled pixels (Y, Cb, Cr) by name of the colour, the floor's among them, and the ball's if there is one."""
    camera = Camera(lens, picture, PATTERNS[pattern], Stream(0, "colour samples"))
    samples: Samples = {}
    frame = 0
    for x_m, y_m in PLACES_M:
        for number in range(len(IDENTITIES)):
            team = number % len(TEAMS)
            camera.clear()
            camera.robot(team, number, x_m, y_m, 0.0)
            camera.begin(frame, 0)
            for name, place in zip((TEAMS[team], IDENTITIES[number]), PATTERNS[pattern], strict=True):
                at = (x_m + place[0] / 1000.0, y_m + place[1] / 1000.0, ROBOT_HEIGHT_M)
                samples.setdefault(name, []).extend(_pixels(camera, at))
            frame += 1
        camera.clear()
        if ball:
            camera.ball(x_m, y_m)
        camera.begin(frame, 0)
        if ball:
            samples.setdefault(BALL, []).extend(_pixels(camera, (x_m, y_m, BALL_RADIUS_M)))
        samples.setdefault(FLOOR, []).extend(_pixels(camera, (x_m + 0.1, y_m, 0.0)))
        frame += 1
    return samples


def _pixels(camera: Camera, at: tuple[float, float, float]) -> list[tuple[int, int, int]]:
    """A square of 3 x 3."""
    u, v = Lens(camera.parameters).pixel(*at)
    data = camera.window(math.floor(u) - 1, math.floor(v) - 1, 3, 3)
    return [(data[at], data[at + 1], data[at + 2]) for at in range(0, len(data), 3)]


@lru_cache(maxsize=4)
def colours_of(
    lens: CameraParameters, picture: PictureSettings, pattern: PatternName, ball: bool = True
) -> ColourClasses:
    """The classes from such samples. Raises EyeError for colours that cannot be distinguished."""
    return classes_of(samples_of(lens, picture, pattern, ball), "camera.picture")
