"""Calibrations for experiments: the true one, one as wrong as that of 1997 may have been, and none.

The paper gives a worst position error of 2.40 cm without its cause. `drawn_1997` assumes a slightly wrong calibration:
centre off by about 1 px, focal length by 1 %, tilt by 0.57 degrees, in directions and with a sign that differ from seed
to seed, all scaled by one factor so that the worst error over the pitch is 2.40 cm.
"""

from __future__ import annotations

import math

import msgspec

from miro_exact.dmath import sincos
from miro_exact.rng import Stream
from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import ROBOT_HEIGHT_M
from miro_host.eye.pitch_marks import BOTTOM_M, LEFT_M, RIGHT_M, TOP_M

CENTRE_PX = 1.0
FOCAL_SHARE = 0.01
TILT_RAD = 0.009948376736367678
"""0.57 degrees."""
WORST_M = 0.0240
"""Paper, section V-A."""

GRID_M = 0.10

_STEPS = 20
_LARGEST_FACTOR = 100.0
_TWO_PI = 6.283185307179586


class CalibrationErrors(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Independent errors of a calibration.

    The first five are added to the true values. `focal_share`: share of the focal length. `ignore_height`: everything
    is evaluated on the floor. `ignore_distortion`: the lens is assumed to have none.
    """

    centre_u_px: float = 0.0
    centre_v_px: float = 0.0
    focal_share: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    ignore_height: bool = False
    ignore_distortion: bool = False


ADDED = ("centre_u_px", "centre_v_px", "focal_share", "tilt_x_rad", "tilt_y_rad")


def exact(true: CameraParameters) -> Calibration:
    """The calibration with the camera's true parameters."""
    return Calibration(camera=true)


def wrong(true: CameraParameters, errors: CalibrationErrors) -> Calibration:
    """The true camera with these errors. Raises ValueError if a parameter leaves its range."""
    camera = msgspec.structs.replace(
        true,
        centre_u_px=true.centre_u_px + errors.centre_u_px,
        centre_v_px=true.centre_v_px + errors.centre_v_px,
        focal_px=true.focal_px * (1.0 + errors.focal_share),
        tilt_x_rad=true.tilt_x_rad + errors.tilt_x_rad,
        tilt_y_rad=true.tilt_y_rad + errors.tilt_y_rad,
        k1=0.0 if errors.ignore_distortion else true.k1,
    )
    try:
        camera = msgspec.convert(msgspec.to_builtins(camera), CameraParameters)
    except msgspec.ValidationError as error:
        raise ValueError(f"calibration errors: {error}".replace("`", "")) from None
    return Calibration(camera=camera, ignore_height=errors.ignore_height)


def none(true: CameraParameters) -> Calibration:
    """A plain scale, centimetres per pixel at the floor: no height, no distortion, no tilt."""
    camera = msgspec.structs.replace(true, tilt_x_rad=0.0, tilt_y_rad=0.0, k1=0.0)
    return Calibration(camera=camera, ignore_height=True)


def drawn_1997(
    true: CameraParameters,
    stream: Stream,
    centre_px: float = CENTRE_PX,
    focal_share: float = FOCAL_SHARE,
    tilt_rad: float = TILT_RAD,
    worst_m: float = WORST_M,
) -> Calibration:
    """A calibration with an error of `worst_m` at the worst place; 0: with the error that follows from the sizes.

    Takes three draws of the stream: two directions and a sign, uniform.
    """
    centre_sin, centre_cos = sincos(_TWO_PI * stream.uniform(0))
    tilt_sin, tilt_cos = sincos(_TWO_PI * stream.uniform(1))
    errors = CalibrationErrors(
        centre_u_px=centre_px * centre_cos,
        centre_v_px=centre_px * centre_sin,
        focal_share=focal_share if stream.uniform(2) < 0.5 else 0.0 - focal_share,
        tilt_x_rad=tilt_rad * tilt_cos,
        tilt_y_rad=tilt_rad * tilt_sin,
    )
    return wrong(true, _scaled(errors, _factor(true, errors, worst_m)) if worst_m > 0.0 else errors)


def _factor(true: CameraParameters, errors: CalibrationErrors, worst_m: float) -> float:
    """Factor on `errors` that gives this worst case: nearly proportional, so a few steps suffice."""
    grid = _grid(true)
    factor = 1.0
    for _ in range(_STEPS):
        found_m = _worst_m(grid, wrong(true, _scaled(errors, factor)))
        if found_m == 0.0:
            return 1.0
        if found_m == math.inf:
            factor *= 0.5
        else:
            factor = min(factor * worst_m / found_m, _LARGEST_FACTOR)
    return factor


def _scaled(errors: CalibrationErrors, factor: float) -> CalibrationErrors:
    """Errors that are larger by a factor; switches stay."""
    return msgspec.structs.replace(errors, **{name: factor * getattr(errors, name) for name in ADDED})


def worst_error_m(true: CameraParameters, calibration: Calibration) -> float:
    """The largest position error over the pitch, at the height of the robots' tops, edges included."""
    return _worst_m(_grid(true), calibration)


def _grid(true: CameraParameters) -> list[tuple[float, float, float, float]]:
    """x, y, u, v: points of the pitch, and where the true camera draws them."""
    lens = Lens(true)
    points = []
    for column in range(round((RIGHT_M - LEFT_M) / GRID_M) + 1):
        for row in range(round((TOP_M - BOTTOM_M) / GRID_M) + 1):
            x_m, y_m = LEFT_M + column * GRID_M, BOTTOM_M + row * GRID_M
            points.append((x_m, y_m, *lens.pixel(x_m, y_m, ROBOT_HEIGHT_M)))
    return points


def _worst_m(grid: list[tuple[float, float, float, float]], calibration: Calibration) -> float:
    """The largest distance; infinite where the wrong camera cannot see."""
    lens = calibration.lens()
    z_m = calibration.height_m(ROBOT_HEIGHT_M)
    worst = 0.0
    for x_m, y_m, u, v in grid:
        try:
            found_x, found_y = lens.ground(u, v, z_m)
        except ValueError:
            return math.inf
        dx, dy = found_x - x_m, found_y - y_m
        worst = max(worst, dx * dx + dy * dy)
    return math.sqrt(worst)
