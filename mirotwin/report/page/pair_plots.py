"""The figures of two runs against time, drawn over each other: errors, distance, commands, speeds, wheels. The first
run is a broad line below, the second a narrow line above it, so both are visible where they are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource

from miro_exact.clock import seconds
from mirotwin.report.page.axes import add_cursor, add_failures, panel, time_range
from mirotwin.report.page.plots import (
    LEAST_M_S,
    LEAST_RAD_S,
    PERIOD_S,
    Figures,
    heading_of,
    line,
    position_of,
    seconds_at,
    widen,
)
from mirotwin.report.page.tracks import SIDES, PageTrack, PageTracks

Values = Callable[[PageTrack], Any]
STYLES = (("robot0", 3.6), ("robot1", 1.4))
LEAST_CM = 0.1


def pair_figures(first: PageTracks, other: PageTracks, marked: Sequence[int]) -> Figures:
    """All figures by the id of their element. `first`, `other`: the same robots; `marked`: ticks with a line."""
    longer = max(first, other, key=lambda tracks: len(tracks.ticks))
    times = time_range(longer.times_s, PERIOD_S)

    def curves(label: str, values: Values, least: float, **step: str) -> Any:
        made = panel(label, times, x_label="t [s]")
        for number, pair in enumerate(zip(first.robots, other.robots, strict=True)):
            columns = [np.asarray(values(robot)) for robot in pair]
            for tracks, column, (colour, width) in zip((first, other), columns, STYLES, strict=True):
                source = ColumnDataSource({"t": seconds_at(tracks.ticks), "value": column})
                line(made, number, source, "value", colour, width, **step)
            widen(made, number, longer, least, *columns)
        return made

    made: Figures = {}
    robots = [*first.robots, *other.robots]
    if any(robot.steered for robot in robots):
        made["plot-position"] = curves(
            "position error [cm]", lambda track: position_of(track.errors), LEAST_CM
        )
        made["plot-heading"] = curves(
            "heading error [rad]", lambda track: heading_of(track.errors), LEAST_RAD_S
        )
    made["plot-apart"] = _apart(first, other, times)
    if any(value == value for value in chain.from_iterable(robot.told_v_m_s for robot in robots)):
        made["plot-told-v"] = curves("v [m/s]", lambda track: track.told_v_m_s, LEAST_M_S, mode="after")
        made["plot-told-w"] = curves(
            "\u03c9 [rad/s]", lambda track: track.told_w_rad_s, LEAST_RAD_S, mode="after"
        )
    made["plot-v"] = curves("v [m/s]", lambda track: track.v_m_s, LEAST_M_S)
    made["plot-w"] = curves("\u03c9 [rad/s]", lambda track: track.w_rad_s, LEAST_RAD_S)
    for side in SIDES:
        profile = partial(_profile, side)
        made[f"plot-{side}"] = curves(f"{side} [m/s]", profile, LEAST_M_S)
    for figure in made.values():
        add_failures(figure, [seconds(tick) for tick in marked])
        add_cursor(figure)
        figure.y_range.only_visible = True
    return made


def _profile(side: str, robot: PageTrack) -> Any:
    return robot.wheels[side].profile


def _apart(first: PageTracks, other: PageTracks, times: Any) -> Any:
    """The distance between both places of each robot, as long as both runs go."""
    made = panel("distance [cm]", times, x_label="t [s]")
    shorter = min(first, other, key=lambda tracks: len(tracks.ticks))
    for number, (robot, twin) in enumerate(zip(first.robots, other.robots, strict=True)):
        count = len(shorter.ticks)
        x_m = np.array(robot.truth.x_m[:count]) - np.array(twin.truth.x_m[:count])
        y_m = np.array(robot.truth.y_m[:count]) - np.array(twin.truth.y_m[:count])
        source = ColumnDataSource(
            {"t": seconds_at(shorter.ticks), "value": 100.0 * np.sqrt(x_m * x_m + y_m * y_m)}
        )
        line(made, number, source, "value", "ink", 1.6)
        widen(made, number, shorter, LEAST_CM, source.data["value"])
    return made
