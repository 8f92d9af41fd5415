"""The figures of a run against time: errors, speeds, wheels, and the air.

All share one range of time. A renderer of one robot has the tag `robot:N`, its place among the robots; the page shows
those of one robot at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.models import BoxAnnotation, ColumnDataSource, FactorRange

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD
from mirotwin.report.page.axes import add_cursor, add_failures, at_least, panel, tagged, time_range
from mirotwin.report.page.link import LinkMark, lanes_of
from mirotwin.report.page.tracks import SIDES, PageTracks

PERIOD_S = seconds(CONTROL_PERIOD_TICKS)
MOST_FAILURES = 20
"""Largest number of failures that are marked; the table has more."""
KIND_COLOURS = {
    "noise": "noise",
    "open": "rule",
    "sent": "muted",
    "raw": "measured",
    "fresh": "good",
    "repeated": "repeated",
    "answer": "truth",
    "action": "measured",
    "stopped": "warn",
    "off": "bad",
    "damaged": "bad",
    "lost": "lost",
}
"""Colours of the kinds of marks, in drawing order: failures are drawn last, on top."""
HEIGHTS = {"noise": 0.26, "damaged": 0.94, "lost": 0.94}
"""Heights of marks as a share of their lane; 0.6 for all others."""
LEAST_M_S, LEAST_RAD_S = 0.01, 0.1
"""The least that an axis of speeds spans: some forty steps of the encoder over a control period, at the wheel."""
HOLLOW, WRONG = ("lost",), ("damaged", "lost")
Figures = dict[str, Any]


def figures_of(tracks: PageTracks, marks: Sequence[LinkMark], failure_ticks: Sequence[int]) -> Figures:
    """All figures by the id of their element."""
    times = time_range(tracks.times_s, PERIOD_S)
    made: Figures = {}
    if any(robot.steered for robot in tracks.robots):
        made["plot-position"] = _errors(tracks, times, "position error [cm]", SETTLED_CM, position_of)
        made["plot-heading"] = _errors(tracks, times, "heading error [rad]", SETTLED_RAD, heading_of)
    made["plot-v"] = _speeds(tracks, times, "v [m/s]", "v_m_s", LEAST_M_S)
    made["plot-w"] = _speeds(tracks, times, "\u03c9 [rad/s]", "w_rad_s", LEAST_RAD_S)
    for side in SIDES:
        made[f"plot-{side}"] = _wheel(tracks, times, side)
    if marks:
        made["plot-link"] = lanes_figure(marks, times)
    marked = list(dict.fromkeys(tick / TICKS_PER_SECOND for tick in failure_ticks))[:MOST_FAILURES]
    for figure in made.values():
        add_failures(figure, marked)
        add_cursor(figure)
        if figure.y_range.__class__.__name__ == "DataRange1d":
            figure.y_range.only_visible = True
    return made


def position_of(errors: Any) -> Any:
    x_cm, y_cm = np.array(errors.x_cm), np.array(errors.y_cm)
    return np.sqrt(x_cm * x_cm + y_cm * y_cm)


def heading_of(errors: Any) -> Any:
    return np.array(errors.theta_rad)


def _errors(tracks: PageTracks, times: Any, label: str, band: float, value_of: Callable[[Any], Any]) -> Any:
    made = panel(label, times, x_label="t [s]")
    low = 0.0 if value_of is position_of else -band
    shaded = BoxAnnotation(bottom=low, top=band, fill_alpha=1.0, line_color=None, level="underlay")
    made.add_layout(tagged(shaded, fill_color="band"))
    for number, robot in enumerate(tracks.robots):
        points = {"t": seconds_at(robot.measured_errors.ticks), "value": value_of(robot.measured_errors)}
        dots = made.scatter(
            "t", "value", source=ColumnDataSource(points), size=3.5, line_color=None, fill_alpha=0.7
        )
        _of_robot(dots, number, fill_color="measured")
        truth = {"t": seconds_at(robot.errors.ticks), "value": value_of(robot.errors)}
        line(made, number, ColumnDataSource(truth), "value", "truth", 1.8)
    return made


def _speeds(tracks: PageTracks, times: Any, label: str, name: str, least: float) -> Any:
    made = panel(label, times, x_label="t [s]")
    for number, robot in enumerate(tracks.robots):
        columns = {"truth": np.array(getattr(robot, name)), "told": np.array(getattr(robot, f"told_{name}"))}
        source = ColumnDataSource({"t": seconds_at(tracks.ticks), **columns})
        line(made, number, source, "told", "told", 1.4, mode="after")
        line(made, number, source, "truth", "truth", 1.8)
        widen(made, number, tracks, least, columns["truth"], columns["told"])
    return made


def _wheel(tracks: PageTracks, times: Any, side: str) -> Any:
    made = panel(f"{side} [m/s]", times, x_label="t [s]")
    for number, robot in enumerate(tracks.robots):
        wheel, fine = robot.wheels[side], robot.fine[side]
        period_times = seconds_at(tracks.ticks)
        columns = {"told": np.array(wheel.commanded), "actual": np.array(wheel.actual)}
        source = ColumnDataSource({"t": period_times, **columns})
        of_profile = (fine.times_s, fine.values) if len(fine.values) else (period_times, wheel.profile)
        profile = ColumnDataSource({"t": np.array(of_profile[0]), "profile": np.array(of_profile[1])})
        line(made, number, source, "told", "told", 1.0, mode="after")
        line(made, number, profile, "profile", "profile", 1.6)
        line(made, number, source, "actual", "truth", 1.6)
        widen(made, number, tracks, LEAST_M_S, columns["told"], columns["actual"], of_profile[1])
    return made


def widen(made: Any, number: int, tracks: PageTracks, least: float, *columns: Any) -> None:
    """Makes the axis of one robot span `least` where its numbers vary by less: by two invisible points."""
    if (ends := at_least(least, *columns)) is not None:
        source = ColumnDataSource({"t": [tracks.times_s[0]] * 2, "value": list(ends)})
        points = made.scatter("t", "value", source=source, size=0, line_color=None, fill_alpha=0.0)
        _of_robot(points, number)


def lanes_figure(
    marks: Sequence[LinkMark],
    times: Any,
    seconds_of: Callable[[Any], Any] | None = None,
    colours: Mapping[str, str] = KIND_COLOURS,
) -> Any:
    """Marks on their lanes. `seconds_of` ticks of another crystal than the robot's; `colours` of other kinds."""
    lanes, seconds_of = lanes_of(marks), seconds_of or seconds_at
    made = panel(
        "",
        times,
        height=64 + 26 * len(lanes),
        x_label="t [s]",
        y_range=FactorRange(factors=list(reversed(lanes))),
    )
    made.yaxis[0].major_label_text_align = "left"
    made.ygrid[0].visible = False
    made.min_border_left = 120
    for kind, colour in colours.items():
        shown = [mark for mark in marks if mark.kind == kind]
        if not shown:
            continue
        source = ColumnDataSource(
            {
                "lane": [mark.lane for mark in shown],
                "left": seconds_of([mark.start_tick for mark in shown]),
                "right": seconds_of([mark.end_tick for mark in shown]),
            }
        )
        bars = made.hbar(y="lane", left="left", right="right", source=source, name=f"link:{kind}")
        bars.glyph.height = HEIGHTS.get(kind, 0.6)
        bars.glyph.line_width = 2.0 if kind in WRONG else 1.0
        alpha = 0.0 if kind in HOLLOW else 1.0
        bars.glyph.fill_alpha = alpha
        tagged(bars.glyph, fill_color=colour, line_color=colour)
    return made


def line(made: Any, number: int, source: Any, name: str, colour: str, width: float, **step: str) -> None:
    """A column against time; `mode`: in steps."""
    draw = made.step if step else made.line
    _of_robot(draw("t", name, source=source, line_width=width, **step), number, line_color=colour)


def _of_robot(renderer: Any, number: int, **colours: str) -> None:
    renderer.tags = [f"robot:{number}"]
    renderer.visible = number == 0
    tagged(renderer.glyph, **colours)


def seconds_at(ticks: Any) -> Any:
    return np.array(ticks, dtype=np.float64) / TICKS_PER_SECOND
