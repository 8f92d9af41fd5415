"""The figures of a board's run against time: events, nets as lanes, values of parts. All share one time range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.core.properties import value
from bokeh.models import ColumnDataSource, FixedTicker, Range1d

from mirotwin.report.page.axes import (
    FONT,
    ROBOT_COLOURS,
    SIZE,
    add_cursor,
    add_failures,
    at_least,
    panel,
    tagged,
)
from mirotwin.report.page.board_watch import Changed, Wave
from mirotwin.report.page.link import LinkMark
from mirotwin.report.page.plots import MOST_FAILURES, lanes_figure

LANE_PX = 24
HIGH, LOW = 0.36, -0.3
"""Heights of the levels in a lane; lanes are 1 apart."""
FINEST_S = 20e-6
"""The shortest time that fills a figure: two characters at 1 Mbaud, some instructions."""
LABEL, LABEL_PX = 20, 136
"""Characters of a lane's name that there is room for, and that room, the same in all figures."""
LEAST_SHARE, LEAST = 0.01, 0.001
"""Smallest span of an axis of values: as a share of the largest value, and absolute."""
TEXT_SHARE, TEXT_ALPHA = 0.011, 0.3
"""The share of a figure's width that a character takes."""


class Window:
    """The ticks that a page shows, and their conversion to seconds."""

    def __init__(self, first_tick: int, end_tick: int, clock: int) -> None:
        self.first_tick, self.end_tick, self.clock = first_tick, end_tick, clock
        self.span = end_tick - first_tick
        ends = first_tick / clock, end_tick / clock
        self.times = Range1d(start=ends[0], end=ends[1], bounds=ends, min_interval=FINEST_S)

    def seconds(self, ticks: Any) -> Any:
        return np.asarray(ticks, dtype=np.float64) / self.clock


def board_figures(
    window: Window,
    marks: Sequence[LinkMark],
    pins: Sequence[Wave],
    curves: Sequence[Sequence[Changed]],
    states: Sequence[LinkMark],
    failure_ticks: Sequence[int],
) -> dict[str, Any]:
    """All figures by the id of their element."""
    made = {f"plot-value-{number}": _curves(together, window) for number, together in enumerate(curves)}
    if marks:
        made["plot-events"] = lanes_figure(marks, window.times, window.seconds)
    if pins:
        made["plot-pins"] = _waves(pins, window)
    if states:
        made["plot-states"] = _states(states, window)
    for figure in made.values():
        add_failures(figure, window.seconds(failure_ticks[:MOST_FAILURES]).tolist())
        add_cursor(figure)
        figure.min_border_left = LABEL_PX
        if figure.y_range.__class__.__name__ == "DataRange1d":
            figure.y_range.only_visible = True
    return made


def _waves(waves: Sequence[Wave], window: Window) -> Any:
    """Lanes as of a logic analyser, the first on top; stretches with edges too close to be drawn are filled."""
    count = len(waves)
    height, rows = 56 + LANE_PX * count, Range1d(-0.6, count - 0.4)
    made = panel("", window.times, height, "t [s]", y_range=rows)
    made.yaxis[0].ticker = FixedTicker(ticks=list(range(count)))
    made.yaxis[0].major_label_overrides = {count - 1 - row: _label(wave) for row, wave in enumerate(waves)}
    made.ygrid[0].visible = False
    for row, wave in enumerate(waves):
        _wave(made, wave, count - 1 - row, window)
    return made


def _label(wave: Wave) -> str:
    """The name of a net with the pins on it: P1.1 eyes.trig."""
    text = " ".join([wave.name, *wave.on_it[:1]])
    return text if len(text) <= LABEL else f"{text[: LABEL - 1]}\u2026"


def _wave(made: Any, wave: Wave, row: int, window: Window) -> None:
    alone, close = wave.drawn(window.span)
    ticks = np.concatenate(
        ([window.first_tick], np.sort(np.concatenate((alone, close.ravel()))), [window.end_tick])
    )
    levels = wave.level + np.searchsorted(wave.ticks, ticks, side="right") & 1
    heights = np.where(levels, row + HIGH, row + LOW)
    heights[np.isin(ticks, close[:, 0])] = np.nan  # up to the end of that stretch
    source = ColumnDataSource({"t": window.seconds(ticks), "level": heights})
    tagged(made.step("t", "level", source=source, line_width=1.2, mode="after").glyph, line_color="truth")
    ends = {"left": window.seconds(close[:, 0]), "right": window.seconds(close[:, 1])}
    bars = made.quad("left", "right", row + HIGH, row + LOW, source=ColumnDataSource(ends), fill_alpha=0.45)
    tagged(bars.glyph, fill_color="truth", line_color="truth")


def _states(states: Sequence[LinkMark], window: Window) -> Any:
    """Texts and on-states as bars, with text if there is room in a wide window; the page hides it otherwise."""
    made = lanes_figure(states, window.times, window.seconds, {colour: colour for colour in ROBOT_COLOURS})
    for bars in made.renderers:
        bars.glyph.fill_alpha = TEXT_ALPHA
    share = window.span * TEXT_SHARE
    wide = [mark for mark in states if mark.end_tick - mark.start_tick > share * (2 + len(mark.text))]
    begins = window.seconds([mark.start_tick for mark in wide])
    columns = {"lane": [mark.lane for mark in wide], "t": begins, "text": [mark.text for mark in wide]}
    fonts = {"text_font": value(FONT), "text_font_size": value(SIZE), "text_baseline": value("middle")}
    names = made.text(
        "t", "lane", "text", source=ColumnDataSource(columns), x_offset=5, tags=["wide"], **fonts
    )
    tagged(names.glyph, text_color="ink")
    return made


def _curves(together: Sequence[Changed], window: Window) -> Any:
    """Values of one kind: each holds until its next change. Equal curves are drawn so that all are visible."""
    made = panel("", window.times, height=116)
    everything = np.concatenate([np.array(changed.values, dtype=np.float64) for changed in together])
    if (ends := at_least(max(LEAST_SHARE * np.abs(everything).max(), LEAST), everything)) is not None:
        made.y_range = Range1d(*ends)
    for number, changed in enumerate(together):
        values = np.array([*changed.values, changed.values[-1]], dtype=np.float64)
        source = ColumnDataSource({"t": window.seconds([*changed.ticks, window.end_tick]), "value": values})
        width = max(1.0, 2.6 - 0.7 * number)
        line = made.step("t", "value", source=source, line_width=width, mode="after")
        tagged(line.glyph, line_color=ROBOT_COLOURS[number])
    return made
