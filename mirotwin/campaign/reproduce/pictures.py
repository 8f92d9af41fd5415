"""The five pictures: each figure of the paper twice, in truth and as the camera sees it, from the recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from miro_exact.clock import seconds
from mirotwin.recording.reader import read
from mirotwin.recording.track import RobotTrack, TrackingErrors
from mirotwin.report.figure import ERRORS
from mirotwin.report.seen import MeasuredErrors
from mirotwin.report.svg import Drawing, Panel, PanelBox

SIZE = (1000, 1010)
LEFT, RIGHT, TOP, GAP = 66, 20, 70, 64
WIDTH = (SIZE[0] - LEFT - RIGHT - GAP) / 2
PATH, ERROR = 290, 140
ROW_GAP = 74
SIDES = ("in truth", "as the camera sees it")


class Course(NamedTuple):
    """One recorded run: its name in the legend, its track, and errors as the camera sees them."""

    name: str
    track: RobotTrack
    seen: TrackingErrors


def course(name: str, path: str | Path, delay_frames: int) -> Course:
    """The first robot of a recording. `delay_frames`: of a camera whose measurements bear no tick."""
    track, seen = RobotTrack(), MeasuredErrors(delay_frames)
    for period in read(path).periods:
        track.add(period.robots[0], period.tick)
        seen.add(period.robots[0], period.tick)
    return Course(name, track, seen.errors)


def draw(path: Path, title: str, courses: Sequence[Course]) -> None:
    """Writes the SVG: left in truth, right as the camera sees it."""
    drawing = Drawing(*SIZE, (title,))
    for side in (0, 1):
        drawing.add(_path_panel(courses, bool(side)), _box(side, TOP, PATH))
    top = TOP + PATH + ROW_GAP
    for title, label, column, band, unit in ERRORS:
        pair = [
            Panel(f"{title}   (shaded: within {band:g} {unit})", "t [s]", label, band=band) for _ in SIDES
        ]
        for side, panel in enumerate(pair):
            for colour, one in enumerate(courses, start=1):
                errors = one.seen if side else one.track.errors
                times_s = [seconds(tick) for tick in errors.ticks]
                panel.line(times_s, getattr(errors, column), colour=colour, style="thin")
        spans = [panel.spans()[2:] for panel in pair]
        low, high = min(one[0] for one in spans), max(one[1] for one in spans)
        for side, panel in enumerate(pair):
            panel.y_range = (low - 0.05 * (high - low), high + 0.05 * (high - low))
            drawing.add(panel, _box(side, top, ERROR))
        top += ERROR + ROW_GAP
    drawing.write(path)


def _path_panel(courses: Sequence[Course], seen: bool) -> Panel:
    panel = Panel(f"(a)  x-y, {SIDES[seen]}", "x [cm]", "y [cm]", equal=True)
    reference = courses[0].track.reference
    panel.line(
        reference.x_cm, reference.y_cm, colour=0, style="thin dotted", label="" if seen else "reference"
    )
    for colour, one in enumerate(courses, start=1):
        points = one.track.seen if seen else one.track.truth
        panel.line(points.x_cm, points.y_cm, colour=colour, style="thin", label="" if seen else one.name)
    return panel


def _box(side: int, top: float, height: float) -> PanelBox:
    return PanelBox(LEFT + side * (WIDTH + GAP), top, WIDTH, height)
