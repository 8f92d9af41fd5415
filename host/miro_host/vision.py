"""The camera's measurement of a posture: true posture in, noisy, gridded and late posture out.

The heading is not put on a grid. Patch centroids are averages over some 64 pixels; if they were whole
pixels, two of them 4 cm (9 pixels) apart would give headings in steps of more than 6 degrees, more than the
paper's whole error of 4.83 degrees. Its quantisation is part of that figure. The position is gridded to
whole pixels, the coarser reading of "320 x 240" in section V-A.
"""

import math
from collections import deque

import msgspec

from miro_exact import dmath
from miro_exact.domain import DomainError
from miro_exact.rng import Stream
from miro_exact.state import Rows
from miro_host.posture import Posture

DEGREE = 0.017453292519943295
_SIGMAS = 3.0
_MEASURED = ("d", -1e6, 1e6)  # metres and radians: far more than a camera sees, and angles that `dmath` takes


class VisionErrors(msgspec.Struct, frozen=True):
    """Bounds of the measurement error (3 sigma, per axis) and the pixel size; 0 switches one off.

    Defaults: paper section V-A (2.40 cm, 4.83 degrees) and a view of 140 x 105 cm on its 320 x 240 pixels.
    """

    position_m: float = 0.0240
    heading_rad: float = 4.83 * DEGREE
    pixel_m: float = 0.004375

    def __post_init__(self) -> None:
        for name in ("position_m", "heading_rad", "pixel_m"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be 0 or greater")


def error_of(normal: float, bound: float) -> float:
    """A standard normal scaled so that `bound` is 3 sigma, and cut off there: the paper gives a bound."""
    return bound * (min(max(normal, -_SIGMAS), _SIGMAS) / _SIGMAS)


def to_grid(x: float, step: float) -> float:
    """The multiple of `step` nearest to x, halves upwards; x itself for step 0. The origin is on the grid."""
    if step == 0.0:
        return x
    cells = x / step + 0.5
    if cells - cells != 0.0:
        raise DomainError(f"{x!r} m is beyond any grid of {step!r} m")
    return step * math.floor(cells)


def measure(true: Posture, normals: tuple[float, float, float], errors: VisionErrors) -> Posture:
    """The posture as the tracker reports it, heading wrapped to (-pi, pi].

    `normals` are three standard normals for x, y and heading. Off by at most the bound plus half a pixel per
    axis, and by at most the heading bound.
    """
    right, up, turn = normals
    position_m, pixel_m = errors.position_m, errors.pixel_m
    return Posture(
        to_grid(true.x_m + error_of(right, position_m), pixel_m),
        to_grid(true.y_m + error_of(up, position_m), pixel_m),
        dmath.wrap_pi(true.theta_rad + error_of(turn, errors.heading_rad)),
    )


class Vision:
    """Camera, grabber and tracker of one robot: an exposure in, a measurement out, `delay_frames` later."""

    STATE = {
        "under_way": Rows(
            *(1 << 16, "?", _MEASURED, _MEASURED, _MEASURED),
            split=lambda p: (False, 0.0, 0.0, 0.0) if p is None else (True, p.x_m, p.y_m, p.theta_rad),
            make=lambda cells: Posture(*cells[1:]) if cells[0] else None,
        )
    }
    NOT_STATE = ("delay_frames", "errors")

    def __init__(self, errors: VisionErrors, delay_frames: int = 1) -> None:
        if delay_frames < 0:
            raise ValueError(f"delay_frames = {delay_frames}: must be 0 or greater")
        self.errors = errors
        self.delay_frames = delay_frames
        self.under_way: deque[Posture | None] = deque([None] * delay_frames)

    def __repr__(self) -> str:
        return (
            f"Vision({self.errors!r}, delay_frames={self.delay_frames}, under_way={list(self.under_way)!r})"
        )

    def expose(self, true: tuple[float, float, float], noise: Stream, frame: int) -> Posture | None:
        """Exposes a robot at this position and heading, with the draws of frame number `frame`.

        Returns what the host gets at this tick: an older frame. The first `delay_frames` answers are None.
        """
        normals = noise.gauss(3 * frame), noise.gauss(3 * frame + 1), noise.gauss(3 * frame + 2)
        self.under_way.append(measure(Posture(*true), normals, self.errors))
        return self.under_way.popleft()

    def after_load(self) -> None:
        """Raises ValueError unless as many frames are under way as the delay says."""
        if len(self.under_way) != self.delay_frames:
            raise ValueError(f"{len(self.under_way)} frames are under way, the delay is {self.delay_frames}")
