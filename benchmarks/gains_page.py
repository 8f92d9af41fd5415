"""The page of the gain searches, docs/background/gains.md, from their tables, and its picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from statistics import median
from textwrap import wrap

from benchmarks.gains_search import CAMERAS, PAPER, PATHS, RETUNED
from benchmarks.gains_tables import (
    COMPARISONS,
    DATA,
    DECISIVE,
    LAWS,
    MEASURES,
    ONE_SET_SEEDS,
    TRUTH,
    Cell,
    Measure,
    Results,
    cells_of,
    one_set,
    span,
    tables_of,
)
from mirotwin.campaign.reproduce.stored_tables import Row, StoredTables
from mirotwin.report.svg import Drawing, Panel, PanelBox, Stroke


def write(results: Results, executor: Executor, path: Path | None) -> None:
    """The tables, the page and its picture beside it; without a path the page on the screen."""
    found = tables_of(results, one_set(executor.map))
    text = page(found)
    if path is None:
        print(text, end="")
    else:
        found.write(DATA)
        path.write_text(text, encoding="utf-8")
        draw(results, path.with_suffix(".svg"))


HEAD = """\
# Many searches for gains of each law

{verdict}

The paper prints no gains. Here both laws get {repeats} searches under each of three cameras: that of the scenarios,
whose calibration is wrong by up to 2.40 cm; the same with an exact calibration; and white noise of 2.40 cm. A search
tries {explored} gain sets drawn from wide bounds, then {refined} near the best for the line (Figs. 6, 7, 9) and as many
for the curve (Figs. 8, 10). The best of these {first} sets is kept, and the search goes on to {second}. The paper's law
has {papers} gains, epsilon-tracking {others}, so its searches after {second} sets stand beside those of
epsilon-tracking after {first}, too.

* The seeds that choose ({search} and {check}) are not the seeds that measure ({held_out}).
* A run *settles* if it stays within 3 cm and 0.15 rad for its last second. Errors are root mean squares of that
  second, of the runs that settle: a law that settles from fewer starts is judged by the easier ones.
* All searches minimise the error *in truth*, which a laboratory cannot measure.
* The shipped gains of the paper's law, for Figs. 6 and 7 alone, have smaller errors and settle from the start of
  Fig. 9 in no run.

[All tables, with the best gain sets](../../benchmarks/gains.json). To run it again:

<!-- not run: {thousands} 000 runs, half an hour on two cores; tests/sim/test_gains.py has its parts -->
```sh
python -m benchmarks.gains --write docs/background/gains.md --journal gains.jsonl
```

This gives the same bytes everywhere. A stopped command goes on with the journal.
"""
VERDICT_HEAD = """\
## Which law is better

How many of {count} comparisons under a camera (two paths, three budgets) the paper's law / epsilon-tracking wins: its
search is the better one in at least {decisive:.0f} of 100 pairs. Equal laws reach that in 4 % of the cases
(Mann-Whitney): three or four of all {all} are chance.
"""
MEDIANS_HEAD = """\
The medians of {repeats} searches after {second} sets, the paper's law / epsilon-tracking (errors in cm, chattering in
m/s2):
"""
PICTURE = """\
![Each search's best set: runs that settle, errors in truth and that the camera sees, chattering](gains.svg)
"""
ONE_SET_HEAD = """\
## One set for Figs. 6, 7 and 9

Another search found a set with which epsilon-tracking drives all three (*line* in
[the paper again](../reproduction.md)). Shipped gains / this set, medians of the runs that settle, seeds {seeds}:
"""


def page(found: StoredTables) -> str:
    """The whole text."""
    searched, pairs = found.about, found.rows("pairs")
    words = {
        "verdict": verdict(pairs),
        "repeats": searched["searches"],
        "explored": searched["explored sets"],
        "refined": searched["refined sets"],
        "papers": len(PAPER.bounds),
        "others": len(RETUNED.bounds),
        "first": searched["sets"],
        "second": searched["sets at the end"],
        "search": searched["seeds of the search"],
        "check": searched["seeds of the check"],
        "held_out": searched["held-out seeds"],
        "thousands": sum(int(row[-1]) for row in found.rows("drawn")) // 1000,
        "count": len(PATHS) * len(COMPARISONS),
        "all": len(pairs) * len(MEASURES),
        "decisive": 100 * DECISIVE,
        "seeds": span(ONE_SET_SEEDS),
    }
    parts = (
        (HEAD, ()),
        (VERDICT_HEAD, _verdict_lines(pairs)),
        (MEDIANS_HEAD, _median_lines(found)),
        (PICTURE, ()),
        (ONE_SET_HEAD, _one_set_lines(found)),
    )
    blocks = [block for head, lines in parts for block in (*_filled(head.format(**words)), "\n".join(lines))]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _filled(text: str) -> Iterator[str]:
    """Paragraphs, those of sentences in full lines."""
    for part in text.strip().split("\n\n"):
        yield part if part[0] in "#<!*" else "\n".join(wrap(part, 120, break_on_hyphens=False))


def columns(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """A block of text with the cells of each row below each other."""
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    lines = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
    yield from ("```text", *lines, "```")


FIRST = 3
"""The first column of `pairs` that has a measure: before it stand camera, path and budgets."""


def wins(pairs: Sequence[Row], measure: Measure) -> Counter[str]:
    """Comparisons that each law wins by a measure; by an empty name those that neither wins."""
    return Counter(row[FIRST + MEASURES.index(measure)].partition(": ")[2] for row in pairs)


def verdict(pairs: Sequence[Row]) -> str:
    """How often each law wins, by measure."""
    parts, winners = [], set()
    for measure in MEASURES:
        won = wins(pairs, measure)
        winners |= {law for law in LAWS if won[law]}
        parts.append(f"{won[PAPER.name]} / {won[RETUNED.name]} by the {measure.name}")
    conclusion = "Which law is better depends on the camera and on what is measured"
    if len(winners) < len(LAWS):
        conclusion = f"Nowhere is the other law better than {min(winners)}" if winners else "No law is better"
    text = (
        f"{conclusion}: of {len(pairs)} comparisons after the same searches {PAPER.name} / {RETUNED.name} win"
    )
    return f"{text} {', '.join(parts)}. The others may be chance. By the {TRUTH.name} {_by_camera(pairs)}."


def _by_camera(pairs: Sequence[Row]) -> str:
    """Under which cameras each law wins by the error in truth."""
    cameras: dict[str, dict[str, None]] = {law: {} for law in LAWS}
    for row in pairs:
        if winner := row[FIRST + MEASURES.index(TRUTH)].partition(": ")[2]:
            cameras[winner][f"`{row[0]}`"] = None
    return ", ".join(f"{law} wins with {' and '.join(won) or 'no camera'}" for law, won in cameras.items())


def _verdict_lines(pairs: Sequence[Row]) -> Iterator[str]:
    rows = [["camera", *(measure.name for measure in MEASURES)]]
    for camera in dict.fromkeys(row[0] for row in pairs):
        won = [wins([row for row in pairs if row[0] == camera], measure) for measure in MEASURES]
        rows.append([camera, *(f"{count[PAPER.name]}/{count[RETUNED.name]}" for count in won)])
    return columns(rows)


def _median_lines(found: StoredTables) -> Iterator[str]:
    """Of each camera and path at the end: both laws' medians."""
    names = found.tables["spread"][0]
    shown = [names.index(measure.name) for measure in MEASURES]
    rows = [["camera", "path", *(names[column] for column in shown)]]
    end = [row for row in found.rows("spread") if row[names.index("sets")] == found.about["sets at the end"]]
    for camera, path in dict.fromkeys((row[0], row[2]) for row in end):
        both = [row for row in end if (row[0], row[2]) == (camera, path)]
        cells = ["/".join(row[column].partition(" ")[0] for row in both) for column in shown]
        settled = both[0][shown[0]].rpartition(" ")[2]
        rows.append([camera, path, f"{cells[0]} of {settled}", *cells[1:]])
    return columns(rows)


def _one_set_lines(found: StoredTables) -> Iterator[str]:
    rows = found.rows("one set, verdicts")
    measures = list(dict.fromkeys(row[1] for row in rows))
    medians = {(row[0], row[1]): f"{row[2]}/{row[3]}" for row in rows}
    cameras = dict.fromkeys(row[0] for row in rows)
    table = [[camera, *(medians[camera, measure] for measure in measures)] for camera in cameras]
    return columns([["camera", *measures], *table])


SIZE = (1000, 1110)
LEFT, TOP, GAP, ROW_GAP = 66, 76, 66, 74
WIDTH, HEIGHT = (SIZE[0] - LEFT - 20 - 2 * GAP) / 3, 180
APART = 0.06
"""Between two searches of a strip."""
HEADING = (
    "The best set of each search, with seeds that chose nothing",
    "blue: the paper's law; red: epsilon-tracking; a dot for each search, a stroke at the median",
)


def draw(results: Results, path: Path) -> None:
    """Writes the picture: a strip of dots for each law, budget and path, and a stroke at its median."""
    cells = cells_of(results)
    first, second = next(iter(results)).budget.sets
    drawing = Drawing(*SIZE, HEADING)
    for row, measure in enumerate(MEASURES):
        panels = {
            camera: Panel(
                f"{camera}: {measure.name}", f"line {first}, {second}   |   curve {first}, {second} sets"
            )
            for camera in CAMERAS
        }
        for cell in cells:
            _strips(panels[cell.camera], cell, measure)
        spans = [panel.spans()[2:] for panel in panels.values()]
        low, high = min(one[0] for one in spans), max(one[1] for one in spans)
        for column, panel in enumerate(panels.values()):
            panel.y_range = (low - 0.05 * (high - low), high + 0.05 * (high - low))
            panel.small = True
            drawing.add(
                panel, PanelBox(LEFT + column * (WIDTH + GAP), TOP + row * (HEIGHT + ROW_GAP), WIDTH, HEIGHT)
            )
    drawing.write(path)


def _strips(panel: Panel, cell: Cell, measure: Measure) -> None:
    """The strips of a law: both paths, both checks."""
    law = LAWS.index(cell.law)
    for number, path in enumerate(PATHS):
        for check in (0, 1):
            centre = 5.0 * number + 2.0 * check + 0.8 * law
            values = [(measure.value(runs), repeat) for repeat, runs in enumerate(cell.runs(path, check))]
            there = [
                (value, centre + APART * (repeat - 4.5)) for value, repeat in values if value is not None
            ]
            if there:
                level = median(value for value, _ in there)
                panel.marks.append(
                    Stroke([x for _, x in there], [value for value, _ in there], "dots", law + 1)
                )
                panel.line([centre - 0.35, centre + 0.35], [level, level], colour=law + 1, style="thin")
