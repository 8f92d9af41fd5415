"""Pairs of entries of Mirotwin-Bench 2: which are compared, how strictly, and how entries stand in the end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from statistics import median
from typing import NamedTuple

from benchmarks.bench2 import EKF, ENTRIES, ESTIMATORS, LAWS, NONE, REFERENCE, Row
from benchmarks.bench2_score import ALPHA, Comparison, Middle, compared, middle

FIGURES = ("truth", "camera")
JUDGED = 3
"""What is compared of two entries in a case: runs that settle, truth error, camera error."""
Rows = Mapping[tuple[str, str], Row]
"""Rows of one campaign by entry and case."""


def of(rows: Iterable[Row], campaign: str) -> Rows:
    return {(row.entry, row.case): row for row in rows if row.campaign == campaign}


def cases_of(rows: Rows, word: str = "") -> list[str]:
    """Cases with this word at the end, in the order of the plan."""
    return list(dict.fromkeys(case for _, case in rows if case.endswith(word)))


class Standing(NamedTuple):
    """An entry in a class: `score`: figure -> comparisons with others that it wins, and that it loses."""

    entry: str
    settled: int
    runs: int
    errors: dict[str, Middle | None]
    score: dict[str, tuple[int, int]]

    @property
    def rank(self) -> tuple[float, ...]:
        won, lost = self.score["truth"]
        truth = self.errors["truth"]
        return (lost - won, -self.settled, truth.median if truth else 0.0)


def verdicts_of(rows: Rows, of_class: str, figure: str) -> dict[tuple[str, str], list[int]]:
    """Of each pair of entries: a verdict in each case, 1 if the second is better, -1 if it is worse."""
    cases, pairs = cases_of(rows, of_class), list(combinations(ENTRIES, 2))
    alpha = ALPHA / (len(pairs) * len(cases) * JUDGED)
    return {
        (first, second): [
            compared(rows[first, case], rows[second, case], alpha).verdict(figure) for case in cases
        ]
        for first, second in pairs
    }


def standings(rows: Rows, of_class: str) -> list[Standing]:
    """The entries of a class, the best one first: by comparisons won less those lost, with every other, by truth."""
    cases = cases_of(rows, of_class)
    score = {name: {figure: [0, 0] for figure in FIGURES} for name in ENTRIES}
    for figure in FIGURES:
        for (first, second), verdicts in verdicts_of(rows, of_class, figure).items():
            better, worse = verdicts.count(1), verdicts.count(-1)
            for name, won, lost in ((first, worse, better), (second, better, worse)):
                score[name][figure][0] += won
                score[name][figure][1] += lost
    found = [_standing(name, [rows[name, case] for case in cases], score[name]) for name in ENTRIES]
    return sorted(found, key=lambda one: one.rank)


def alike(rows: Rows, of_class: str) -> int:
    """How many of the first entries cannot be told apart by truth: no comparison of two of them decides."""
    verdicts = verdicts_of(rows, of_class, "truth")
    names = [one.entry for one in standings(rows, of_class)]
    for count in range(1, len(names)):
        pairs = [(name, names[count]) for name in names[:count]]
        if any(any(verdicts.get(pair) or verdicts[pair[::-1]]) for pair in pairs):
            return count
    return len(names)


def _standing(name: str, runs: Sequence[Row], score: Mapping[str, Sequence[int]]) -> Standing:
    return Standing(
        name,
        sum(row.settled.count("1") for row in runs),
        sum(len(row.settled) for row in runs),
        {figure: middle(of_seeds(runs, figure), ALPHA) for figure in FIGURES},
        {figure: (won, lost) for figure, (won, lost) in score.items()},
    )


def of_seeds(runs: Sequence[Row], figure: str) -> Iterator[float]:
    """For each seed the median error of its runs that settle; a seed without one is left out."""
    for number in range(len(runs[0].settled)):
        errors = [_error(row, figure, number) for row in runs if row.settled[number] == "1"]
        if there := [error for error in errors if error is not None]:
            yield median(there)


def _error(row: Row, figure: str, number: int) -> float | None:
    errors: list[float | None] = getattr(row, f"{figure}_cm")
    return errors[number]


def questions() -> list[tuple[str, str, str]]:
    """Comparisons of filters and of laws: a title, the first entry and the second."""
    laws = [
        (f"{law}, {EKF}, against {REFERENCE}, {EKF}", f"{REFERENCE}, {EKF}", f"{law}, {EKF}")
        for law in LAWS
        if law != REFERENCE
    ]
    filters = [
        (f"{law}, {estimator}, against {NONE}", f"{law}, {NONE}", f"{law}, {estimator}")
        for law in LAWS
        for estimator in ESTIMATORS
        if estimator != NONE
    ]
    return filters + laws


def asked(rows: Rows, first: str, second: str) -> dict[str, Comparison]:
    """Case -> the comparison, each with its share of 5 %."""
    cases = cases_of(rows)
    alpha = ALPHA / (len(questions()) * len(cases) * JUDGED)
    return {case: compared(rows[first, case], rows[second, case], alpha) for case in cases}
