"""The page of a talk with robots at a port: what they answered beside what their twin answered, and where they part."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.frames import TelemetryFrame
from miro_protocol.table import TICKS_PER_MS
from miro_robot.image import Image
from mirotwin.desk.compare import AnswerTolerance, PortComparison, RobotBesideTwin, compare
from mirotwin.report.page.document import render
from mirotwin.rerun.job import Job, rerun_job
from mirotwin.shell.progress import ProgressBar

FIRST = 200
"""Differences that are listed."""
_WRAPS = {"position_left": 1 << 16, "position_right": 1 << 16, "accepted": 1 << 8, "rejected": 1 << 8}
_SHOWN: tuple[tuple[str, str, str], ...] = (
    ("left position [counts]", "position_left", "left moved"),
    ("right position [counts]", "position_right", "right moved"),
    ("flags", "flags", "flags"),
    ("accepted", "accepted", "accepted"),
    ("rejected", "rejected", "rejected"),
)
"""Heading, field of an answer, and the channel whose differences are marked; those of whole answers are in all."""


def port_page(job: Job, image: Image, file: str, quiet: bool) -> bytes:
    """The page of a recording made at a port. Raises BadInput where Bokeh is not installed."""
    end_tick = len(job.recorded) * CONTROL_PERIOD_TICKS
    with ProgressBar("running the twin", end_tick, quiet) as bar:
        again = rerun_job(job, image, file, end_tick, bar.to)
    robots = job.scenario.networks[0].robots
    found = compare(job.recorded, again.periods, robots, AnswerTolerance())
    figures = {
        f"plot-{robot.slot}-{name}": _figure(
            robot, label, name, seconds(end_tick), _marks(found, robot.slot, channel)
        )
        for robot in found.robots
        for label, name, channel in _SHOWN
    }
    values = {
        "file": Path(file).name,
        "firmware": image.sha256 or "",
        "scenario": job.scenario.name,
        "duration_s": seconds(end_tick),
        "robots": found.robots,
        "shown": _SHOWN,
        "answers": sum(1 for robot in found.robots for pair in robot.pairs if pair.port),
        "unsure_ms": max((robot.unsure_ticks for robot in found.robots), default=0) / TICKS_PER_MS,
        "count": len(found.differences),
        "differences": found.differences[:FIRST],
        "silent": found.silent,
        "not_judged": found.not_judged,
    }
    return render("port.html", figures, msgspec.json.encode({}), values)


def _marks(found: PortComparison, slot: int, channel: str) -> list[float]:
    """When robot and twin part in the channel."""
    parted = [one for one in found.differences if one.slot == slot and one.channel in ("answer", channel)]
    return list(dict.fromkeys(seconds(one.tick) for one in parted))[:FIRST]


def _figure(robot: RobotBesideTwin, label: str, name: str, end_s: float, marks: list[float]) -> Any:
    from bokeh.models import Range1d

    from mirotwin.report.page.axes import add_failures, panel, tagged

    made = panel(label, Range1d(start=0.0, end=end_s, bounds=(0.0, end_s)), x_label="t [s]")
    both = [(pair.port, pair.twin) for pair in robot.pairs]
    for answers, colour, width in (
        ([twin for _, twin in both if twin], "robot1", 4.0),
        ([port for port, _ in both if port], "robot0", 1.5),
    ):
        times = [seconds(one.tick) for one in answers]
        values = _unwrapped([one.said for one in answers], name)
        line = made.step(times, values, mode="after", line_width=width)
        tagged(line.glyph, line_color=colour)
    add_failures(made, marks)
    return made


def _unwrapped(said: Sequence[TelemetryFrame], name: str) -> list[int]:
    """Values from the first answer on, positions and counters without their wraps."""
    numbers = [int(getattr(one, name)) for one in said]
    modulus = _WRAPS.get(name)
    if modulus is None or not numbers:
        return numbers
    half = modulus // 2 if name.startswith("position") else 0
    values = [0]
    for before, after in pairwise(numbers):
        values.append(values[-1] + (after - before + half) % modulus - half)
    return values
