"""The tables of the gain searches: how the best sets of many searches are distributed, and which law is better."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from operator import add
from pathlib import Path
from statistics import median
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
from mirotwin.campaign.reproduce.stored_tables import Row, StoredTables

DATA = Path(__file__).with_name("gains.json")
PAIR = "the paper's law beside epsilon-tracking"
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


def tables_of(results: Results, one: Runs) -> StoredTables:
    """All tables. `one`: the runs of the gain set that is a case of its own.

    pairs      in how many of 100 pairs the search of epsilon-tracking beats that of the paper's law (a search that
               settles nowhere is beaten; equals count half), and the law that wins
    spread     median of the searches (least to most); by start: the median of the runs that settle
    drawn      the share of the drawn sets that settles from a start (all of 3 runs)
    bounds     best sets that sit on a bound
    sets       the middle one of each law's searches at the end, by the runs that settle, then by the error in truth:
               its gains as keys of `[network.robot.controller]`; runs that settle, error in truth / camera error in cm
    one set    the same of a set for Figs. 6, 7 and 9; `one set, verdicts`: whose medians are the smaller ones
    """
    jobs = list(results)
    budget, repeats = jobs[0].budget, 1 + max(job.repeat for job in jobs)
    first, second = budget.sets
    searched = {
        "searches": f"{repeats}",
        "explored sets": f"{budget.explored}",
        "refined sets": f"{GENERATIONS * budget.first}",
        "sets": f"{first}",
        "sets at the end": f"{second}",
        "seeds of the search": span(range(search_seeds(0).start, search_seeds(repeats - 1).stop)),
        "seeds of the check": span(range(check_seeds(0).start, check_seeds(repeats - 1).stop)),
        "held-out seeds": span(jobs[0].held_out),
    }
    cells, duels = cells_of(results), duels_of(results)
    rows = {
        "pairs": _pair_rows(duels, budget),
        "spread": _spread_rows(cells, budget),
        "drawn": _share_rows(cells),
        "bounds": _box_rows(cells),
        "sets": _set_rows(cells),
        "one set": _one_set_rows(one),
        "one set, verdicts": _one_set_verdict_rows(one),
    }
    return StoredTables(searched, {name: list(lines) for name, lines in rows.items()})


def span(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def _pair_rows(duels: Sequence[Duel], budget: Budget) -> Iterator[Row]:
    yield ["camera", "path", PAIR, *(measure.name for measure in MEASURES)]
    rows: dict[tuple[str, str, Comparison], list[str]] = {}
    for duel in duels:
        key = duel.camera, duel.path, duel.comparison
        rows.setdefault(key, []).append(f"{100 * duel.share:.0f}{duel.winner and f': {duel.winner}'}")
    for (camera, path, comparison), shares in rows.items():
        yield [camera, path, comparison.name(budget.sets), *shares]


def _spread_rows(cells: Sequence[Cell], budget: Budget) -> Iterator[Row]:
    settles, *others = (measure.name for measure in MEASURES)
    yield ["camera", "law", "path", "sets", settles, "by start", *others]
    for cell in cells:
        for path in PATHS:
            for check, sets in enumerate(budget.sets):
                runs = cell.runs(path, check)
                settled, *errors = [spread(measure, runs) for measure in MEASURES]
                settled += f" of {runs[0].runs}"
                by_start = cell.settled_by_start(path, check)
                yield [cell.camera, cell.law, path, f"{sets}", settled, by_start, *errors]


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


def _share_rows(cells: Sequence[Cell]) -> Iterator[Row]:
    yield ["camera", "law", *(f"Fig. {figure}" for figure in FIGURES), "runs of all searches"]
    for cell in cells:
        shares = (
            math.fsum(search.shares[figure] for search in cell.searches) / len(cell.searches)
            for figure in FIGURES
        )
        runs = sum(search.runs for search in cell.searches)
        yield [cell.camera, cell.law, *(f"{100 * share:.0f} %" for share in shares), f"{runs}"]


def _box_rows(cells: Sequence[Cell]) -> Iterator[Row]:
    yield ["law", "best sets", "on a bound", "which"]
    for law in FAMILIES:
        searches = [search for cell in cells if cell.law == law for search in cell.searches]
        sets = [best.gains for search in searches for pair in search.best.values() for best in pair]
        ends = [on_bounds(law, gains) for gains in sets]
        count = Counter(end for one in ends for end in one)
        which = ", ".join(f"{end}: {times}" for end, times in sorted(count.items()))
        if sets:
            yield [law, f"{len(sets)}", f"{len([1 for one in ends if one])}", which or "-"]


def on_bounds(law: str, gains: Gains) -> list[str]:
    """The gains that are at their least or their most."""
    return [
        f"{name} {side}"
        for name, bounds in FAMILIES[law].bounds.items()
        for side, bound in zip(("least", "most"), bounds, strict=True)
        if gains[name] == rounded(bound)
    ]


def _set_rows(cells: Sequence[Cell]) -> Iterator[Row]:
    yield ["camera", "law", "path", "gains", "runs that settle, errors"]
    for cell in cells:
        for path in PATHS:
            best = middle_search(cell, path).best[path][-1]
            gains = ", ".join(f"{name} {value:g}" for name, value in best.gains.items())
            figures = "; ".join(f"Fig. {figure}: {errors(runs)}" for figure, runs in best.held_out.items())
            yield [cell.camera, cell.law, path, gains, figures]


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


def _one_set_rows(one: Runs) -> Iterator[Row]:
    yield ["camera", "start", PAPER.name, "chattering", f"{RETUNED.name}, this set", "chattering"]
    for camera, figure in dict.fromkeys((camera, figure) for camera, figure, _ in one):
        both = [one[camera, figure, law] for law in LAWS]
        texts = ((errors(runs), shown(middle(runs.chattering_m_s2))) for runs in both)
        yield [camera, f"Fig. {figure}", *(text for pair in texts for text in pair)]


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


def _one_set_verdict_rows(one: Runs) -> Iterator[Row]:
    yield ["camera", "what", PAPER.name, f"{RETUNED.name}, this set", "smaller"]
    for (camera, name), (values, better) in one_verdicts(one).items():
        yield [camera, name, *(shown(value) for value in values), better]
