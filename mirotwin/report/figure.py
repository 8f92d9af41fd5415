"""The picture of a run: the four panels of the paper's Figs. 6 to 10, and below them the laws' inner values.

The same run gives the same bytes: fixed size, fixed fonts, no date.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from miro_exact.clock import seconds
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, Errors, ErrorSample, Line, Place, Track, Tracks
from mirotwin.report.summary import rms_name, settling_text, tracking_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#1f5fa8", "#c8452d", "#2e8b57", "#8a5bb0", "#b07d12")
REFERENCE = "#222222"
COLUMNS = 4
MOST_INNER = 8
"""So many inner values are drawn; a recording holds them all."""
WIDTH_INCHES = 9.6
PANEL_INCHES = 2.5
INNER_INCHES = 1.25
LEFT_INCHES, RIGHT_INCHES, TOP_INCHES, BOTTOM_INCHES = 0.7, 0.15, 0.85, 0.3
GAP_INCHES = 0.7
"""Between panels, for titles, labels and numbers. A layout that is computed from them takes as long as the drawing."""
STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.edgecolor": "#777777",
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "agg.path.chunksize": 500,  # points that are drawn at once: 5000 of a noisy line take 6 MB
}


def draw(tracks: Tracks, path: Path, *, scenario: str, seed: int, title: str = "") -> None:
    """Writes the PNG; raises ValueError when there is no period to draw."""
    errors = {place: track.errors for place, track in tracks.robots.items()}
    if not errors:
        raise ValueError("nothing to draw: the run has no control period")
    import matplotlib.style  # here, because it takes longer to load than all the rest of the program

    with matplotlib.style.context(STYLE, after_reset=True):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        inner = {name: tracks.inner[name] for name in list(tracks.inner)[:MOST_INNER]}
        rows = -(-len(inner) // COLUMNS)
        heights = [PANEL_INCHES, PANEL_INCHES, *[INNER_INCHES] * rows]
        height = sum(heights) + GAP_INCHES * (len(heights) - 1) + TOP_INCHES + BOTTOM_INCHES
        figure = Figure(figsize=(WIDTH_INCHES, height), dpi=150)
        canvas = FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2 + rows, COLUMNS, height_ratios=heights, **_margins(heights, height))
        half = COLUMNS // 2
        places = [(row, side) for row in (0, 1) for side in (slice(half), slice(half, None))]
        path_axes, *error_axes = [figure.add_subplot(grid[place]) for place in places]
        figure.suptitle(
            _heading(scenario, seed, title, next(iter(errors.values()))),
            fontsize=10.5,
            y=1.0 - 0.12 / height,
            va="top",
        )
        _draw_path(path_axes, tracks.robots)
        _draw_error(error_axes[0], errors, "(b)  $x_e$", "cm", SETTLED_CM, lambda one: one.x_cm)
        _draw_error(error_axes[1], errors, "(c)  $y_e$", "cm", SETTLED_CM, lambda one: one.y_cm)
        _draw_error(error_axes[2], errors, r"(d)  $\theta_e$", "rad", SETTLED_RAD, lambda one: one.theta_rad)
        for index, (name, lines) in enumerate(inner.items()):
            axes = figure.add_subplot(grid[2 + index // COLUMNS, index % COLUMNS])
            _draw_inner(axes, name, lines, list(errors))
        canvas.print_png(path, metadata={"Software": None}, pil_kwargs={"compress_level": 3})  # type: ignore[no-untyped-call]


def _margins(heights: Sequence[float], height: float) -> dict[str, float]:
    """Where the panels are, in the terms of a GridSpec: gaps are parts of the mean panel."""
    width = WIDTH_INCHES - LEFT_INCHES - RIGHT_INCHES - GAP_INCHES * (COLUMNS - 1)
    return {
        "left": LEFT_INCHES / WIDTH_INCHES,
        "right": 1.0 - RIGHT_INCHES / WIDTH_INCHES,
        "top": 1.0 - TOP_INCHES / height,
        "bottom": BOTTOM_INCHES / height,
        "wspace": GAP_INCHES * COLUMNS / width,
        "hspace": GAP_INCHES * len(heights) / sum(heights),
    }


def _heading(scenario: str, seed: int, title: str, errors: Sequence[ErrorSample]) -> str:
    tracking = tracking_of(errors)
    rms = f"{rms_name(errors)} {tracking.rms_position_cm:.2f} cm, {tracking.rms_theta_deg:.2f} degrees"
    first = f"{scenario}, seed {seed}" + (f": {_plain(title)}" if title else "")
    return f"{first}\n{rms}; {settling_text(errors)}"


def _plain(text: str) -> str:
    """Text that matplotlib prints as it stands."""
    return text.replace("$", r"\$")


def _draw_path(axes: Axes, robots: dict[Place, Track]) -> None:
    for index, (place, track) in enumerate(robots.items()):
        colour = COLOURS[index % len(COLOURS)]
        first = index == 0
        axes.plot(
            track.seen.x_cm,
            track.seen.y_cm,
            linestyle="none",
            marker=".",
            markersize=2.5,
            color=colour,
            alpha=0.35,
            label="camera" if first else None,
        )
        reference, truth = track.reference, track.truth
        label = "reference" if first else None
        axes.plot(reference.x_cm, reference.y_cm, ":", color=REFERENCE, label=label)
        axes.plot(truth.x_cm, truth.y_cm, color=colour, label=_label(place, list(robots)))
        axes.plot(truth.x_cm[0], truth.y_cm[0], "o", color=colour, markersize=5, markerfacecolor="white")
    axes.set_title("(a)  x-y, from the circle")
    axes.set_xlabel("x [cm]")
    axes.set_ylabel("y [cm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="best", fontsize=8)


def _draw_error(
    axes: Axes,
    errors: dict[Place, Errors],
    title: str,
    unit: str,
    band: float,
    value_of: Callable[[ErrorSample], float],
) -> None:
    axes.axhspan(-band, band, color="#f0f3f7", linewidth=0, zorder=0)
    axes.axhline(0.0, linestyle=":", color=REFERENCE, linewidth=1.0)
    for index, samples in enumerate(errors.values()):
        times = [seconds(one.tick) for one in samples]
        axes.plot(times, [value_of(one) for one in samples], color=COLOURS[index % len(COLOURS)])
    axes.margins(x=0)
    axes.set_title(f"{title}   (shaded: within {band:g} {unit})")
    axes.set_xlabel("t [s]")
    axes.set_ylabel(f"{title.split('  ')[1]} [{unit}]")


def _draw_inner(axes: Axes, name: str, lines: dict[Place, Line], places: Sequence[Place]) -> None:
    for place, line in lines.items():
        axes.plot(line.times_s, line.values, color=COLOURS[places.index(place) % len(COLOURS)], linewidth=1.0)
    axes.margins(x=0)
    axes.set_title(_plain(name))
    axes.tick_params(labelsize=7, labelbottom=False)  # time as in the panels above
    axes.locator_params(nbins=3)  # labels are most of the time that a panel takes to draw


def _label(place: Place, places: Sequence[Place]) -> str:
    return "robot" if len(places) == 1 else f"robot {place[0]}/{place[1]}"
