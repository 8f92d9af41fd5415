"""Control points that a simulated camera shows: marks on the floor and on robots' tops, found in the picture.

The marks are given as the text of a file of control points, and read like any other: so people see the form.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.fit import COLUMNS
from miro_host.eye.lens import Lens

FLOOR_CM = (range(-10, 121, 26), range(-10, 81, 18), 0.0)
"""Columns, rows and height of the marks on the floor: from edge to edge of the pitch."""
TOPS_CM = (range(-5, 116, 24), range(-5, 76, 16), 7.5)
"""Of those on robots' tops: as near to the edge as a robot can stand."""


def text(camera: CameraParameters, noise_px: float, seed: int) -> str:
    """The marks that the camera sees, as CSV; `noise_px`: standard deviation of u and of v, normal."""
    stream = Stream(seed, "calibrate/marks")
    lens = Lens(camera)
    rows = [",".join(COLUMNS)]
    for number, (x_cm, y_cm, height_cm) in enumerate(_marks()):
        u, v = lens.pixel(x_cm / 100.0, y_cm / 100.0, height_cm / 100.0)
        if 0.0 <= u <= WIDTH and 0.0 <= v <= HEIGHT:
            u = _rounded(u + noise_px * stream.gauss(2 * number))
            v = _rounded(v + noise_px * stream.gauss(2 * number + 1))
            rows.append(f"{x_cm},{y_cm},{height_cm:g},{u:.4f},{v:.4f}")
    return "\n".join(rows) + "\n"


def _marks() -> Iterator[tuple[int, int, float]]:
    for columns, rows, height_cm in (FLOOR_CM, TOPS_CM):
        for y_cm in rows:
            for x_cm in columns:
                yield x_cm, y_cm, height_cm


def _rounded(px: float) -> float:
    return math.floor(10_000.0 * px + 0.5) / 10_000.0
