"""Where in the whole picture a robot of a team could be: every fourth row, looked at alone."""

from __future__ import annotations

from miro_host.eye.frame import Pixels
from miro_host.eye.regions import Regions

ROW_STEP = 4
"""Rows from one that is looked at to the next: a patch of 8 pixels cannot lie between two."""


def candidates(frame: Pixels, regions: Regions, team: int, side_px: float) -> list[tuple[int, int]]:
    """(u, v) of what may be patches of class `team`, whose sides are `side_px` long; rows from the top."""
    found: list[tuple[float, int, int]] = []  # middle of the first run, first row, last row
    for row in range(ROW_STEP // 2, frame.height, ROW_STEP):
        count = regions.find(frame.window(0, row, frame.width, 1), frame.width, 1)
        for index in range(count):
            run = regions.region(index)
            if run.kind == team and 0.4 * side_px <= run.area <= 1.5 * side_px + 4.0:
                _add(found, 0.5 * (run.left + run.right), row, side_px)
    return [(int(u), (first + last) // 2) for u, first, last in found]


def _add(found: list[tuple[float, int, int]], u: float, row: int, side_px: float) -> None:
    """A run goes on with what was found in the last rows, or it is something new."""
    for place, (first_u, first, last) in enumerate(found):
        if row - last <= ROW_STEP and row - first <= 2.0 * side_px and abs(u - first_u) <= side_px:
            found[place] = (first_u, first, row)
            return
    found.append((u, row, row))
