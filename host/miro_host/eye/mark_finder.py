"""Finds a mark in a picture: reads pixels across a bright band and returns its distance from the expected place.

      light                 +--+            The light of a row is read outwards from its brightest pixel to the first
        |               +--+|  |            valley on either side; what is above the valley's level belongs to the band.
        |  floor        |      |  wall top  Its centre is the middle of that light.
        +---------------+      +---------
               left  <- peak ->  right

A camera's gamma of about a half makes its levels square roots of light; so the square of a level is taken for light.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from miro_host.eye.grabber import Pixels
from miro_host.eye.lens import Lens
from miro_host.eye.pitch_marks import PitchMark

REACH_PX = 11
"""Largest distance of a band from the expected place, in pixels."""
ROWS = 5
"""Rows (or columns) that are read."""
HALF_BAND_PX = 5
"""Half of the largest width of a band, in pixels; valleys are searched within this distance."""
LEAST_RISE = 0.5
"""Share of the brightest light by which a band is above both valleys."""
LEAST_LEVEL = 60
SPREAD_PX = 1.0
"""The rows of one mark agree within this."""
_STEP_M = 0.01


class FloorMark(NamedTuple):
    """A mark in the picture: its middle (u, v) and the unit vector (across_u, across_v) to one side of it."""

    u: float
    v: float
    across_u: float
    across_v: float


def expected(lens: Lens, mark: PitchMark) -> FloorMark:
    """The place of a mark in the picture: half-way between foot and edge of a wall.

    Raises ValueError as `Lens.pixel` does.
    """
    u, v = _middle(lens, mark, 0.0)
    ahead_u, ahead_v = _middle(lens, mark, _STEP_M)
    along_u, along_v = ahead_u - u, ahead_v - v
    length = math.sqrt(along_u * along_u + along_v * along_v)
    return FloorMark(u, v, 0.0 - along_v / length, along_u / length)


def _middle(lens: Lens, mark: PitchMark, ahead_m: float) -> tuple[float, float]:
    x_m, y_m = mark.x_m + ahead_m * mark.along_x, mark.y_m + ahead_m * mark.along_y
    u, v = lens.pixel(x_m, y_m, 0.0)
    if mark.height_m == 0.0:
        return u, v
    top_u, top_v = lens.pixel(x_m, y_m, mark.height_m)
    return 0.5 * (u + top_u), 0.5 * (v + top_v)


def find(frame: Pixels, band: FloorMark) -> float | None:
    """Distance of the band from its expected place, across it, in pixels. None: it is missing or uncertain."""
    by_rows = abs(band.across_u) >= abs(band.across_v)
    length = 2 * REACH_PX + 1
    width, height = (length, ROWS) if by_rows else (ROWS, length)
    left, top = math.floor(band.u) - width // 2, math.floor(band.v) - height // 2
    if left < 0 or top < 0 or left + width > frame.width or top + height > frame.height:
        return None
    pixels = frame.window(left, top, width, height)
    off = []
    for row in range(ROWS):
        first, step = (3 * row * width, 3) if by_rows else (3 * row, 3 * width)
        centre = band_centre(pixels[first : first + step * (length - 1) + 1 : step])
        if centre is None:
            continue
        u, v = (left + centre, top + row + 0.5) if by_rows else (left + row + 0.5, top + centre)
        off.append((u - band.u) * band.across_u + (v - band.v) * band.across_v)
    if len(off) < ROWS - 1 or max(off) - min(off) > SPREAD_PX:
        return None
    total = 0.0
    for each in off:
        total += each
    return total / len(off)


def band_centre(levels: bytes | bytearray) -> float | None:
    """The middle of the brightest band in a row of levels, in pixels from its beginning; None if there is none."""
    peak = max(range(len(levels)), key=lambda index: levels[index])
    if levels[peak] < LEAST_LEVEL or not 2 <= peak < len(levels) - 2:
        return None
    light = [level * level for level in levels]
    left, right = _valley(light, peak, -1), _valley(light, peak, 1)
    if max(light[left], light[right]) > LEAST_RISE * light[peak]:
        return None
    total = moment = 0
    for index in range(left + 1, right):
        floor = light[left] if index < peak else light[right] if index > peak else 0
        above = max(light[index] - floor, 0)
        if index == peak:
            above -= (light[left] + light[right]) // 2
        total += above
        moment += above * (2 * index + 1)
    return 0.5 * moment / total


def _valley(light: list[int], peak: int, step: int) -> int:
    """The darkest pixel on one side, not far away."""
    last = peak + step * HALF_BAND_PX
    end = max(last, 0) if step < 0 else min(last, len(light) - 1)
    return min(range(peak + step, end + step, step), key=lambda index: light[index])
