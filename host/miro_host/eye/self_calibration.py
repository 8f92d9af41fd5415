"""A camera's parameters while it is in use, from lines and walls of the pitch (Bailey and Sen Gupta,
doi 10.5772/7341).

    picture -> a mark, where the parameters of now draw it -> distance across the band -> Kalman update of 7 numbers
    every `TOLD_FRAMES` frames: parameters -> calibration of the tracker

It learns the five numbers in which a calibration of 1997 may be wrong (middle of the picture, focal length, tilts),
turn and distortion. Position and height of the camera are taken from the first calibration. A line on the floor and a
wall's face show the projection of the floor and of 2.5 cm above it; the robots' tops at 7.5 cm follow from the
parameters. The encoders of the robots never see where the pitch lies in the picture, so they cannot replace a line
(`benchmarks/observability.py` calculates it).

A mark is scalar: it measures across its band only. The estimate is linear about the first calibration, whose derivative
is stored; the expected place itself is computed with the present parameters. A mark is left out where a robot of the
own team is near; it is refused where it is further off than `GATE` standard deviations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import msgspec

from miro_exact.state import TICK
from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.grabber import Pixels
from miro_host.eye.least_squares import product
from miro_host.eye.lens import Lens
from miro_host.eye.mark_finder import expected, find
from miro_host.eye.pitch_marks import MARKS, PitchMark
from miro_host.eye.track import Track

LEARNT = ("centre_u_px", "centre_v_px", "focal_px", "tilt_x_rad", "tilt_y_rad", "turn_rad", "k1")
SPREADS = (3.0, 3.0, 15.0, 0.03, 0.03, 0.02, 0.1)
"""Standard deviations at the beginning, in the units of `LEARNT`: the first five are three times the errors of 1997."""
WALL_NOISE_PX = 0.08
LINE_NOISE_PX = 0.25
"""Standard deviations: a line is thinner than a pixel, and up to 0.3 px off, always the same way."""
GATE = 4.0
STRIDE = 29
"""From one mark to the next: prime to their number, so that marks all over the picture follow each other."""
SETTLED_FRAMES = 150
"""First frames, each of which examines one mark; later only one frame in `SELDOM` examines one."""
SELDOM = 8
TOLD_FRAMES = 15
NEAR_M = 0.15
"""A robot this near may hide a mark, or be as bright."""

_SIZE = len(LEARNT)


class SelfCalibration:
    """The changes of `LEARNT` against the first calibration, their covariance (row by row), and counts.

    `looked`: frames; `used`, `refused`: marks; `told`: the changes that the tracker uses.
    """

    STATE = {
        "changes": f"{_SIZE}d",
        "covariance": f"{_SIZE * _SIZE}d",
        "told": f"{_SIZE}d",
        "looked": TICK,
        "used": TICK,
        "refused": TICK,
    }
    NOT_STATE = ("begun",)

    def __init__(self, begun: Calibration) -> None:
        self.begun = begun
        self.changes = [0.0] * _SIZE
        self.told = [0.0] * _SIZE
        self.covariance = [0.0] * (_SIZE * _SIZE)
        for index, spread in enumerate(SPREADS):
            self.covariance[index * (_SIZE + 1)] = spread * spread
        self.looked = self.used = self.refused = 0

    def __repr__(self) -> str:
        return f"SelfCalibration({dict(zip(LEARNT, self.changes, strict=True))!r}, used={self.used})"

    def look(self, frame: Pixels, robots: Sequence[Track]) -> bool:
        """Takes one mark of a picture. True: `calibration` has news for the tracker."""
        frames = self.looked
        if frames < SETTLED_FRAMES or frames % SELDOM == 0:
            turn = frames if frames < SETTLED_FRAMES else frames // SELDOM
            mark = MARKS[turn * STRIDE % len(MARKS)]
            if not any(_hides(robot, mark) for robot in robots):
                self._take(frame, mark)
        self.looked += 1
        if self.looked % TOLD_FRAMES or self.told == self.changes:
            return False
        self.told = list(self.changes)
        return True

    @property
    def calibration(self) -> Calibration:
        """The calibration used by the tracker."""
        return msgspec.structs.replace(self.begun, camera=changed(self.begun.camera, self.told))

    def spreads(self) -> dict[str, float]:
        """Standard deviations of the parameters, by name."""
        return {name: math.sqrt(self.covariance[index * (_SIZE + 1)]) for index, name in enumerate(LEARNT)}

    def _take(self, frame: Pixels, mark: PitchMark) -> None:
        try:
            band = expected(Lens(changed(self.begun.camera, self.changes)), mark)
            slopes = slopes_of(self.begun.camera, mark)
        except ValueError:  # not in the picture
            return
        off_px = find(frame, band)
        if off_px is None:
            return
        p, noise_px = self.covariance, WALL_NOISE_PX if mark.height_m > 0.0 else LINE_NOISE_PX
        ph = [product(p[row * _SIZE : (row + 1) * _SIZE], slopes) for row in range(_SIZE)]
        variance = product(slopes, ph) + noise_px * noise_px
        if off_px * off_px > GATE * GATE * variance:
            self.refused += 1
            return
        self.used += 1
        for row in range(_SIZE):
            self.changes[row] += ph[row] / variance * off_px
        for row in range(_SIZE):
            for column in range(row + 1):
                less = p[row * _SIZE + column] - ph[row] * ph[column] / variance
                p[row * _SIZE + column] = p[column * _SIZE + row] = less

    def after_load(self) -> None:
        """Raises ValueError for parameters of no camera and for a covariance that no step leaves."""
        for changes in (self.changes, self.told):
            camera = changed(self.begun.camera, changes)
            try:
                msgspec.convert(msgspec.to_builtins(camera), CameraParameters)
            except msgspec.ValidationError as error:
                raise ValueError(f"self-calibration: {error}") from None
        for row in range(_SIZE):
            if not 0.0 <= self.covariance[row * (_SIZE + 1)] <= SPREADS[row] * SPREADS[row]:
                raise ValueError("self-calibration: the covariance is that of no filter")


def changed(camera: CameraParameters, changes: Sequence[float]) -> CameraParameters:
    """The camera with these changes of `LEARNT`."""
    return msgspec.structs.replace(
        camera, **{name: getattr(camera, name) + by for name, by in zip(LEARNT, changes, strict=True)}
    )


@lru_cache(maxsize=4096)
def slopes_of(camera: CameraParameters, mark: PitchMark) -> tuple[float, ...]:
    """By how much the mark moves across its band with each of `LEARNT`, in pixels."""
    here = expected(Lens(camera), mark)
    slopes = []
    for index, spread in enumerate(SPREADS):
        step = 0.01 * spread
        changes = [0.0] * _SIZE
        changes[index] = step
        moved = expected(Lens(changed(camera, changes)), mark)
        across = (moved.u - here.u) * here.across_u + (moved.v - here.v) * here.across_v
        slopes.append(across / step)
    return tuple(slopes)


def _hides(robot: Track, mark: PitchMark) -> bool:
    return robot.seen > 0 and abs(robot.x_m - mark.x_m) < NEAR_M and abs(robot.y_m - mark.y_m) < NEAR_M
