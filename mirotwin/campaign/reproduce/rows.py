"""A row of figures for each run; medians, shares and counts of a group's rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from statistics import median
from typing import Any

import msgspec

from mirotwin.campaign.plan import Plan
from mirotwin.campaign.reproduce.plan import STARTS, RunGroup
from mirotwin.campaign.worker import RunOutcome


class RunRow(msgspec.Struct, frozen=True):
    """Figures of the first robot of a run; `error`: the reason if there are none.

    `rms_*`: root mean square over the last second, truth against reference; `seen_*`: measurement against the reference
    at its exposure (None, if the robot was not seen in that second). `settling_s` as in summary.json; `settled`: within
    3 cm and 0.15 rad for the whole last second. `vision_*`: frames, and frames in which a robot was not found. The last
    five come from `recording.theory.figures`; None or 0 if no host steered the robot.
    """

    label: str
    scenario: str
    seed: int
    error: str = ""
    digest: str = ""
    rms_x_cm: float | None = None
    rms_y_cm: float | None = None
    rms_theta_deg: float | None = None
    rms_position_cm: float | None = None
    seen_x_cm: float | None = None
    seen_y_cm: float | None = None
    seen_theta_deg: float | None = None
    seen_position_cm: float | None = None
    settling_s: float | None = None
    settled: bool = False
    off_pitch_s: float | None = None
    faults: int = 0
    vision_frames: int = 0
    vision_lost: int = 0
    reversals: int = 0
    backward_s: float = 0.0
    crossings: int = 0
    frames_across: int = 0
    chattering_m_s2: float | None = None


_COLUMNS = {"crossings": "assumption_3_crossings", "frames_across": "assumption_3_frames"}
"""Figures that a campaign's results name otherwise."""


def row_of(plan: Plan, outcome: RunOutcome) -> RunRow:
    """The row of a run that was made."""
    point = plan.design.point(outcome.run)
    (level,) = point.levels
    figures = {name: outcome.figures.get(_COLUMNS.get(name, name)) for name in RunRow.__struct_fields__}
    columns: dict[str, Any] = {name: figure for name, figure in figures.items() if figure is not None}
    return RunRow(
        f"{level.value}", level.scenario, point.seed, error=outcome.error, digest=outcome.digest, **columns
    )


Table = Mapping[str, Sequence[RunRow]]
"""Rows by the label of their group, in the order of the seeds."""


def rows_of(
    table: Table, figure: int, controller: str, camera: str = "", disturbance: str = ""
) -> Sequence[RunRow]:
    """The rows of one group; none, if it was not run."""
    start = next(start for start in STARTS if start.figure == figure)
    return table.get(RunGroup(start, controller, camera, disturbance).label, ())


def by_label(rows: Iterable[RunRow]) -> dict[str, list[RunRow]]:
    """Groups in the order in which they come."""
    labelled: dict[str, list[RunRow]] = {}
    for row in rows:
        labelled.setdefault(row.label, []).append(row)
    return labelled


def values(rows: Sequence[RunRow], name: str) -> list[float]:
    """One figure of all rows that have it, in the order of the rows."""
    return [float(value) for row in rows if (value := getattr(row, name)) is not None]


def middle(rows: Sequence[RunRow], name: str) -> float | None:
    """The median, None where no row has it."""
    numbers = values(rows, name)
    return median(numbers) if numbers else None


def percentile(rows: Sequence[RunRow], name: str, share: float) -> float | None:
    """The smallest value that so large a share of the rows does not exceed (nearest rank)."""
    numbers = sorted(values(rows, name))
    rank = -(-len(numbers) * round(share * 1000) // 1000)
    return numbers[max(rank, 1) - 1] if numbers else None


def middle_seeds(table: Table) -> dict[str, int]:
    """Group -> the seed with the median error (of an even number, the lower middle one).

    A group whose runs all failed is left out.
    """
    middles = {}
    for label, rows in table.items():
        ordered = sorted((row.rms_position_cm, row.seed) for row in rows if row.rms_position_cm is not None)
        if ordered:
            middles[label] = ordered[(len(ordered) - 1) // 2][1]
    return middles


def never_settled(rows: Sequence[RunRow]) -> int:
    """Runs that were outside of 3 cm or 0.15 rad within the last second, and runs that failed."""
    return sum(not row.settled for row in rows)


def settled(rows: Sequence[RunRow]) -> list[RunRow]:
    """Runs that were within 3 cm and 0.15 rad for the last second.

    The errors of other runs only show how far they got.
    """
    return [row for row in rows if row.settled]
