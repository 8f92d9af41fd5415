"""The page of the gain searches, docs/gains.md, and its picture: how the best sets of many searches are distributed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import reduce
from operator import add
from pathlib import Path
from statistics import median
from textwrap import wrap
from typing import NamedTuple

from benchmarks.gains_search import (
    CAMERAS,
    FAMILIES,
    FIGURES,
    GENERATIONS,
    PAPER,
    PATHS,
    RETUNED,
    Budget,
    Found,
    Gains,
    HeldOut,
    Job,
    Task,
    check_seeds,
    held_out,
    rounded,
    search_seeds,
)
from mirotwin.campaign.reproduce.claims import number as shown
from mirotwin.campaign.reproduce.plan import LINE, SETTINGS
from mirotwin.report.svg import Drawing, Panel, PanelBox, Stroke

Results = Mapping[Job, Found]
LAWS = tuple(FAMILIES)

ONE_SET = SETTINGS[LINE]
"""Gains of epsilon-tracking for Figs. 6, 7 and 9 together, found by another search."""
ONE_SET_FIGURES = PATHS["line"]
ONE_SET_SEEDS = range(50)
DECISIVE = 0.77
"""Of all pairs of two laws' searches. Ten searches each of equal laws reach it, one way or the other, in 4.3 % of the
cases (Mann-Whitney)."""


def middle(values: Sequence[float]) -> float | None:
    return median(values) if values else None


class Measure(NamedTuple):
    """What is compared of a search's best set: `value` None where there is none, which is worse than any other."""

    name: str
    digits: int
    more_is_better: bool
    value: Callable[[HeldOut], float | None]

    def beats(self, one: HeldOut, other: HeldOut) -> float:
        """1 if one is better, 0.5 if both are equal, else 0."""
        first, second = self._cost(one), self._cost(other)
        return 0.5 if first == second else float(first < second)

    def _cost(self, runs: HeldOut) -> float:
        value = self.value(runs)
        return math.inf if value is None else -value if self.more_is_better else value


TRUTH = Measure("error in truth", 2, False, lambda runs: middle(runs.truth_cm))
MEASURES = (
    Measure("runs that settle", 0, True, lambda runs: runs.settled),
    TRUTH,
    Measure("error the camera sees", 2, False, lambda runs: middle(runs.camera_cm)),
    Measure("chattering", 2, False, lambda runs: middle(runs.chattering_m_s2)),
)


class Comparison(NamedTuple):
    """The check, 0 or 1, at which the paper's law and epsilon-tracking are compared."""

    paper: int
    other: int

    def name(self, sets: tuple[int, int]) -> str:
        if self.paper == self.other:
            return f"{sets[self.paper]} sets each"
        return f"{sets[self.paper]} sets beside {sets[self.other]}"


COMPARISONS = (Comparison(0, 0), Comparison(1, 1), Comparison(1, 0))
"""The last one: about as many sets for each gain."""


def write(results: Results, executor: Executor, path: Path | None) -> None:
    """The page and its picture beside it; without a path the page on the screen."""
    text = page(results, one_set(executor.map))
    if path is None:
        print(text, end="")
    else:
        path.write_text(text, encoding="utf-8")
        draw(results, path.with_suffix(".svg"))


Runs = Mapping[tuple[str, int, str], HeldOut]
"""Of the gain set that is a case of its own: by camera, figure and law."""


def one_set(
    mapped: Callable[[Callable[[Task], dict[int, HeldOut]], Iterable[Task]], Iterable[dict[int, HeldOut]]],
    cameras: Iterable[str] = CAMERAS,
    figures: Iterable[int] = ONE_SET_FIGURES,
    seeds: range = ONE_SET_SEEDS,
) -> Runs:
    """Runs of ONE_SET and of the gains of Figs. 6 and 7. `mapped`: `map`, or that of an executor."""
    settings: Mapping[str, tuple[str, ...]] = {PAPER.name: (), RETUNED.name: ONE_SET}
    parts = [seeds[first : first + 10] for first in range(0, len(seeds), 10)]
    keys = [(camera, figure, law) for camera in cameras for figure in figures for law in settings]
    tasks = [
        Task((*CAMERAS[camera], *settings[law]), (figure,), part)
        for camera, figure, law in keys
        for part in parts
    ]
    made = iter(mapped(held_out, tasks))
    return {key: reduce(add, (next(made)[key[1]] for _ in parts)) for key in keys}


class Cell(NamedTuple):
    """The searches of a law under a camera."""

    law: str
    camera: str
    searches: Sequence[Found]

    def runs(self, path: str, check: int) -> list[HeldOut]:
        return [search.best[path][check].whole() for search in self.searches]

    def settled_by_start(self, path: str, check: int) -> str:
        """The median of the runs that settle, for each figure of the path."""
        settled = (
            [one.best[path][check].held_out[figure].settled for one in self.searches]
            for figure in PATHS[path]
        )
        return ", ".join(f"{median(counts):.0f}" for counts in settled)


def cells_of(results: Results) -> list[Cell]:
    """In the order of laws and cameras."""
    return [
        Cell(law, camera, searches)
        for camera in CAMERAS
        for law in FAMILIES
        if (searches := [one for job, one in results.items() if (job.family, job.camera) == (law, camera)])
    ]


class Duel(NamedTuple):
    """One measure of both laws on a path under a camera: the share of pairs of searches in which epsilon is better."""

    camera: str
    path: str
    comparison: Comparison
    measure: Measure
    share: float

    @property
    def winner(self) -> str:
        """The law that is better, or nothing."""
        return RETUNED.name if self.share >= DECISIVE else PAPER.name if 1 - self.share >= DECISIVE else ""


def duels_of(results: Results) -> list[Duel]:
    """All comparisons under the cameras under which both laws were searched for."""
    by_name = {(cell.law, cell.camera): cell for cell in cells_of(results)}
    found = []
    for camera in CAMERAS:
        both = [by_name[law, camera] for law in LAWS if (law, camera) in by_name]
        if len(both) < len(LAWS):
            continue
        for path in PATHS:
            for comparison in COMPARISONS:
                papers, others = (
                    cell.runs(path, check) for cell, check in zip(both, comparison, strict=True)
                )
                for measure in MEASURES:
                    won = [measure.beats(other, paper) for other in others for paper in papers]
                    found.append(Duel(camera, path, comparison, measure, math.fsum(won) / len(won)))
    return found


HEAD = """\
# Many searches for gains of each law

{verdict}

<!-- not run: {thousands} 000 runs, half an hour on two cores; tests/sim/test_gains.py has its parts -->
```sh
python -m benchmarks.gains --write docs/gains.md --journal gains.jsonl
```

writes this page and its picture, with the same bytes on every computer. The journal keeps what is finished: a command
that was broken off goes on with it.

The paper prints no gains, and the shipped ones were found by searches of different kinds. Here the paper's law
and epsilon-tracking (invariant sigma, saturation) get the same search, {repeats} times under each of three
cameras: that of the scenarios, whose calibration is wrong by up to 2.40 cm; the same with an exact calibration;
and white noise of 2.40 cm. A search tries {explored} gain sets drawn from wide bounds, then {refined} near the
best for the line (Figs. 6, 7, 9) and as many for the curve (Figs. 8, 10). The best of these {first} sets is
kept, and the search goes on to {second}. All drive the whole loop: camera, radio, firmware, LM629, motors.

The {repeats} searches differ in what they draw and in the seeds that choose ({search}, and {check} to check the best
four). Their best sets drive with seeds {held_out}, which chose nothing. Searches of the same number have the same seeds
for each law. All minimise the error in truth, which a laboratory could not do; none was made for the error that the
camera sees. One set is for all starts of a path: gains of the paper's law for Figs. 6 and 7 alone, as the shipped ones,
have smaller errors and settle from the start of Fig. 9 in no run.

The paper's law has {papers} gains, epsilon-tracking {others}: the same number of sets is less for the paper's
law. So its searches after {second} sets stand beside those of epsilon-tracking after {first}, too:
{per_paper:.1f} and {per_other:.1f} sets for each gain.

Two other forms of epsilon-tracking are not searched for here. One search each of 66 sets under the camera of the
scenarios found this before: with the naive sigma and the sign 32 to 43 of 50 runs from a start ended within 3 cm and
0.15 rad, with gains that keep its theory none.

A run *settles* if it is within 3 cm and 0.15 rad for its whole last second. Errors are root mean squares of that
second, medians of the runs that settle, so that a law that settles from fewer starts is judged by the easier ones. *In
truth*: the robot against the reference; *the camera sees*: the measurement against the reference at its exposure.
"""
VERDICT_HEAD = """\
## Which law is better

How many of {count} comparisons under a camera (two paths, three budgets) each law wins. A law wins if its search is the
better one in at least {decisive:.0f} of 100 pairs of searches, which happens to equal laws in 4 % of the cases
(Mann-Whitney): three or four of all {all} are chance. The paper's law / epsilon-tracking / neither:
"""
PAIRS_HEAD = """\
In how many of 100 pairs the search of epsilon-tracking beats that of the paper's law (where a search settles
nowhere it is beaten; equals count half):
"""
SPREAD_HEAD = """\
## How the best sets are distributed

Median of {repeats} searches (least to most). Sets: those tried for a path. By start: the median of the runs that settle
from the starts of Figs. 6, 7, 9, or of Figs. 8, 10, each of {each}. Errors in cm, chattering in m/s2.
"""
PICTURE = """\
![Each search's best set: runs that settle, errors in truth and that the camera sees, chattering](gains.svg)
"""
SHARES_HEAD = """\
## How many gain sets settle

The share of the sets that were drawn, of all searches, that settles from a start (all of 3 runs):
"""
BOX_HEAD = """\
## The bounds

Sets are drawn from the middle half of each gain's bounds, in its logarithm, and refined anywhere within them
(`benchmarks/gains_search.py`). The least `max_v_m_s` is what the paths need. Best sets of all searches, paths and
budgets that sit on a bound:
"""
SETS_HEAD = """\
## Some of these sets

The middle one of each law's searches after {second} sets, by the runs that settle, then by the error in truth: gains as
keys of `[network.robot.controller]`; runs that settle, error in truth / that the camera sees in cm.
"""
ONE_SET_HEAD = """\
## One set for Figs. 6, 7 and 9

Another search found a set with which epsilon-tracking drives all three (*line* in [the paper again](reproduction.md)):
`{settings}`.
Beside it the paper's law with its shipped gains, those of Figs. 6 and 7. Seeds {seeds}: runs that settle, error in
truth / that the camera sees in cm, chattering in m/s2.
"""
ONE_VERDICT_HEAD = """\
Medians of all runs from these three starts that settle (errors in cm), and whose is the smaller:
"""


def page(results: Results, one: Runs) -> str:
    """The whole text."""
    jobs = list(results)
    budget, repeats = jobs[0].budget, 1 + max(job.repeat for job in jobs)
    first, second = budget.sets
    duels = duels_of(results)
    words = {
        "verdict": verdict(duels),
        "repeats": repeats,
        "explored": budget.explored,
        "refined": GENERATIONS * budget.first,
        "search": span(range(search_seeds(0).start, search_seeds(repeats - 1).stop)),
        "check": span(range(check_seeds(0).start, check_seeds(repeats - 1).stop)),
        "held_out": span(jobs[0].held_out),
        "each": len(jobs[0].held_out),
        "papers": len(PAPER.bounds),
        "others": len(RETUNED.bounds),
        "first": first,
        "second": second,
        "per_paper": second / len(PAPER.bounds),
        "per_other": first / len(RETUNED.bounds),
        "thousands": sum(found.runs for found in results.values()) // 1000,
        "count": len(PATHS) * len(COMPARISONS),
        "all": len(duels),
        "decisive": 100 * DECISIVE,
        "settings": ONE_SET[0],
        "seeds": span(ONE_SET_SEEDS),
    }
    cells = cells_of(results)
    parts = (
        (HEAD, ()),
        (VERDICT_HEAD, _verdict_lines(duels)),
        (PAIRS_HEAD, _pair_lines(duels, budget)),
        (SPREAD_HEAD, _spread_lines(cells, budget)),
        (PICTURE, ()),
        (SHARES_HEAD, _share_lines(cells)),
        (BOX_HEAD, _box_lines(cells)),
        (SETS_HEAD, _set_lines(cells)),
        (ONE_SET_HEAD, _one_lines(one)),
        (ONE_VERDICT_HEAD, _one_verdict_lines(one)),
    )
    blocks = [block for head, lines in parts for block in (*_filled(head.format(**words)), "\n".join(lines))]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _filled(text: str) -> Iterator[str]:
    """Paragraphs, those of sentences in full lines."""
    for part in text.strip().split("\n\n"):
        yield part if part[0] in "#<!" else "\n".join(wrap(part, 120, break_on_hyphens=False))


def span(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def table(*head: str) -> Iterator[str]:
    """The first two lines of a table."""
    yield f"| {' | '.join(head)} |"
    yield "|---" * len(head) + "|"


def verdict(duels: Sequence[Duel]) -> str:
    """The first paragraph: how often each law wins, by measure."""
    parts, winners = [], set()
    for measure in MEASURES:
        won = Counter(duel.winner for duel in duels if duel.measure is measure)
        winners |= {law for law in LAWS if won[law]}
        parts.append(f"{won[PAPER.name]} / {won[RETUNED.name]} by the {measure.name}")
    conclusion = "Which law is better depends on the camera and on what is measured"
    if len(winners) < len(LAWS):
        conclusion = f"Nowhere is the other law better than {min(winners)}" if winners else "No law is better"
    count = len(duels) // len(MEASURES)
    text = f"{conclusion}: of {count} comparisons after the same searches {PAPER.name} / {RETUNED.name} win"
    return f"{text} {', '.join(parts)}. The others may be chance. By the {TRUTH.name} {_by_camera(duels)}."


def _by_camera(duels: Sequence[Duel]) -> str:
    """Under which cameras each law wins by the error in truth."""
    cameras: dict[str, dict[str, None]] = {law: {} for law in LAWS}
    for duel in duels:
        if duel.measure is TRUTH and duel.winner:
            cameras[duel.winner][f"`{duel.camera}`"] = None
    return ", ".join(f"{law} wins with {' and '.join(won) or 'no camera'}" for law, won in cameras.items())


def _verdict_lines(duels: Sequence[Duel]) -> Iterator[str]:
    yield from table("camera", *(measure.name for measure in MEASURES))
    for camera in dict.fromkeys(duel.camera for duel in duels):
        counts = []
        for measure in MEASURES:
            won = Counter(duel.winner for duel in duels if (duel.camera, duel.measure) == (camera, measure))
            counts.append(f"{won[PAPER.name]} / {won[RETUNED.name]} / {won['']}")
        yield f"| {camera} | {' | '.join(counts)} |"


def _pair_lines(duels: Sequence[Duel], budget: Budget) -> Iterator[str]:
    yield from table(
        "camera", "path", "the paper's law beside epsilon-tracking", *(measure.name for measure in MEASURES)
    )
    rows: dict[tuple[str, str, Comparison], list[str]] = {}
    for duel in duels:
        key = duel.camera, duel.path, duel.comparison
        rows.setdefault(key, []).append(f"{100 * duel.share:.0f}{duel.winner and f': {duel.winner}'}")
    for (camera, path, comparison), shares in rows.items():
        yield f"| {camera} | {path} | {comparison.name(budget.sets)} | {' | '.join(shares)} |"


def _spread_lines(cells: Sequence[Cell], budget: Budget) -> Iterator[str]:
    settles, *others = (measure.name for measure in MEASURES)
    yield from table("camera", "law", "path", "sets", settles, "by start", *others)
    for cell in cells:
        for path in PATHS:
            for check, sets in enumerate(budget.sets):
                runs = cell.runs(path, check)
                spreads = [spread(measure, runs) for measure in MEASURES]
                spreads[0] += f" of {runs[0].runs} | {cell.settled_by_start(path, check)}"
                yield f"| {cell.camera} | {cell.law} | {path} | {sets} | {' | '.join(spreads)} |"


def spread(measure: Measure, runs: Sequence[HeldOut]) -> str:
    """Median, least and most of those that have a value, and how many have none."""
    values = [value for one in runs if (value := measure.value(one)) is not None]
    if not values:
        return "-"
    middle_one, least, most = (
        f"{value:.{measure.digits}f}" for value in (median(values), min(values), max(values))
    )
    without = len(runs) - len(values)
    return f"{middle_one} ({least} to {most})" + (f", {without} without" if without else "")


def _share_lines(cells: Sequence[Cell]) -> Iterator[str]:
    yield from table("camera", "law", *(f"Fig. {figure}" for figure in FIGURES), "runs of all searches")
    for cell in cells:
        shares = (
            math.fsum(search.shares[figure] for search in cell.searches) / len(cell.searches)
            for figure in FIGURES
        )
        percents = " | ".join(f"{100 * share:.0f} %" for share in shares)
        runs = sum(search.runs for search in cell.searches)
        yield f"| {cell.camera} | {cell.law} | {percents} | {runs} |"


def _box_lines(cells: Sequence[Cell]) -> Iterator[str]:
    yield from table("law", "best sets", "on a bound", "which")
    for law in FAMILIES:
        searches = [search for cell in cells if cell.law == law for search in cell.searches]
        sets = [best.gains for search in searches for pair in search.best.values() for best in pair]
        ends = [on_bounds(law, gains) for gains in sets]
        count = Counter(end for one in ends for end in one)
        which = ", ".join(f"{end}: {times}" for end, times in sorted(count.items()))
        if sets:
            yield f"| {law} | {len(sets)} | {len([1 for one in ends if one])} | {which or '-'} |"


def on_bounds(law: str, gains: Gains) -> list[str]:
    """The gains that are at their least or their most."""
    return [
        f"{name} {side}"
        for name, bounds in FAMILIES[law].bounds.items()
        for side, bound in zip(("least", "most"), bounds, strict=True)
        if gains[name] == rounded(bound)
    ]


def _set_lines(cells: Sequence[Cell]) -> Iterator[str]:
    yield from table("camera", "law", "path", "gains", "runs that settle, errors")
    for cell in cells:
        for path in PATHS:
            best = middle_search(cell, path).best[path][-1]
            gains = ", ".join(f"{name} {value:g}" for name, value in best.gains.items())
            figures = "; ".join(f"Fig. {figure}: {errors(runs)}" for figure, runs in best.held_out.items())
            yield f"| {cell.camera} | {cell.law} | {path} | {gains} | {figures} |"


def middle_search(cell: Cell, path: str) -> Found:
    """By its best set for the path at the end."""

    def rank(search: Found) -> tuple[float, float]:
        runs = search.best[path][-1].whole()
        return -runs.settled, middle(runs.truth_cm) or 0.0

    return sorted(cell.searches, key=rank)[(len(cell.searches) - 1) // 2]


def errors(runs: HeldOut) -> str:
    """How many settle, and their errors in truth and as the camera sees it."""
    if not runs.settled:
        return f"0 of {runs.runs}"
    both = f"{shown(middle(runs.truth_cm))} / {shown(middle(runs.camera_cm))}"
    return f"{runs.settled} of {runs.runs}: {both}"


def _one_lines(one: Runs) -> Iterator[str]:
    yield from table("camera", "start", PAPER.name, "chattering", f"{RETUNED.name}, this set", "chattering")
    for camera, figure in dict.fromkeys((camera, figure) for camera, figure, _ in one):
        both = [one[camera, figure, law] for law in LAWS]
        texts = (f"{errors(runs)} | {shown(middle(runs.chattering_m_s2))}" for runs in both)
        yield f"| {camera} | Fig. {figure} | {' | '.join(texts)} |"


def one_verdicts(one: Runs) -> dict[tuple[str, str], tuple[list[float | None], str]]:
    """By camera and measure: the medians of both laws, and the law whose one is the smaller."""
    found = {}
    for camera in dict.fromkeys(camera for camera, _, _ in one):
        both = [
            reduce(add, (runs for (at, _, of), runs in one.items() if (at, of) == (camera, law)))
            for law in LAWS
        ]
        for measure in MEASURES[1:]:
            better = LAWS[0] if measure.beats(both[0], both[1]) > 0.5 else LAWS[1]
            found[camera, measure.name] = [measure.value(runs) for runs in both], better
    return found


def _one_verdict_lines(one: Runs) -> Iterator[str]:
    yield from table("camera", "what", PAPER.name, f"{RETUNED.name}, this set", "smaller")
    for (camera, name), (values, better) in one_verdicts(one).items():
        yield f"| {camera} | {name} | {' | '.join(shown(value) for value in values)} | {better} |"


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
