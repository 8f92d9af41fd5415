"""The five pictures: each figure of the paper twice, in truth and as the camera sees it, from the recordings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from miro_exact.clock import seconds
from mirotwin.recording.reader import read
from mirotwin.recording.track import RobotTrack
from mirotwin.report.figure import ERRORS
from mirotwin.report.svg import Drawing, Panel, PanelBox

SIZE = (1000, 1010)
LEFT, RIGHT, TOP, GAP = 66, 20, 70, 64
WIDTH = (SIZE[0] - LEFT - RIGHT - GAP) / 2
PATH, ERROR = 290, 140
ROW_GAP = 74
SIDES = ("in truth", "as the camera sees it")


def track_of(path: str | Path, delay_frames: int) -> RobotTrack:
    """The first robot of a recording. `delay_frames`: delay of a camera whose measurements have no tick."""
    track = RobotTrack(delay_frames)
    for period in read(path).periods:
        track.add(period.robots[0], period.tick)
    return track


def draw(path: Path, title: str, tracks: Mapping[str, RobotTrack]) -> None:
    """Writes the SVG of tracks, by their legend names: truth left, camera measurement right."""
    drawing = Drawing(*SIZE, (title,))
    for side in (0, 1):
        drawing.add(_path_panel(tracks, bool(side)), _box(side, TOP, PATH))
    top = TOP + PATH + ROW_GAP
    for title, label, column, band, unit in ERRORS:
        pair = [
            Panel(f"{title}   (shaded: within {band:g} {unit})", "t [s]", label, band=band) for _ in SIDES
        ]
        for side, panel in enumerate(pair):
            for colour, track in enumerate(tracks.values(), start=1):
                errors = track.measured_errors if side else track.errors
                times_s = [seconds(tick) for tick in errors.ticks]
                panel.line(times_s, getattr(errors, column), colour=colour, style="thin")
        spans = [panel.spans()[2:] for panel in pair]
        low, high = min(span[0] for span in spans), max(span[1] for span in spans)
        for side, panel in enumerate(pair):
            panel.y_range = (low - 0.05 * (high - low), high + 0.05 * (high - low))
            drawing.add(panel, _box(side, top, ERROR))
        top += ERROR + ROW_GAP
    drawing.write(path)


def _path_panel(tracks: Mapping[str, RobotTrack], measured: bool) -> Panel:
    panel = Panel(f"(a)  x-y, {SIDES[measured]}", "x [cm]", "y [cm]", equal=True)
    x_cm, y_cm = next(iter(tracks.values())).reference.points_cm()
    panel.line(x_cm, y_cm, colour=0, style="thin dotted", label="" if measured else "reference")
    for colour, (name, track) in enumerate(tracks.items(), start=1):
        x_cm, y_cm = (track.measured if measured else track.truth).points_cm()
        panel.line(x_cm, y_cm, colour=colour, style="thin", label="" if measured else name)
    return panel


def _box(side: int, top: float, height: float) -> PanelBox:
    return PanelBox(LEFT + side * (WIDTH + GAP), top, WIDTH, height)
