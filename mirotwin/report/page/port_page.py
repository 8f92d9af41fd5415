"""The page of a talk with robots at a port: their answers beside their twin's, and the differences."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from mirotwin.desk.compare import FIELDS
from mirotwin.recording.difference import Difference
from mirotwin.recording.sequences import LogEntry, Pair
from mirotwin.report.page.document import render
from mirotwin.runs.at_port import beside_twin
from mirotwin.runs.job import Job
from mirotwin.shell.progress import ProgressBar

FIRST = 200
"""Differences that are listed."""
SHOWN = {"left moved": "counts", "right moved": "counts", "flags": "", "accepted": "", "rejected": ""}
"""Channels that are drawn, and their units: flags as they are, others from the first answer on."""


def port_page(job: Job, quiet: bool) -> bytes:
    """The page of a recording made at a port. Raises BadInput where Bokeh is not installed."""
    end_tick = len(job.recorded) * CONTROL_PERIOD_TICKS
    end_s = seconds(end_tick)
    with ProgressBar("running the twin", end_tick, quiet) as bar:
        comparison = beside_twin(job, progress=bar.to)
    figures = {
        f"plot-{slot}-{channel.replace(' ', '-')}": _figure(
            pairs, channel, end_s, _marks(comparison.differences, slot, channel)
        )
        for slot, pairs in comparison.robots.items()
        for channel in SHOWN
    }
    values = {
        "file": Path(job.spec.origin).name,
        "firmware": job.spec.image.sha256 or "",
        "scenario": job.spec.scenario.name,
        "duration_s": end_s,
        "found": comparison,
        "shown": SHOWN,
        "differences": comparison.differences[:FIRST],
    }
    return render("port.html", figures, msgspec.json.encode({}), values)


def _marks(differences: Sequence[Difference], slot: int, channel: str) -> list[float]:
    """Times at which robot and twin differ in the channel."""
    parted = [
        difference
        for difference in differences
        if difference.slot == slot and difference.channel in ("answer", channel)
    ]
    return list(dict.fromkeys(seconds(difference.tick) for difference in parted))[:FIRST]


def _figure(pairs: Sequence[Pair], channel: str, end_s: float, marks: list[float]) -> Any:
    from bokeh.models import Range1d

    from mirotwin.report.page.axes import add_failures, panel, tagged

    made = panel(SHOWN[channel], Range1d(start=0.0, end=end_s, bounds=(0.0, end_s)), x_label="t [s]")
    for side, colour, width in ((1, "robot1", 4.0), (0, "robot0", 1.5)):
        answers = [answer for pair in pairs if (answer := pair[side])]
        times = [seconds(answer.tick) for answer in answers]
        line = made.step(times, _course(answers, channel), mode="after", line_width=width)
        tagged(line.glyph, line_color=colour)
    add_failures(made, marks)
    return made


def _course(answers: Sequence[LogEntry], channel: str) -> list[int]:
    """The channel from answer to answer; increments are summed."""
    take, _ = FIELDS[channel]
    if channel == "flags":
        return [int(answer.item.flags) for answer in answers]
    return list(
        accumulate((take(answer.item, other.item) for answer, other in pairwise(answers)), initial=0)
    )[: len(answers)]
