"""A terminal as an SVG that moves by itself: CSS keyframes, no script, nothing from outside.

Without animation (a reader who wants less motion, a program that prints the file) it shows its last moment. The window
is dark on light and dark pages; two colours are added to what the programs print: for prompts, and for lines that
report a failure.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.sax.saxutils import escape

from docs.film.terminal import Line, Run, text_of

CHARACTER_PX = 9.0
LINE_PX = 21.0
MARGIN_PX = 16.0
BAR_PX = 30.0
PROMPT = "$ "
FAILURE = re.compile(r"expectation failed|\bfailed$")
"""Lines that are drawn in the colour of a failure; what is broken over two lines is coloured as a whole."""
STYLE = """
text{font:15px ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace;fill:#d5dbe3;white-space:pre}
.b{font-weight:700;fill:#fff}.p{fill:#5fd38d;font-weight:700}.c{fill:#fff}.f{fill:#ff8f80}
"""


ABOUT = (
    "A terminal: a run passes; the same run over a bad radio fails a check; its replay fails at the same tick"
)


class Shot(NamedTuple):
    """A command, when it is typed, what it prints, and when."""

    command: str
    typed_s: float
    key_s: float
    lines: Sequence[Line]
    answered_s: float
    line_s: float


class Placed(NamedTuple):
    """A row of the film: its text, when it appears, how it is drawn; `typed`: a part of a command,
    so many keys, a key every so many seconds."""

    line: Line
    at_s: float
    kind: str
    typed: tuple[int, float] | None = None


def picture(shots: Sequence[Shot], columns: int, rows: int, rest_s: float) -> str:
    """The film; it stands for `rest_s` at its end, and begins again."""
    placed = [one for shot in shots for one in _placed(shot, columns)]
    length_s = max(one.at_s for one in placed) + rest_s
    width, height = columns * CHARACTER_PX + 2 * MARGIN_PX, rows * LINE_PX + BAR_PX + 1.5 * MARGIN_PX
    rules, drawn = [], []
    for row, one in enumerate(placed):
        drawn.append(_text(one, row))
        rules.append(_appears(f"r{row}", one.at_s, length_s))
        if one.typed is not None:
            drawn.append(_cover(row, one, width))
            rules.append(_types(f"k{row}", one, length_s))
    scroll, last = _scrolls(placed, rows, length_s)
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_px(width)} {_px(height)}" role="img" '
            f'aria-label="{ABOUT}">',
            f"<style>{STYLE}.k{{opacity:0}}",
            "@media (prefers-reduced-motion:no-preference){",
            *rules,
            scroll,
            "}</style>",
            f'<rect width="{_px(width)}" height="{_px(height)}" rx="9" fill="#161b22" stroke="#3d444d"/>',
            *(
                f'<circle cx="{_px(18 + 18 * number)}" cy="15" r="5.5" fill="{colour}"/>'
                for number, colour in enumerate(("#ff5f57", "#febc2e", "#28c840"))
            ),
            f'<svg y="{_px(BAR_PX + MARGIN_PX / 4)}" width="{_px(width)}" height="{_px(rows * LINE_PX)}">',
            f'<g transform="translate({_px(MARGIN_PX)} 0)">'
            f'<g class="s" style="transform:translateY({_px(last)}px)">',
            *drawn,
            "</g></g></svg></svg>",
            "",
        ]
    )


def _placed(shot: Shot, columns: int) -> Iterator[Placed]:
    """The rows of a command and of its output."""
    typed = PROMPT + shot.command
    at_s = shot.typed_s
    for start in range(0, len(typed), columns):
        part = typed[start : start + columns]
        keys = len(part) - (len(PROMPT) if start == 0 else 0)
        line = (Run(part, False),)
        yield Placed(line, at_s, "prompt" if start == 0 else "command", (keys, shot.key_s))
        at_s += keys * shot.key_s
    for number, (line, failure) in enumerate(zip(shot.lines, _failures(shot.lines, columns), strict=True)):
        yield Placed(line, shot.answered_s + number * shot.line_s, "failure" if failure else "output")


def _failures(lines: Sequence[Line], columns: int) -> list[bool]:
    """Which lines report a failure; one that fills its row goes on in the next."""
    found: list[bool] = []
    for number, line in enumerate(lines):
        goes_on = number > 0 and found[-1] and len(text_of(lines[number - 1])) == columns
        found.append(goes_on or bool(FAILURE.search(text_of(line))))
    return found


def _text(one: Placed, row: int) -> str:
    spans, column = [], 0
    for run in one.line:
        for text, kind in _kinds(run, one.kind):
            if text.strip():
                spans.append(_span(text, kind, column))
            column += len(text)
    return f'<text class="r{row}" y="{_px((row + 1) * LINE_PX - 6)}">{"".join(spans)}</text>'


def _kinds(run: Run, kind: str) -> Iterator[tuple[str, str]]:
    """Text and class."""
    if kind == "prompt":
        yield PROMPT, "p"
        yield run.text.removeprefix(PROMPT), "c"
    elif kind == "failure":
        yield run.text, "f"
    else:
        yield run.text, "b" if run.bold else "c" if kind == "command" else ""


def _span(text: str, kind: str, column: int) -> str:
    """At its column, and as wide as so many characters in whatever font there is."""
    inner = text.rstrip()
    lead = len(inner) - len(inner.lstrip())
    inner = inner.lstrip()
    name = f' class="{kind}"' if kind else ""
    width = _px(len(inner) * CHARACTER_PX)
    place = _px((column + lead) * CHARACTER_PX)
    fit = f'textLength="{width}" lengthAdjust="spacingAndGlyphs"'
    return f'<tspan{name} x="{place}" {fit}>{escape(inner)}</tspan>'


def _cover(row: int, one: Placed, width: float) -> str:
    """Hides what is not typed yet, with the cursor at its left edge."""
    typed = len(text_of(one.line)) - (one.typed or (0, 0.0))[0]
    x, y = _px(typed * CHARACTER_PX), _px(row * LINE_PX)
    hidden = f'<rect x="{x}" y="{y}" width="{_px(width)}" height="{_px(LINE_PX)}" fill="#161b22"/>'
    cursor = f'<rect x="{x}" y="{y}" width="{_px(CHARACTER_PX)}" height="{_px(LINE_PX - 2)}" fill="#d5dbe3"/>'
    return f'<g class="k k{row}">{hidden}{cursor}</g>'


def _appears(name: str, at_s: float, length_s: float) -> str:
    return (
        f".{name}{{animation:{name} {length_s:.2f}s step-end infinite}}"
        f"@keyframes {name}{{0%{{opacity:0}}{_share(at_s, length_s)}{{opacity:1}}}}"
    )


def _types(name: str, one: Placed, length_s: float) -> str:
    """The cover moves a character a key, and is gone."""
    assert one.typed is not None
    keys, key_s = one.typed
    begin, end = _share(one.at_s, length_s), _share(one.at_s + keys * key_s, length_s)
    return (
        f".{name}{{animation:{name} {length_s:.2f}s infinite}}@keyframes {name}{{"
        f"0%{{opacity:0;animation-timing-function:step-end}}"
        f"{begin}{{opacity:1;transform:none;animation-timing-function:steps({keys})}}"
        f"{end}{{opacity:1;transform:translateX({_px(keys * CHARACTER_PX)}px);animation-timing-function:step-start}}"
        "100%{opacity:0}}"
    )


def _scrolls(placed: Sequence[Placed], rows: int, length_s: float) -> tuple[str, float]:
    """A step up for each row below the last one of the window, and where it ends."""
    frames = ["0%{transform:none}"]
    shift = 0.0
    for row, one in enumerate(placed):
        if row >= rows:
            shift = -(row + 1 - rows) * LINE_PX
            frames.append(f"{_share(one.at_s, length_s)}{{transform:translateY({_px(shift)}px)}}")
    rule = f".s{{animation:s {length_s:.2f}s step-end infinite}}@keyframes s{{{''.join(frames)}}}"
    return rule, shift


def _share(at_s: float, length_s: float) -> str:
    return f"{100.0 * at_s / length_s:.2f}%"


def _px(value: float) -> str:
    return f"{value:g}"
