"""Rows of a results file as columns of numbers, for statistics.

Besides the figures of a run there are shares (1 true, 0 false for a run): `failed`, `fault`, `error`, `unsettled` (not
within 3 cm and 0.15 rad for the whole last second), and `check.NAME` (that check failed).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from miro_exact.bad_input import BadInput
from mirotwin.campaign.columns import CHECK, OWN
from mirotwin.campaign.design import Value, inline
from mirotwin.campaign.results import read
from mirotwin.campaign.statistics import Figures, Numbers, Seeds, figures

SHARES = ("failed", "fault", "error")
"""Verdicts whose shares are metrics."""
UNSETTLED = "unsettled"
SETTLING = "settling_s"
EVERYONE = "all runs"
NOT_FIGURES = ("settled",)
"""Has a share of its own."""


class Arm(msgspec.Struct, frozen=True):
    """Runs with the same levels of some factors. `never_settled`: runs that end outside and have no `settling_s`."""

    factors: dict[str, Value]
    runs: int
    verdicts: dict[str, int]
    never_settled: int
    metrics: dict[str, Figures | None]

    @property
    def label(self) -> str:
        return label_of(self.factors)

    def metric_label(self, name: str) -> str:
        """The metric's label with the runs that its median leaves out: runs that never settle have no time."""
        if name == SETTLING and self.never_settled:
            return f"{name} ({self.never_settled} of {self.runs} never settle)"
        return name


def label_of(factors: Mapping[str, Value]) -> str:
    """An arm by its levels: texts by themselves, numbers with the last word of their key."""
    words = [
        level if isinstance(level, str) else f"{name.rpartition('.')[2]} {level}"
        for name, level in factors.items()
    ]
    return ", ".join(words) or EVERYONE


class ResultRows:
    """The rows of one results file."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.table, self.about = read(path)
        self.count: int = self.table.num_rows

    @property
    def varied(self) -> tuple[str, ...]:
        """Columns that identify a row, without the seed."""
        return (*self.about.factors, *self.about.drawn)

    @property
    def alone(self) -> bool:
        """True if the runs are those of boards."""
        return "to_board" in self.table.column_names

    def metrics(self) -> list[str]:
        """All names that `numbers` accepts; results of another version may have fewer."""
        others = {*OWN, *self.varied, *NOT_FIGURES, *(CHECK + name for name in self.about.checks)}
        figures = [
            field.name
            for field in self.table.schema
            if field.name not in others and f"{field.type}" != "string"
        ]
        unsettled = [] if self.alone else [UNSETTLED]
        return [*figures, *SHARES, *unsettled, *(CHECK + name for name in self.about.checks)]

    def check_metric(self, name: str) -> str:
        """Raises BadInput for a name that is no metric of these rows."""
        if name not in self.metrics():
            from miro_sim.scenario.errors import remedy_for_key

            raise BadInput(self.path, "--metric", f"has no {name!r}", remedy_for_key(name, self.metrics()))
        return name

    def column(self, name: str) -> list[Any]:
        """The values of a column. Raises BadInput where there is none."""
        if self.table.column_names.count(name) != 1:
            raise BadInput(self.path, name, "there is no such column", "run the campaign again")
        values: list[Any] = self.table[name].to_pylist()
        return values

    def numbers(self, name: str) -> Numbers:
        """One number for each row; NaN for a run without it."""
        if name in SHARES:
            values = [verdict == name for verdict in self.column("verdict")]
        elif name == UNSETTLED:
            values = [None if settled is None else not settled for settled in self.column("settled")]
        elif name.startswith(CHECK):
            values = [None if value is None else value == "failed" for value in self.column(name)]
        else:
            values = self.column(name)
        try:
            return np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            raise BadInput(self.path, name, "holds no numbers", "run the campaign again") from None

    def samples(self) -> Seeds:
        """The sample of each row: its seed; with a single seed, its draw."""
        seeds = np.array(self.column("seed"), dtype=np.int64)
        if "draw" in self.table.column_names and len(np.unique(seeds)) == 1:
            return np.array(self.column("draw"), dtype=np.int64)
        return seeds

    def levels(self, name: str) -> list[Value]:
        """The values of a factor, in the order of the plan."""
        return list(dict.fromkeys(self.column(name)))

    def groups(self, by: Sequence[str]) -> dict[tuple[Value, ...], list[int]]:
        """Values of the factors `by` -> the rows that have them, both in the order of the plan."""
        for name in by:
            self._check_factor(name, "--by")
        columns = [self.column(name) for name in by]
        rows_of: dict[tuple[Value, ...], list[int]] = {}
        for row in range(self.count):
            rows_of.setdefault(tuple(column[row] for column in columns), []).append(row)
        return rows_of

    def arms(
        self, by: Sequence[str], groups: Mapping[tuple[Value, ...], list[int]], metrics: Sequence[str]
    ) -> Iterator[tuple[Arm, dict[str, Numbers]]]:
        """Each of the `groups` with its figures, and the numbers that these are made of."""
        verdicts, seeds = self.column("verdict"), self.samples()
        settled = self.column("settled") if "settled" in self.table.column_names else [None] * self.count
        columns = {name: self.numbers(name) for name in metrics}
        for levels, members in groups.items():
            places = np.array(members)
            there = {name: places[~np.isnan(column[places])] for name, column in columns.items()}
            counted = [verdicts[row] for row in members]
            arm = Arm(
                factors=dict(zip(by, levels, strict=True)),
                runs=len(members),
                verdicts={name: counted.count(name) for name in SHARES},
                never_settled=[settled[row] for row in members].count(False),
                metrics={name: figures(columns[name][of], seeds[of]) for name, of in there.items()},
            )
            yield arm, {name: columns[name][of] for name, of in there.items()}

    def keys(self, without: str = "") -> list[Hashable]:
        """A key for each row by which runs of two campaigns are paired: all that is varied, and the seed."""
        names = sorted(name for name in self.varied if name != without)
        columns = [self.column(name) for name in (*names, "seed")]
        return list(zip(*columns, strict=True))

    def _check_factor(self, name: str, option: str) -> None:
        if name not in self.about.factors:
            remedy = f"its factors: {', '.join(self.about.factors) or 'none'}"
            raise BadInput(self.path, option, f"has no factor {name!r}", remedy)

    def two_levels(self, text: str) -> tuple[str, Value, Value]:
        """FACTOR=A,B, or FACTOR alone where it has two levels. Raises BadInput."""
        name, equals, values = text.partition("=")
        self._check_factor(name, "--between")
        levels = self.levels(name)
        if not equals and len(levels) == 2:
            return name, levels[0], levels[1]
        by_text = {word: level for level in levels for word in (inline(level), f"{level}")}
        for comma in (place for place, char in enumerate(values) if char == ","):
            first, second = by_text.get(values[:comma].strip()), by_text.get(values[comma + 1 :].strip())
            if first is not None and second is not None and first != second:
                return name, first, second
        shown = ", ".join(f"{level}" for level in levels)
        raise BadInput(
            self.path, "--between", f"{text!r} names no two levels", f"give {name}=A,B of: {shown}"
        )


def paired(before: ResultRows, after: ResultRows) -> list[tuple[int, int]]:
    """Rows of the same runs in two files. Raises BadInput where there are none."""
    if sorted(before.varied) != sorted(after.varied):
        reason = f"varies {', '.join(before.varied) or 'nothing'}, not {', '.join(after.varied) or 'nothing'}"
        raise BadInput(before.path, "", reason, "give the results of a campaign with the same factors")
    places = {key: row for row, key in enumerate(before.keys())}
    pairs = [(places[key], row) for row, key in enumerate(after.keys()) if key in places]
    if not pairs:
        reason = f"has no run in common with {after.path}"
        raise BadInput(before.path, "", reason, "give results with the same seeds and values")
    return pairs


def paired_levels(rows: ResultRows, name: str, first: Value, second: Value) -> list[tuple[int, int]]:
    """Rows that differ in one factor: those with `first`, and their twins with `second`."""
    values, keys = rows.column(name), rows.keys(without=name)
    places = {key: row for row, key in enumerate(keys) if values[row] == first}
    return [(places[key], row) for row, key in enumerate(keys) if values[row] == second and key in places]
