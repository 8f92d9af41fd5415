"""The curve of `mirotwin why`: its lines, its picture, and its page, which needs no network and no JavaScript."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import msgspec

from mirotwin.campaign.branches import Point
from mirotwin.report.page.document import ASSETS
from mirotwin.report.svg import Drawing, Panel, PanelBox

WIDTH, HEIGHT = 760, 380
BOX = PanelBox(66, 76, 670, 250)
OTHERS = "other robots"
COLUMNS = ("at", "fail", "of", "share", "95 % interval")


class Curve(msgspec.Struct, frozen=True, kw_only=True):
    """The failure rate of `run`'s branches at each of the `points`. `what`: name of the failure. `low`: index of the
    control period in which the rate passes one half, -1 if it is at least one half from the start. `others`: runs of
    other seeds, with other wheels and another calibration. `clock`: ticks per second.
    """

    run: str
    what: str
    clock: int
    period: int
    points: Sequence[Point]
    low: int
    others: Point

    @property
    def jump_tick(self) -> int:
        """First tick of the control period `low`."""
        return max(self.low, 0) * self.period

    def at(self, tick: int) -> Point:
        return next(point for point in self.points if point.tick == tick)

    def lines(self) -> list[str]:
        """The results, in lines of text."""
        first, others, clock = self.points[0], self.others, self.clock
        start = f"other noise from the start: {_of(first)} fail; {OTHERS} (other seeds): {_of(others)}"
        if self.low < 0:
            return [f"fails: {self.what}", "more likely than not from the start", start]
        end_tick = self.jump_tick + self.period
        shares = f"from {self.at(self.jump_tick).share:.2f} to {self.at(end_tick).share:.2f}"
        when = f"{seconds(self.jump_tick, clock)} to {seconds(end_tick, clock)}"
        certain = next((point for point in reversed(self.points) if point.share < 1.0), first)
        after = next((point.tick for point in self.points if point.tick > certain.tick), None)
        sure = "" if after is None else f"; all branches fail from {seconds(after, clock)} on"
        return [f"fails: {self.what}", f"decided in control period {self.low}, {when}: {shares}{sure}", start]


def _of(point: Point) -> str:
    return f"{point.count} of {len(point.failed)}"


def seconds(tick: int, clock: int) -> str:
    return f"{tick / clock:.3f} s"


def cells(curve: Curve) -> list[tuple[str, ...]]:
    """The rows of the table: the moments in their order, then the runs of other seeds."""
    named = [(seconds(moment.tick, curve.clock), moment) for moment in curve.points]
    rows: list[tuple[str, ...]] = []
    for name, point in (*named, (OTHERS, curve.others)):
        low, high = point.interval
        rows.append(
            (name, f"{point.count}", f"{len(point.failed)}", f"{point.share:.2f}", f"{low:.2f} to {high:.2f}")
        )
    return rows


def drawing(curve: Curve) -> Drawing:
    """The curve with its intervals; a dotted line where failing became more likely than not."""
    times = [point.tick / curve.clock for point in curve.points]
    panel = Panel("P(fail), other noise from there on; 95 % intervals", "t [s]", "share of branches")
    panel.y_range = (0.0, 1.0)
    for time, point in zip(times, curve.points, strict=True):
        panel.line([time, time], point.interval, colour=1, style="thin")
    panel.line(times, [point.share for point in curve.points], colour=1)
    jump = (curve.jump_tick + (curve.period if curve.low >= 0 else 0)) / curve.clock
    panel.line([jump, jump], [0.0, 1.0], colour=2, style="dotted")
    made = Drawing(WIDTH, HEIGHT, (curve.run, curve.what.partition(":")[0]))
    made.add(panel, BOX)
    return made


def page(curve: Curve, commands: Sequence[str]) -> bytes:
    """The page; the same curve gives the same bytes."""
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>\n" for row in cells(curve)
    )
    paragraphs = "".join(f"<p>{escape(line)}</p>\n" for line in curve.lines())
    style = (ASSETS / "page.css").read_text(encoding="utf-8")
    head = "".join(f"<th>{name}</th>" for name in COLUMNS)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>{escape(curve.run)}: when did it become inevitable?</title>
<style>{style}</style></head><body><main class="wide">
<h1>When did it become inevitable? {escape(curve.run)}</h1>
{paragraphs}<figure>{drawing(curve).text()}</figure>
<table><thead><tr>{head}</tr></thead><tbody>
{rows}</tbody></table>
<pre>{escape(chr(10).join(commands))}</pre>
</main></body></html>
""".encode("utf-8", "replace")
