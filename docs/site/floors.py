"""Draws boxes on floors as SVG: arrows lead from a box down to the boxes that it uses.

An arrow that others already say (a uses b, b uses c, so a uses c) is left out. Names that use one another in a circle
share a box. The same boxes give the same bytes: what is random is seeded.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from itertools import combinations, pairwise
from random import Random
from typing import TypeVar

WIDTH = 860
"""Pixels: the column of a page."""
LETTER = 7.1
"""Pixels of a letter of the monospaced fonts."""
NOTE_LETTER = 6.0
"""Of a letter of the notes, about."""
BOX, GAP, FLOOR, LINE = 24, 12, 52, 20
"""Pixels: height of a box, between two boxes, from floor to floor, of a line of text."""
STARTS, SWEEPS = 24, 12
"""Orders of the boxes that are tried, and passes over the floors for each."""

STYLE = """
text{font:11.7px ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace;fill:var(--ink);text-anchor:middle}
.note{font-family:"DejaVu Sans",Verdana,sans-serif;font-size:11px;fill:var(--dim);text-anchor:start}
.paper{fill:var(--paper)}.box{fill:var(--box);stroke:var(--frame)}.door{stroke:var(--door);stroke-width:2}
.arrow{fill:none;stroke:var(--line)}.tip{fill:var(--line)}.rule{stroke:var(--frame);stroke-dasharray:3 4}
svg{--ink:#1c1c1c;--paper:#fff;--box:#eef2f8;--frame:#a9b2bd;--door:#1f5fa8;--line:#77818c;--dim:#555e67}
@media(prefers-color-scheme:dark){svg{--ink:#e4e4e4;--paper:#16181c;--box:#222b37;--frame:#56606b;--door:#6fb1f5;
--line:#8b95a0;--dim:#a3adb7}}
"""

T = TypeVar("T")
Uses = Mapping[tuple[str, ...], set[tuple[str, ...]]]


@dataclass(eq=False)
class Box:
    """A box, or without names a point at which an arrow passes a floor. `x`: its middle."""

    names: tuple[str, ...] = ()
    above: list[Box] = field(default_factory=list)
    below: list[Box] = field(default_factory=list)
    x: float = 0.0

    @property
    def label(self) -> str:
        return " ⇄ ".join(self.names)

    @property
    def width(self) -> float:
        return LETTER * len(self.label) + 14 if self.names else 2.0


# Which box is on which floor


def merged(uses: Mapping[str, set[str]]) -> Uses:
    """The boxes, each with those that it uses: names that use one another in a circle share one."""
    far = {name: all_below(name, uses) for name in uses}
    box = {a: tuple(sorted(b for b in uses if a == b or (b in far[a] and a in far[b]))) for a in uses}
    return {own: {box[b] for a in own for b in uses[a]} - {own} for own in sorted(set(box.values()))}


def reduced(uses: Uses) -> Uses:
    """Without the arrows that a chain of others says."""
    far = {own: all_below(own, uses) for own in uses}
    return {own: {b for b in used if not any(b in far[c] for c in used)} for own, used in uses.items()}


def all_below(name: T, uses: Mapping[T, set[T]]) -> set[T]:
    """All that a thing uses, directly or by others."""
    below: set[T] = set()
    waiting = [name]
    while waiting:
        new = uses[waiting.pop()] - below
        below |= new
        waiting += new
    return below


def on_floors(uses: Uses) -> list[list[tuple[str, ...]]]:
    """The boxes from the lowest floor up: each above all that it uses, and no floor wider than a page."""
    floors: list[list[tuple[str, ...]]] = []
    at: dict[tuple[str, ...], int] = {}
    order = sorted(uses, key=lambda own: (len(all_below(own, uses)), own))

    def is_full(floor: int, own: tuple[str, ...]) -> bool:
        if floor >= len(floors):
            return False
        return sum(Box(names).width + 2 * GAP for names in [*floors[floor], own]) > WIDTH

    for own in order:
        floor = max((at[b] + 1 for b in uses[own]), default=0)
        while is_full(floor, own):
            floor += 1
        floors += [[] for _ in range(floor + 1 - len(floors))]
        floors[floor].append(own)
        at[own] = floor
    for own in reversed(order):  # shorter arrows: what more boxes use than it uses goes up to them
        users = [at[a] for a in uses if own in uses[a]]
        floor = min(users, default=0) - 1
        if floor > at[own] and len(users) >= len(uses[own]) and not is_full(floor, own):
            floors[at[own]].remove(own)
            floors[floor].append(own)
            at[own] = floor
    return [floor for floor in floors if floor]


# Where on its floor


def arranged(uses: Uses) -> list[list[Box]]:
    """The floors from the top with their boxes from the left, points of passing arrows among them: few crossings."""
    floors = [[Box(own) for own in floor] for floor in reversed(on_floors(uses))]
    at = {box.names: (floor, box) for floor, boxes in enumerate(floors) for box in boxes}
    for top, upper in list(at.values()):
        for own in sorted(uses[upper.names]):
            bottom, lower = at[own]
            passing = [Box() for _ in range(top + 1, bottom)]
            for floor, point in enumerate(passing, top + 1):
                floors[floor].append(point)
            for a, b in pairwise([upper, *passing, lower]):
                a.below.append(b)
                b.above.append(a)
    random, best = Random(0), (crossings(floors), floors)
    for _ in range(STARTS):
        floors = [sorted(floor, key=lambda _: random.random()) for floor in floors]
        for sweep in range(SWEEPS):
            _sort(floors, downwards=sweep % 2 == 0)
            count = crossings(floors)
            if count < best[0]:
                best = count, [[*floor] for floor in floors]
    floors = best[1]
    _place(floors)
    return floors


def _sort(floors: list[list[Box]], *, downwards: bool) -> None:
    """Puts each box at the mean of its neighbours on the floor before."""
    for floor in floors if downwards else reversed(floors):
        for i, box in enumerate(floor):
            near = box.above if downwards else box.below
            box.x = sum(other.x for other in near) / len(near) if near else i / len(floor)
        floor.sort(key=lambda box: box.x)
        for i, box in enumerate(floor):
            box.x = (i + 0.5) / len(floor)


def crossings(floors: list[list[Box]]) -> int:
    count = 0
    for upper, lower in pairwise(floors):
        place = {id(box): i for i, box in enumerate(lower)}
        arrows = [(i, place[id(other)]) for i, box in enumerate(upper) for other in box.below]
        count += sum((a - c) * (b - d) < 0 for (a, b), (c, d) in combinations(arrows, 2))
    return count


def _place(floors: list[list[Box]]) -> None:
    """Gives the boxes their `x`: near their neighbours above and below, in their order, within the page."""
    for floor in floors:
        for i, box in enumerate(floor):
            box.x = WIDTH * (i + 0.5) / len(floor)
    for sweep in range(200):
        for floor in floors if sweep % 2 == 0 else reversed(floors):
            wanted = []
            for box in floor:
                near = [*box.above, *box.below]
                x = sum(other.x for other in near) / len(near) if near else WIDTH / 2
                wanted.append(
                    x + (WIDTH / 2 - x) * 0.04
                )  # so that parts without arrows between them stay together
            _keep_apart(floor, wanted)


def _keep_apart(floor: list[Box], wanted: list[float]) -> None:
    """Each box as near to where it is wanted as its neighbours let it; passing arrows give way less, to be straight."""
    offsets = [0.0]
    for left, right in pairwise(floor):
        offsets.append(offsets[-1] + (left.width + right.width) / 2 + GAP)
    groups: list[tuple[float, float, int]] = []  # wanted start, weight, boxes
    for box, want, offset in zip(floor, wanted, offsets, strict=True):
        group = want - offset, 1.0 if box.names else 6.0, 1
        while groups and groups[-1][0] > group[0]:
            (a, m, i), (b, n, j) = groups.pop(), group
            group = (a * m + b * n) / (m + n), m + n, i + j
        groups.append(group)
    lowest = GAP + floor[0].width / 2
    highest = WIDTH - GAP - floor[-1].width / 2 - offsets[-1]
    starts = [max(lowest, min(start, highest)) for start, _, count in groups for _ in range(count)]
    for box, start, offset in zip(floor, starts, offsets, strict=True):
        box.x = start + offset


# The drawing


def drawing(uses: Mapping[str, set[str]], doors: set[str], above: Iterable[str], below: Iterable[str]) -> str:
    """The SVG: `above` as text, the boxes on their floors (those of `doors` with a strong frame), `below` as text."""
    floors = arranged(reduced(merged(uses)))
    heads = [*_lines("used by", above)]
    feet = [
        *_lines("uses", below),
        "arrow: imports" + (", strong frame: imported from outside" if doors else ""),
    ]
    width = _trim(floors, max(map(len, heads + feet)) * NOTE_LETTER + 2 * GAP)
    top = LINE * len(heads) + (22 if heads else 12)
    bottom = top + FLOOR * (len(floors) - 1) + BOX + 10
    height = bottom + LINE * len(feet) + 10
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f'<style>{STYLE}</style><rect class="paper" width="{width}" height="{height}"/>'
    ]
    parts.append(f'<path class="rule" d="{f"M0 {top - 12}H{width}" if heads else ""}M0 {bottom}H{width}"/>')
    parts += (_note(text, LINE * i + 18) for i, text in enumerate(heads))
    parts += _arrows(floors, top)
    for i, floor in enumerate(floors):
        parts += (_box(box, top + FLOOR * i, doors) for box in floor if box.names)
    parts += (_note(text, bottom + LINE * i + 18) for i, text in enumerate(feet))
    return "\n".join([*parts, "</svg>\n"])


def _trim(floors: list[list[Box]], least: float) -> int:
    """Moves the boxes into the middle of a drawing that is no wider than it must be; its width."""
    boxes = [box for floor in floors for box in floor]
    left = min(box.x - box.width / 2 for box in boxes)
    right = max(box.x + box.width / 2 for box in boxes)
    width = round(max(least, right - left + 2 * GAP))
    for box in boxes:
        box.x += (width - left - right) / 2
    return width


def _lines(head: str, names: Iterable[str]) -> Iterator[str]:
    line = ""
    for name in names:
        if len(line) + len(name) > WIDTH / NOTE_LETTER - 4:
            yield line + ","
            line = "  "
        line += f", {name}" if line.strip() else f"{line}{head}: {name}" if not line else name
    if line:
        yield line


def _note(text: str, y: float) -> str:
    return f'<text class="note" x="{GAP}" y="{y}">{escape(text)}</text>'


def _box(box: Box, y: float, doors: set[str]) -> str:
    kind = "box door" if doors & {*box.names} else "box"
    left = box.x - box.width / 2
    return (
        f'<rect class="{kind}" x="{left:.0f}" y="{y}" width="{box.width:.0f}" height="{BOX}" rx="4"/>'
        f'<text x="{box.x:.0f}" y="{y + 16}">{escape(box.label)}</text>'
    )


def _arrows(floors: list[list[Box]], top: float) -> Iterator[str]:
    for i, floor in enumerate(floors):
        for box in floor:
            for other in sorted(box.below, key=lambda other: other.x):
                a, b = _port(box, box.below, other), _port(other, other.above, box)
                y, end = top + FLOOR * i + BOX, top + FLOOR * (i + 1)
                path = f"M{a:.0f} {y}C{a:.0f} {y + 16} {b:.0f} {end - 16} {b:.0f} {end}"
                yield f'<path class="arrow" d="{path}{"" if other.names else f"v{BOX}"}"/>'
                if other.names:
                    yield f'<path class="tip" d="M{b:.0f} {end}l-3 -6h6z"/>'


def _port(box: Box, others: list[Box], other: Box) -> float:
    """Where at a box an arrow begins or ends: they stand in the order of the boxes at their other ends."""
    if not box.names:
        return box.x
    order = sorted(others, key=lambda other: other.x)
    step = min(12.0, (box.width - 12) / max(1, len(others)))
    return box.x + step * (order.index(other) - (len(order) - 1) / 2)
