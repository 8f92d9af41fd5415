"""The picture of a run: the four panels of the paper's Figs. 6 to 10, and below them the laws' inner values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from miro_exact.clock import seconds
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, ErrorSample, Tracks
from mirotwin.report.svg import COLOURS, Drawing, Panel, PanelBox, Stroke
from mirotwin.runs.summary import rms_name, settling_text, tracking_of

ERRORS = (
    ("(b)  x_e", "x_e [cm]", "x_cm", SETTLED_CM, "cm"),
    ("(c)  y_e", "y_e [cm]", "y_cm", SETTLED_CM, "cm"),
    ("(d)  \u03b8_e", "\u03b8_e [rad]", "theta_rad", SETTLED_RAD, "rad"),
)
"""Title, label of the axis, column, and the band that counts as settled, with its unit."""
MOST_INNER = 8
"""Largest number of inner values that are drawn; a recording holds them all."""
WIDTH = 1000
LEFT, RIGHT, TOP, BOTTOM = 66, 20, 86, 20
PANEL, INNER, GAP = 260, 110, 74
COLUMNS = 4


def draw(tracks: Tracks, path: Path, *, scenario: str, seed: int, title: str = "") -> None:
    """Writes the SVG; raises ValueError when there is no period to draw."""
    if not tracks.robots:
        raise ValueError("nothing to draw: the run has no control period")
    inner = list(tracks.inner)[:MOST_INNER]
    rows = -(-len(inner) // COLUMNS)
    height = TOP + 2 * (PANEL + GAP) + rows * (INNER + 36) + BOTTOM
    errors = next(iter(tracks.robots.values())).errors
    drawing = Drawing(WIDTH, height, _heading(scenario, seed, title, errors))
    panels = [path_panel(tracks), *(error_panel(tracks, *kind) for kind in ERRORS)]
    for index, panel in enumerate(panels):
        drawing.add(panel, _box(2, index % 2, TOP + index // 2 * (PANEL + GAP), PANEL))
    for index, name in enumerate(inner):
        top = TOP + 2 * (PANEL + GAP) + index // COLUMNS * (INNER + 36)
        drawing.add(_inner_panel(tracks, name), _box(COLUMNS, index % COLUMNS, top, INNER))
    drawing.write(path)


def path_panel(tracks: Tracks) -> Panel:
    panel = Panel("(a)  x-y, from the circle", "x [cm]", "y [cm]", equal=True)
    for index, (place, track) in enumerate(tracks.robots.items()):
        colour, first = 1 + index % COLOURS, index == 0
        label = "camera" if first else ""
        panel.marks.append(Stroke(*track.measured.points_cm(), "dots", colour, label))
        label = "reference" if first else ""
        panel.line(*track.reference.points_cm(), colour=0, style="dotted", label=label)
        label = "robot" if len(tracks.robots) == 1 else f"robot {place[0]}/{place[1]}"
        x_cm, y_cm = track.truth.points_cm()
        panel.line(x_cm, y_cm, colour=colour, label=label)
        panel.marks.append(Stroke(x_cm[:1], y_cm[:1], "start", colour))
    return panel


def error_panel(tracks: Tracks, title: str, label: str, column: str, band: float, unit: str) -> Panel:
    panel = Panel(f"{title}   (shaded: within {band:g} {unit})", "t [s]", label, band=band)
    for index, track in enumerate(tracks.robots.values()):
        times_s = [seconds(tick) for tick in track.errors.ticks]
        if index == 0:
            panel.line([times_s[0], times_s[-1]], [0.0, 0.0], colour=0, style="thin dotted")
        panel.line(times_s, getattr(track.errors, column), colour=1 + index % COLOURS)
    return panel


def _inner_panel(tracks: Tracks, name: str) -> Panel:
    panel = Panel(name.replace("_", "\u00a0"))
    panel.small = True
    robots = list(tracks.robots)
    for place, series in tracks.inner[name].items():
        panel.line(series.times_s, series.values, colour=1 + robots.index(place) % COLOURS, style="thin")
    return panel


def _box(columns: int, column: int, top: float, height: float) -> PanelBox:
    width = (WIDTH - LEFT - RIGHT - GAP * (columns - 1)) / columns
    return PanelBox(LEFT + column * (width + GAP), top, width, height)


def _heading(scenario: str, seed: int, title: str, errors: Sequence[ErrorSample]) -> tuple[str, str]:
    tracking = tracking_of(errors)
    rms = f"{rms_name(errors)} {tracking.rms_position_cm:.2f} cm, {tracking.rms_theta_deg:.2f} degrees"
    first = f"{scenario}, seed {seed}" + (f": {title}" if title else "")
    return first, f"{rms}; {settling_text(errors)}"
