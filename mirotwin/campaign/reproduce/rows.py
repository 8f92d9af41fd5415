"""The rows of a group: medians, shares and counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from mirotwin.campaign.job import Row

Table = Mapping[str, Sequence[Row]]
"""Rows by the label of their group, in the order of the seeds."""


def by_label(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Groups in the order in which they come."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.label, []).append(row)
    return found


def values(rows: Sequence[Row], name: str) -> list[float]:
    """One figure of all rows that have it, in their order."""
    return [float(value) for row in rows if (value := getattr(row, name)) is not None]


def middle(rows: Sequence[Row], name: str) -> float | None:
    """The median, None where no row has it."""
    found = sorted(values(rows, name))
    if not found:
        return None
    half = len(found) // 2
    return found[half] if len(found) % 2 else 0.5 * (found[half - 1] + found[half])


def percentile(rows: Sequence[Row], name: str, share: float) -> float | None:
    """The smallest value that so large a share of the rows does not exceed (nearest rank)."""
    found = sorted(values(rows, name))
    if not found:
        return None
    rank = -(-len(found) * round(share * 1000) // 1000)
    return found[max(rank, 1) - 1]


def middle_seeds(table: Table) -> dict[str, int]:
    """Of each group the seed whose error is the median (of an even number, the lower one); none, if all failed."""
    found = {}
    for label, rows in table.items():
        ordered = sorted((row.rms_position_cm, row.seed) for row in rows if row.rms_position_cm is not None)
        if ordered:
            found[label] = ordered[(len(ordered) - 1) // 2][1]
    return found


def count(rows: Sequence[Row], holds: Callable[[Row], bool]) -> int:
    """In how many rows."""
    return len([row for row in rows if holds(row)])


def never_settled(rows: Sequence[Row]) -> int:
    """Runs that end outside of 3 cm or 0.15 rad, and runs that failed."""
    return count(rows, lambda row: not row.settled)


def settled(rows: Sequence[Row]) -> list[Row]:
    """Runs that end within 3 cm and 0.15 rad. Errors of the others say only how far they got in 6 s."""
    return [row for row in rows if row.settled]
