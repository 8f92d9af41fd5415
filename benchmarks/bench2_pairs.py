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


def standings(rows: Rows, of_class: str) -> list[Standing]:
    """The entries of a class, the best one first: by comparisons won less those lost, with every other, by truth."""
    cases, names = cases_of(rows, of_class), list(ENTRIES)
    alpha = ALPHA / (len(list(combinations(names, 2))) * len(cases) * JUDGED)
    score = {name: {figure: [0, 0] for figure in FIGURES} for name in names}
    for first, second in combinations(names, 2):
        for case in cases:
            result = compared(rows[first, case], rows[second, case], alpha)
            for figure in FIGURES:
                if verdict := result.verdict(figure):
                    winner, loser = (second, first) if verdict > 0 else (first, second)
                    score[winner][figure][0] += 1
                    score[loser][figure][1] += 1
    found = [_standing(name, [rows[name, case] for case in cases], score[name]) for name in names]
    return sorted(found, key=lambda one: one.rank)


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
