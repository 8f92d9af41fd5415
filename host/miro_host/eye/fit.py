"""A calibration from control points: points whose places on the pitch and in the picture are known.

The parameters that can be found depend on the points:

    all points at one height     x_m, y_m, focal_px, pixel_aspect, tilt_x_rad, tilt_y_rad, turn_rad, k1
    2 cm or more between them    the same, height_m, centre_u_px, centre_v_px

Points in one plane cannot tell a high camera with a long lens from a low one with a short lens, nor a tilt from a
shifted centre, except by little more than noise: height and centre keep the values of the start. The other parameters
are then right in that plane, and nearly right at other heights if the height is right.

The method is Gauss and Newton's, damped (Levenberg 1944, Marquardt 1963): plain float64 in a written order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from miro_host.eye.calibration import Calibration, Residuals
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.eye_file import EyeError, csv_rows, text_of
from miro_host.eye.least_squares import NoConvergenceError, minimised
from miro_host.eye.lens import Lens

COLUMNS = ("x_cm", "y_cm", "height_cm", "u_px", "v_px")
IN_PLANE = ("x_m", "y_m", "focal_px", "pixel_aspect", "tilt_x_rad", "tilt_y_rad", "turn_rad", "k1")
IN_SPACE = (*IN_PLANE, "height_m", "centre_u_px", "centre_v_px")
SCALES = {"focal_px": 100.0, "centre_u_px": 100.0, "centre_v_px": 100.0}
"""Size of a parameter where it is not about 1."""
PLANE_M = 0.02
"""Points whose heights differ by less than this, in metres, count as one plane."""
LINE_M = 0.05
"""Points must spread by more than this (rms) across their main direction."""
MOST_POINTS = 5000
"""Largest number of points: more take minutes and improve nothing."""
MOST = 1e5
"""Largest value of a cell, in cm or px."""
WORST_RMS_PX = 10.0
"""A worse fit is no fit: columns exchanged, or a start that is far off."""


class ControlPoint(NamedTuple):
    """A point of the pitch in m, and where the picture shows it."""

    x_m: float
    y_m: float
    z_m: float
    u: float
    v: float


def read_points(path: str | Path) -> list[ControlPoint]:
    """The points in a CSV file with the columns `COLUMNS`, in any order, first line their names. Raises EyeError."""
    return parse_points(text_of(path), f"{path}")


def parse_points(text: str, origin: str) -> list[ControlPoint]:
    """The points in CSV text. Raises EyeError with the line for wrong columns and for a cell that is no number."""
    return [_point(cells, origin, line) for line, cells in csv_rows(text, origin, COLUMNS)]


def _point(cells: dict[str, str], origin: str, line: int) -> ControlPoint:
    numbers = []
    for name in COLUMNS:
        try:
            number = float(cells[name])
        except ValueError:
            raise EyeError(origin, line, f"{name}: {cells[name]!r} is no number", "write a number") from None
        if not abs(number) <= MOST:
            raise EyeError(origin, line, f"{name}: {cells[name]!r}", f"write a number within +-{MOST:g}")
        numbers.append(number)
    x_cm, y_cm, height_cm, u, v = numbers
    return ControlPoint(x_cm / 100.0, y_cm / 100.0, height_cm / 100.0, u, v)


def fit(
    points: Sequence[ControlPoint], start: CameraParameters, origin: str = "control points"
) -> Calibration:
    """The parameters that draw the points nearest to where they were measured; the rest is that of `start`.

    Raises EyeError: too few points, points on one line, a point that the camera at the start cannot see, no
    convergence, a result out of the parameters' ranges. Points are numbered from 1.
    """
    heights = [point.z_m for point in points]
    free = IN_SPACE if heights and max(heights) - min(heights) >= PLANE_M else IN_PLANE
    _check_points(points, free, start, origin)
    scales = [SCALES.get(name, 1.0) for name in free]

    def residuals(values: list[float]) -> list[float]:
        return _residuals(points, _changed(start, free, values, scales))

    first = [getattr(start, name) / scale for name, scale in zip(free, scales, strict=True)]
    try:
        fitted = _checked(_changed(start, free, minimised(residuals, first), scales), origin)
    except NoConvergenceError as error:
        raise EyeError(
            origin, "", f"no convergence: {error}", "begin nearer to the truth, check the points"
        ) from None
    return _calibration(points, fitted, free, origin)


def _check_points(
    points: Sequence[ControlPoint], free: tuple[str, ...], start: CameraParameters, origin: str
) -> None:
    least = (len(free) + 1) // 2 + 1
    if len(points) > MOST_POINTS:
        raise EyeError(origin, "", f"{len(points)} points", f"give at most {MOST_POINTS}")
    places = len({(point.x_m, point.y_m, point.z_m) for point in points})
    if places < least:
        problem = f"{places} points for {len(free)} parameters"
        raise EyeError(origin, "", problem, f"give at least {least}, better 20 all over the pitch")
    if _across_m(points) < LINE_M:
        raise EyeError(origin, "", "the points lie on one line", "add points beside it, all over the pitch")
    lens = Lens(start)
    for number, point in enumerate(points, start=1):
        try:
            lens.pixel(point.x_m, point.y_m, point.z_m)
        except ValueError as error:
            remedy = "check its height, and the camera's at the start"
            raise EyeError(origin, f"point {number}", f"{error}", remedy) from None


def _across_m(points: Sequence[ControlPoint]) -> float:
    """Rms distance of the points from the line that fits them best, seen from above."""
    count = len(points)
    mean_x = mean_y = xx = xy = yy = 0.0
    for point in points:
        mean_x += point.x_m / count
        mean_y += point.y_m / count
    for point in points:
        dx, dy = point.x_m - mean_x, point.y_m - mean_y
        xx += dx * dx / count
        xy += dx * dy / count
        yy += dy * dy / count
    half = 0.5 * (xx - yy)
    return math.sqrt(max(0.5 * (xx + yy) - math.sqrt(half * half + xy * xy), 0.0))


def _changed(
    start: CameraParameters, free: tuple[str, ...], values: Sequence[float], scales: Sequence[float]
) -> CameraParameters:
    changes = {name: scale * value for name, value, scale in zip(free, values, scales, strict=True)}
    return msgspec.structs.replace(start, **changes)


def _residuals(points: Sequence[ControlPoint], parameters: CameraParameters) -> list[float]:
    """Drawn minus measured, u and v of each point in px. Raises ValueError for a point behind the camera."""
    lens = Lens(parameters)
    residuals = []
    for point in points:
        u, v = lens.pixel(point.x_m, point.y_m, point.z_m)
        residuals.append(u - point.u)
        residuals.append(v - point.v)
    return residuals


def _checked(parameters: CameraParameters, origin: str) -> CameraParameters:
    """The parameters, if they are in their ranges."""
    try:
        return msgspec.convert(msgspec.to_builtins(parameters), CameraParameters)
    except msgspec.ValidationError as error:
        problem = f"no convergence: the result is out of range ({error})".replace("`", "")
        raise EyeError(origin, "", problem, "begin nearer to the truth, check the points") from None


def _calibration(
    points: Sequence[ControlPoint], fitted: CameraParameters, free: tuple[str, ...], origin: str
) -> Calibration:
    off = _residuals(points, fitted)
    squares = 0.0
    px = []
    for index in range(0, len(off), 2):
        square = off[index] * off[index] + off[index + 1] * off[index + 1]
        squares += square
        px.append(math.sqrt(square))
    rms = math.sqrt(squares / len(px))
    if rms > WORST_RMS_PX:
        worst = px.index(max(px)) + 1
        problem = f"no convergence: {rms:.1f} px rms remain, most at point {worst}"
        raise EyeError(origin, "", problem, "check the columns, the units and the start")
    residuals = Residuals(rms_px=rms, max_px=max(px), points=len(px), px=tuple(px))
    return Calibration(camera=fitted, free=free, residuals=residuals)
