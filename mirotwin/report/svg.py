"""Line plots as SVG: axes with round numbers, light or dark like the reader's screen, reproducible bytes.

    drawing = Drawing(960, 700, ("A title", "what stands below it"))
    panel = Panel("(b)  x_e", "t [s]", "x_e [cm]", band=3.0)
    panel.line(times, values, colour=1, label="robot")
    drawing.add(panel, Box(60, 80, 400, 250))
    drawing.write(path)

`_` in a title or an axis label makes the next letter a subscript: `x_e`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

COLOURS = 5
MOST_POINTS = 20_000
"""Points of a line; of more, every second one is drawn, or every third, and so on."""
PER_LABEL_X, PER_LABEL_Y = 75.0, 42.0
"""Pixels between two numbers of an axis, at least."""
LETTER = 6.6
"""Pixels of a letter of the legend, about."""
MARGIN = 0.05
"""The margin of an axis beyond its values, as a share of their range."""

STYLE = """
text{font:12px "DejaVu Sans",Verdana,sans-serif;fill:var(--ink)}
.title{font-size:13px}.head{font-size:14.5px;font-weight:bold}.sub{font-size:70%}.small,.small text{font-size:10.5px}
.end{text-anchor:end}.mid{text-anchor:middle}
.frame{fill:none;stroke:var(--frame)}.grid{stroke:var(--grid)}.band{fill:var(--band)}.paper{fill:var(--paper)}.legend{fill:var(--paper);opacity:.82}
.line{fill:none;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}.thin{stroke-width:1.4}
.dots{fill:none;stroke-width:3.4;stroke-linecap:round;opacity:.4}.dotted{stroke-dasharray:0.1 4}
.start{fill:var(--paper);stroke-width:2}
svg{--ink:#1c1c1c;--paper:#fff;--grid:#e6e6e6;--frame:#8a8a8a;--band:#eef2f8;
--c0:#222;--c1:#1f5fa8;--c2:#c8452d;--c3:#2e8b57;--c4:#8a5bb0;--c5:#b07d12}
@media(prefers-color-scheme:dark){svg{--ink:#e4e4e4;--paper:#16181c;--grid:#2c3036;--frame:#7a7f87;--band:#1f2732;
--c0:#ddd;--c1:#6fb1f5;--c2:#f0805f;--c3:#63c78c;--c4:#c39ae6;--c5:#e0b04c}}
"""


class PanelBox(NamedTuple):
    """Left, top, width and height in pixels."""

    x: float
    y: float
    width: float
    height: float


class Stroke(NamedTuple):
    """Points and how they are drawn: `style` of STYLE, `dots` and `start` (a ring) included, `colour` 0 (ink) to 5."""

    x: Sequence[float]
    y: Sequence[float]
    style: str
    colour: int
    label: str = ""


class Panel:
    """Axes with lines. `band`: shaded from -band to band. `equal`: same scale on both axes."""

    def __init__(
        self, title: str, x_label: str = "", y_label: str = "", *, band: float = 0.0, equal: bool = False
    ) -> None:
        self.title = title
        self.x_label = x_label
        self.y_label = y_label
        self.band = band
        self.equal = equal
        self.marks: list[Stroke] = []
        self.small = False
        """Smaller text, and no numbers below."""
        self.y_range: tuple[float, float] | None = None

    def line(self, x: Sequence[float], y: Sequence[float], *, colour: int, **look: str) -> None:
        """`style`: classes besides `line`; `label`: its name in the legend."""
        style = f"line {look.get('style', '')}".rstrip()
        self.marks.append(Stroke(x, y, style, colour, look.get("label", "")))

    def spans(self) -> tuple[float, float, float, float]:
        """The least and the most of x, then of y."""
        x_low, x_high = _span(mark.x for mark in self.marks)
        return (x_low, x_high, *(self.y_range or _span(mark.y for mark in self.marks)))


class Drawing:
    """Panels below a heading: its first line is bold."""

    def __init__(self, width: int, height: int, heading: Sequence[str]) -> None:
        self._parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
            f'<style>{STYLE}</style><rect class="paper" width="{width}" height="{height}"/>'
        ]
        for number, text in enumerate(heading):
            style = "mid" if number else "mid head"
            self._parts.append(_text(width / 2, 24 + 20 * number, text, style, sub=False))

    def add(self, panel: Panel, box: PanelBox) -> None:
        self._parts += _Axes(panel, box).parts()

    def text(self) -> str:
        return "\n".join([*self._parts, "</svg>"]) + "\n"

    def legend(self, panel: Panel, x: float, y: float) -> None:
        """The names of a panel's lines in a column, for panels that have the same lines."""
        self._parts += [_name(mark, x, y + 17 * row) for row, mark in enumerate(panel.marks)]

    def write(self, path: Path) -> None:
        path.write_text(self.text(), encoding="utf-8")


class _Axes:
    """A panel in its box: pixels of values."""

    def __init__(self, panel: Panel, box: PanelBox) -> None:
        self.panel = panel
        self.box = box
        x_low, x_high, y_low, y_high = panel.spans()
        x_margin = MARGIN * (x_high - x_low) if panel.equal else 0.0
        y_margin = MARGIN * (y_high - y_low) if panel.y_range is None else 0.0
        self.x0, self.x1 = x_low - x_margin, x_high + x_margin
        self.y0, self.y1 = y_low - y_margin, y_high + y_margin
        if panel.equal:
            self._widen()

    def _widen(self) -> None:
        unit = max((self.x1 - self.x0) / self.box.width, (self.y1 - self.y0) / self.box.height)
        for low, high, pixels in (("x0", "x1", self.box.width), ("y0", "y1", self.box.height)):
            middle = (getattr(self, low) + getattr(self, high)) / 2
            setattr(self, low, middle - unit * pixels / 2)
            setattr(self, high, middle + unit * pixels / 2)

    def x(self, value: float) -> float:
        return self.box.x + self.box.width * (value - self.x0) / (self.x1 - self.x0)

    def y(self, value: float) -> float:
        return self.box.y + self.box.height * (self.y1 - value) / (self.y1 - self.y0)

    def parts(self) -> list[str]:
        made = [f'<g class="small">{self._title()}' if self.panel.small else f"<g>{self._title()}"]
        if self.panel.band:
            low, high = max(-self.panel.band, self.y0), min(self.panel.band, self.y1)
            if low < high:
                made.append(
                    _rect("band", self.box.x, self.y(high), self.box.width, self.y(low) - self.y(high))
                )
        made += [*self._numbers(), _rect("frame", *self.box), *self._marks(), *self._legend(), "</g>"]
        return made

    def _title(self) -> str:
        return _text(self.box.x, self.box.y - 8, self.panel.title, "small" if self.panel.small else "title")

    def _numbers(self) -> list[str]:
        box, panel = self.box, self.panel
        bottom, made = box.y + box.height, []
        closer = 0.6 if panel.small else 1.0
        for value, text in ticks(self.x0, self.x1, box.width / PER_LABEL_X / closer):
            position = self.x(value)
            made.append(f'<path class="grid" d="M{position:.1f} {box.y:.1f}V{bottom:.1f}"/>')
            if not panel.small:
                made.append(_text(position, bottom + 16, text, "mid", sub=False))
        for value, text in ticks(self.y0, self.y1, box.height / PER_LABEL_Y / closer):
            position = self.y(value)
            made.append(f'<path class="grid" d="M{box.x:.1f} {position:.1f}h{box.width:.1f}"/>')
            made.append(_text(box.x - 6, position + 4, text, "end", sub=False))
        if panel.x_label:
            made.append(_text(box.x + box.width / 2, bottom + 33, panel.x_label, "mid"))
        if panel.y_label:
            turned = f' transform="rotate(-90 {box.x - 44:.1f} {box.y + box.height / 2:.1f})"'
            made.append(_text(box.x - 44, box.y + box.height / 2, panel.y_label, "mid", turned))
        return made

    def _marks(self) -> list[str]:
        made = []
        for mark in self.panel.marks:
            colour = f"stroke:var(--c{mark.colour})"
            if mark.style == "start":
                centre = f'cx="{self.x(mark.x[0]):.1f}" cy="{self.y(mark.y[0]):.1f}"'
                made.append(f'<circle class="start" style="{colour}" {centre} r="4"/>')
            elif len(mark.x):
                dots = mark.style == "dots"
                made.append(f'<path class="{mark.style}" style="{colour}" d="{self._path(mark, dots)}"/>')
        return made

    def _path(self, mark: Stroke, dots: bool) -> str:
        step = -(-len(mark.x) // MOST_POINTS)
        points = zip(mark.x[::step], mark.y[::step], strict=True)
        known = (point for point in points if math.isfinite(point[0]) and math.isfinite(point[1]))
        pixels = [at for at, _ in groupby(f"{self.x(x):.1f} {self.y(y):.1f}" for x, y in known)]
        if dots:
            return "".join(f"M{at}h0" for at in pixels)
        return "M" + "L".join(pixels) + ("h0" if len(pixels) == 1 else "")

    def _legend(self) -> list[str]:
        """At the right above the frame, the last name outermost; in a column inside it where they have no room."""
        named = [mark for mark in self.panel.marks if mark.label]
        widths = [LETTER * len(mark.label) + 40 for mark in named]
        right = self.box.x + self.box.width
        if sum(widths) + LETTER * len(self.panel.title) <= self.box.width:
            starts = [right - sum(widths[index:]) + 8 for index in range(len(named))]
            return [_name(mark, x, self.box.y - 8) for mark, x in zip(named, starts, strict=True)]
        left = right - max(widths)
        back = _rect("legend", left - 6, self.box.y + 4, max(widths) + 2, 17.0 * len(named) + 5)
        return [back] + [_name(mark, left, self.box.y + 19 + 17 * row) for row, mark in enumerate(named)]


def _name(mark: Stroke, x: float, y: float) -> str:
    shape = f"M{x + 9:.1f} {y - 4:.1f}h0" if mark.style == "dots" else f"M{x:.1f} {y - 4:.1f}h18"
    sample = f'<path class="{mark.style}" style="stroke:var(--c{mark.colour})" d="{shape}"/>'
    return sample + _text(x + 24, y, mark.label, "small", sub=False)


def ticks(low: float, high: float, most: float) -> list[tuple[float, str]]:
    """Round numbers from `low` to `high`, about `most` of them, and how they are written."""
    rough = (high - low) / max(3.0, most)
    decimals = -math.floor(math.log10(rough))
    unit = 10.0**-decimals
    factor = next(factor_of for factor_of in (1, 2, 5, 10) if factor_of * unit >= rough * 0.999)
    step, digits = factor * unit, max(0, decimals - (factor == 10))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(number * step, f"{number * step:.{digits}f}") for number in range(first, last + 1)]


def _span(columns: Iterable[Sequence[float]]) -> tuple[float, float]:
    known = [value for column in columns for value in column if math.isfinite(value)]
    low, high = (min(known), max(known)) if known else (0.0, 1.0)
    return (low, high) if high - low > 1e-9 * max(1.0, abs(low)) else (low - 0.5, high + 0.5)


def _rect(style: str, x: float, y: float, width: float, height: float) -> str:
    return f'<rect class="{style}" x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"/>'


def _text(x: float, y: float, text: str, style: str, more: str = "", sub: bool = True) -> str:
    """`sub`: a letter after `_` is set lower."""
    shown = escape(text)
    if sub:
        first, *rest = shown.split("_")
        lower = (
            f'<tspan class="sub" dy="3">{part[:1]}</tspan><tspan dy="-3">{part[1:]}</tspan>' for part in rest
        )
        shown = first + "".join(lower)
    return f'<text x="{x:.1f}" y="{y:.1f}" class="{style}"{more}>{shown}</text>'
