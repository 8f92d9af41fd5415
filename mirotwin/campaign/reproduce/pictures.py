"""The five pictures: each figure of the paper twice, in truth and as the camera sees it, from the recordings.

The same recordings give the same bytes: fixed size, fixed fonts, no date.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from miro_exact.clock import seconds
from mirotwin.recording.reader import read
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, Errors, Track
from mirotwin.report.figure import STYLE
from mirotwin.report.seen import Seen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#1f5fa8", "#c8452d", "#2e8b57", "#8a5bb0")
REFERENCE = "#222222"
SIZE_INCHES = (9.6, 9.0)
MARGINS = {"left": 0.08, "right": 0.98, "top": 0.92, "bottom": 0.05, "hspace": 0.42, "wspace": 0.2}


class Course(NamedTuple):
    """One recorded run: its name in the legend, its track, and errors as the camera sees them."""

    name: str
    track: Track
    seen: Errors


def course(name: str, path: str | Path, delay_frames: int) -> Course:
    """The first robot of a recording. `delay_frames`: of a camera whose measurements bear no tick."""
    track, seen = Track(), Seen(delay_frames)
    for period in read(path).periods:
        track.add(period.robots[0], period.tick)
        seen.add(period.robots[0], period.tick)
    return Course(name, track, seen.errors)


def draw(path: Path, title: str, courses: Sequence[Course]) -> None:
    """Writes the PNG: left in truth, right as the camera sees it."""
    import matplotlib.style  # here, because it takes longer to load than all the rest of the program

    with matplotlib.style.context(STYLE, after_reset=True):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=SIZE_INCHES, dpi=110)
        canvas = FigureCanvasAgg(figure)
        grid = figure.add_gridspec(4, 2, height_ratios=[2.0, 1.0, 1.0, 1.0], **MARGINS)
        figure.suptitle(title.replace("$", r"\$"), fontsize=11)
        axes = [[figure.add_subplot(grid[row, side]) for row in range(4)] for side in (0, 1)]
        for side, name in enumerate(("in truth", "as the camera sees it")):
            _draw_path(axes[side][0], f"(a)  x-y [cm], {name}", courses, bool(side))
            for row, (title, unit, band, values) in enumerate(
                (
                    ("(b)  $x_e$", "cm", SETTLED_CM, "x_cm"),
                    ("(c)  $y_e$", "cm", SETTLED_CM, "y_cm"),
                    (r"(d)  $\theta_e$", "rad", SETTLED_RAD, "theta_rad"),
                )
            ):
                _draw_error(axes[side][row + 1], title, unit, band, values, courses, bool(side))
        for row in range(1, 4):
            low = min(axes[side][row].get_ylim()[0] for side in (0, 1))
            high = max(axes[side][row].get_ylim()[1] for side in (0, 1))
            for side in (0, 1):
                axes[side][row].set_ylim(low, high)
        canvas.print_png(path, metadata={"Software": None}, pil_kwargs={"compress_level": 9})  # type: ignore[no-untyped-call]


def _draw_path(axes: Axes, title: str, courses: Sequence[Course], seen: bool) -> None:
    reference = courses[0].track.reference
    axes.plot(
        reference.x_cm, reference.y_cm, color=REFERENCE, linestyle=":", linewidth=1.2, label="reference"
    )
    for colour, one in zip(COLOURS, courses, strict=False):
        points = one.track.seen if seen else one.track.truth
        axes.plot(points.x_cm, points.y_cm, color=colour, linewidth=1.2, label=one.name)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title)
    if not seen:
        axes.legend(fontsize=7.5, loc="best")


def _draw_error(
    axes: Axes, title: str, unit: str, band: float, values: str, courses: Sequence[Course], seen: bool
) -> None:
    axes.axhspan(-band, band, color="#f0f0f0", zorder=0)
    for colour, one in zip(COLOURS, courses, strict=False):
        errors = one.seen if seen else one.track.errors
        axes.plot(
            [seconds(tick) for tick in errors.ticks], getattr(errors, values), color=colour, linewidth=1.1
        )
    axes.margins(x=0)
    axes.set_title(f"{title} [{unit}] against t [s]   (shaded: within {band:g} {unit})")
