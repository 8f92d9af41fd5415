"""The common look of all figures: frame, axes, grid, tools, and colours by name."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import BoxZoomTool, NoOverlap, PanTool, Range1d, ResetTool, Span, WheelZoomTool
from bokeh.plotting import figure

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif"
SIZE = "11px"
CURSOR = "cursor"
ROBOT_COLOURS = ("robot0", "robot1", "robot2", "robot3", "robot4")


def panel(y_label: str, x_range: Any, height: int = 190, x_label: str = "", **more: Any) -> Any:
    """A figure that is as wide as its place. Time goes along x: wheel and drag move and stretch that alone."""
    made = figure(
        height=height,
        sizing_mode="stretch_width",
        min_width=200,
        x_range=x_range,
        tools=[],
        toolbar_location="above",
        output_backend="canvas",
        lod_threshold=None,
        **more,
    )
    zoom = BoxZoomTool(dimensions="width")
    made.add_tools(zoom, PanTool(dimensions="width"), WheelZoomTool(dimensions="width"), ResetTool())
    made.toolbar.logo = None
    made.toolbar.autohide = True
    made.toolbar_inner = True
    made.toolbar.active_drag = None
    made.toolbar.active_scroll = None
    made.background_fill_alpha = made.border_fill_alpha = 0.0
    made.outline_line_color = None
    made.min_border_right = 10
    made.min_border_left = 64
    made.min_border_top = 6
    for axis, label in ((made.xaxis[0], x_label), (made.yaxis[0], y_label)):
        _style(axis, label)
    for grid in (made.xgrid[0], made.ygrid[0]):
        grid.tags = ["grid_line_color=grid"]
    made.xgrid[0].visible = False
    made.xaxis[0].major_label_policy = NoOverlap(min_distance=8)  # in a narrow window
    if hasattr(made.yaxis[0].ticker, "desired_num_ticks"):  # not for lanes
        made.yaxis[0].ticker.desired_num_ticks = 5
    return made


def _style(axis: Any, label: str) -> None:
    axis.axis_label = label or None
    axis.axis_label_text_font = axis.major_label_text_font = FONT
    axis.axis_label_text_font_size = axis.major_label_text_font_size = SIZE
    axis.axis_label_text_font_style = "normal"
    axis.axis_label_standoff = 6
    axis.minor_tick_line_color = None
    axis.major_tick_in, axis.major_tick_out = 0, 4
    axis.tags = [
        "axis_line_color=rule",
        "major_tick_line_color=rule",
        "major_label_text_color=muted",
        "axis_label_text_color=muted",
    ]


def time_range(times_s: list[float], period_s: float) -> Range1d:
    """The range from the first period to the end of the last one; tools cannot leave it."""
    first, last = (times_s[0], times_s[-1] + period_s) if times_s else (0.0, 1.0)
    return Range1d(start=first, end=last, bounds=(first, last), min_interval=period_s / 8)


def at_least(span: float, *columns: Any) -> tuple[float, float] | None:
    """Ends of an axis that is `span` wide, where the numbers vary by less: an axis never shows rounding noise."""
    values = np.concatenate([np.asarray(column, dtype=np.float64) for column in columns])
    values = values[np.isfinite(values)]
    if not values.size or values.max() - values.min() >= span:
        return None
    middle = (values.max() + values.min()) / 2.0
    return float(middle - span / 2.0), float(middle + span / 2.0)


def tagged(model: Any, **colours: str) -> Any:
    """Puts the names of a model's colours into its tags."""
    model.tags = [*model.tags, *(f"{name}={colour}" for name, colour in colours.items())]
    return model


def add_cursor(made: Any) -> None:
    """The line at the time that the page shows."""
    line = Span(location=0.0, dimension="height", line_width=1.0, tags=[CURSOR], level="overlay")
    made.add_layout(tagged(line, line_color="cursor"))


def add_failures(made: Any, times_s: list[float]) -> None:
    """Lines where checks failed."""
    for time_s in times_s:
        line = Span(location=time_s, dimension="height", line_width=1.0, line_dash="dashed", level="underlay")
        made.add_layout(tagged(line, line_color="bad"))
