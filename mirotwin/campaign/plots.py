"""The figures of a campaign: the spread of a metric by arm, and differences of pairs.

An arm is all runs with the same levels. Its row has a dot for each run, a box over the middle half, whiskers from 5 to
95 %, and a stroke at the median. Dots are spread over the row by their number alone, so that a page is the same each
time.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, FactorRange, Range1d, Span

from mirotwin.campaign.comparison import MetricDifference
from mirotwin.campaign.rows import Arm
from mirotwin.campaign.statistics import Numbers
from mirotwin.report.page.axes import at_least, panel, tagged

MOST_DOTS = 1500
"""Of an arm; of more runs every second one is drawn, or every third, and so on."""
ROW = 34
LINE = 15
"""Height of a line of a label that does not fit into one."""
WIDEST = 22
"""Longest line of a label, in characters, so that a telephone has room for the plot."""
GOLDEN = 0.6180339887498949
LEAST = {"rms_position_cm": 0.01, "rms_theta_deg": 0.01, "settling_s": 0.05}
"""Smallest span of an axis, by the resolution of a metric; for differences it is LEAST_PERCENT."""
LEAST_PERCENT = 0.1


def spread(metric: str, arms: Sequence[tuple[Arm, Numbers]]) -> Any:
    """A row for each arm that has the metric, on one axis, with its numbers; runs without the metric are left out."""
    labels = [wrapped(arm.label) for arm, _ in arms]
    made = _rows(metric, labels)
    _dots(made, [(label, numbers) for label, (_, numbers) in zip(labels, arms, strict=True)])
    _widen(made, LEAST.get(metric, 0.0), *(numbers for _, numbers in arms))
    quantiles = [figures.quantiles for arm, _ in arms if (figures := arm.metrics[metric]) is not None]
    shares = {
        share: [quantile[share] for quantile in quantiles]
        for share in ("0.05", "0.25", "0.5", "0.75", "0.95")
    }
    source = ColumnDataSource({"arm": labels, **shares})
    whisker = made.segment(x0="0.05", x1="0.95", y0="arm", y1="arm", source=source, line_width=1.4)
    tagged(whisker.glyph, line_color="ink")
    box = made.hbar(
        y="arm", left="0.25", right="0.75", height=0.5, source=source, line_width=1.4, fill_alpha=0.25
    )
    tagged(box.glyph, line_color="ink", fill_color="truth")
    median = made.hbar(y="arm", left="0.5", right="0.5", height=0.62, source=source, line_width=3.0)
    tagged(median.glyph, line_color="truth")
    return made


def apart(compared: Sequence[tuple[MetricDifference, Numbers]]) -> Any:
    """Differences in per cent of the first one's mean: each pair a dot, the mean with its interval."""
    shown = [
        (difference, numbers)
        for difference, numbers in compared
        if difference.first and difference.interval is not None
    ]
    labels = [difference.metric for difference, _ in shown]
    made = _rows("difference, % of the first's mean", labels)
    made.add_layout(tagged(Span(location=0.0, dimension="height", line_width=1.2), line_color="ink"))
    scale = [100.0 / abs(difference.first) for difference, _ in shown]
    numbers = [each * by for (_, each), by in zip(shown, scale, strict=True)]
    _dots(made, list(zip(labels, numbers, strict=True)))
    _widen(made, LEAST_PERCENT, [0.0], *numbers)
    intervals = [difference.interval for difference, _ in shown if difference.interval is not None]
    source = ColumnDataSource(
        {
            "arm": labels,
            "low": [difference.low * by for difference, by in zip(intervals, scale, strict=True)],
            "high": [difference.high * by for difference, by in zip(intervals, scale, strict=True)],
            "mean": [difference.difference * by for (difference, _), by in zip(shown, scale, strict=True)],
        }
    )
    interval = made.hbar(
        y="arm", left="low", right="high", height=0.34, source=source, fill_alpha=0.35, line_width=1.2
    )
    tagged(interval.glyph, line_color="truth", fill_color="truth")
    mean = made.scatter("mean", "arm", source=source, size=10, marker="diamond", line_color=None)
    tagged(mean.glyph, fill_color="truth")
    return made


def wrapped(label: str) -> str:
    """In lines that are no longer than WIDEST."""
    return "\n".join(textwrap.wrap(label, WIDEST)) or label


def _widen(made: Any, least: float, *columns: Any) -> None:
    if (ends := at_least(least, *columns)) is not None:
        made.x_range = Range1d(*ends)


def _rows(x_label: str, rows: Sequence[str]) -> Any:
    made = panel(
        "",
        DataRange1d(range_padding=0.04),
        height=64 + len(rows) * max(ROW, LINE * max(row.count("\n") + 1 for row in rows)),
        x_label=x_label,
        y_range=FactorRange(factors=list(reversed(rows))),
    )
    longest = max(len(line) for row in rows for line in row.split("\n"))
    made.min_border_left = 24 + 6 * longest
    made.ygrid[0].visible = False
    made.xgrid[0].visible = True
    return made


def _dots(made: Any, rows: Sequence[tuple[str, Numbers]]) -> None:
    values: list[float] = []
    places: list[tuple[str, float]] = []
    for label, numbers in rows:
        step = -(-len(numbers) // MOST_DOTS) or 1
        for number, value in enumerate(numbers[::step]):
            values.append(float(value))
            places.append((label, 0.56 * ((GOLDEN * (number + 1)) % 1.0 - 0.5)))
    source = ColumnDataSource({"value": np.array(values), "place": places})
    dots = made.scatter("value", "place", source=source, size=4, line_color=None, fill_alpha=0.45)
    tagged(dots.glyph, fill_color="measured")
