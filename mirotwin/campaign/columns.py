"""The columns of a results file: the figures of `summary.json` and others.

    run                                    number of the run in the plan, from 0
    one column a factor and a drawn key, `draw` (where something is drawn), `seed`
    verdict, error, failure, digest
    the figures of `summary.json`; those of the first robot, as there
    of a board `step_N_ms` too, how long each wait took, and the values that the campaign names, by PART.KEY
    check.NAME                             verdict of that check

To add a column, add a line to `COLUMNS`. A column is computed from a `Summary` and `Tracks`; figures that neither has
yet are counted in `Tracks.add`, which gets every `Period`. Describe the column in docs/formats/parquet.md. A number
that is added to a struct of `summary.json` (`_PARTS`) becomes a column automatically. Statistics, pages and the table
of that page follow.

Wall times are in a file of their own (`results`), because all the rest is the same on every machine.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, reduce
from typing import Any, TypeAlias, get_args, get_type_hints

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.campaign.design import as_kind
from mirotwin.recording.theory.figures import (
    Assumption1,
    Assumption2,
    Assumption3,
    DisturbanceFigures,
    Theory,
)
from mirotwin.recording.track import Tracks, settled
from mirotwin.runs.board_summary import AnySummary, BoardSummary, SerialFigures
from mirotwin.runs.summary import FirmwareCounts, LinkCounts, Summary, Tracking, VisionCounts, tracking_of

TEXTS = ("verdict", "error", "failure", "digest")
OWN = ("run", "draw", "seed", *TEXTS)
"""Names that no factor can have."""
CHECK = "check."
SEEN = ("seen_x_cm", "seen_y_cm", "seen_theta_deg", "seen_position_cm")
"""Root mean squares of the camera's measurements against the reference at their exposure."""
_Part: TypeAlias = tuple[str, tuple[str, ...], type]
_PARTS: tuple[_Part, ...] = (
    ("", ("tracking",), Tracking),
    ("", ("theory",), Theory),
    ("", ("theory", "disturbance"), DisturbanceFigures),
    ("assumption_1_", ("theory", "assumption_1"), Assumption1),
    ("assumption_2_", ("theory", "assumption_2"), Assumption2),
    ("assumption_3_", ("theory", "assumption_3"), Assumption3),
    ("", ("link",), LinkCounts),
    ("vision_", ("vision",), VisionCounts),
    ("", ("firmware",), FirmwareCounts),
)
"""Prefix of the columns, path of the figures in a summary, and their struct."""
_BOARD_PARTS: tuple[_Part, ...] = (("", ("serial",), SerialFigures), ("", ("firmware",), FirmwareCounts))
"""Like `_PARTS`, for the summary of a board."""


def _kinds(struct: type) -> Iterator[tuple[str, type]]:
    """The numbers among a struct's fields."""
    for name, hint in get_type_hints(struct).items():
        kinds = [kind for kind in (get_args(hint) or (hint,)) if kind is not type(None)]
        if kinds[0] in (int, float):
            yield name, kinds[0]


class _Run:
    """The source of the columns of one run."""

    def __init__(self, summary: AnySummary, tracks: Tracks) -> None:
        self.summary: Any = summary
        self.first = next(iter(tracks.robots.values()), None)

    @cached_property
    def seen(self) -> Tracking:
        """The first robot's measurements of the last second."""
        if self.first is None:
            return tracking_of([])
        after_tick = self.first.errors[-1].tick - TICKS_PER_SECOND
        return tracking_of([sample for sample in self.first.measured_errors if sample.tick > after_tick])

    def worst_rms_position_cm(self) -> float | None:
        everyone = [robot.tracking for robot in self.summary.robots] or [self.summary.tracking]
        return max(
            (tracking.rms_position_cm for tracking in everyone if tracking.rms_position_cm is not None),
            default=None,
        )


_Column: TypeAlias = tuple[type, Callable[[_Run], Any]]


def _at(*way: str) -> Callable[[_Run], Any]:
    """Reads a field through structs: None where a struct on the way is None."""
    return lambda run: reduce(lambda value, part: value and getattr(value, part), way, run)


def _of_parts(parts: Sequence[_Part]) -> dict[str, _Column]:
    return {
        prefix + name: (kind, _at("summary", *way, name))
        for prefix, way, struct in parts
        for name, kind in _kinds(struct)
    }


_SIMULATED: dict[str, _Column] = {"simulated_s": (float, lambda run: run.summary.simulated_s)}
COLUMNS: Mapping[str, _Column] = {
    **_SIMULATED,
    "settled": (bool, lambda run: None if run.first is None else settled(run.first.errors)),
    "worst_rms_position_cm": (float, _Run.worst_rms_position_cm),
    **{name: (float, _at("seen", name.replace("seen_", "rms_"))) for name in SEEN},
    **_of_parts(_PARTS),
}
"""Name -> int, float or bool, and the value in one run: None where it has none. `settled`: the first robot is within
3 cm and 0.15 rad for the whole last second. `worst_rms_position_cm`: the largest `rms_position_cm` of all robots."""
FIGURES: Mapping[str, type] = {name: kind for name, (kind, _) in COLUMNS.items()}
BOARD_COLUMNS: Mapping[str, _Column] = {**_SIMULATED, **_of_parts(_BOARD_PARTS)}
"""Name -> type, and the value in one run of a board, as in `COLUMNS`."""
BOARD_FIGURES: Mapping[str, type] = {name: kind for name, (kind, _) in BOARD_COLUMNS.items()}


def figures_of(summary: AnySummary, tracks: Tracks, values: Mapping[str, type] = {}) -> dict[str, Any]:
    """The figures of one run, with those of the `values` of parts that it has. Raises ValueError for another kind."""
    run, columns = _Run(summary, tracks), COLUMNS if isinstance(summary, Summary) else BOARD_COLUMNS
    figures = {name: value(run) for name, (_, value) in columns.items()}
    parts = summary.parts if isinstance(summary, BoardSummary) else {}
    return figures | {path: as_kind(parts[path], kind) for path, kind in values.items() if path in parts}


STEP = re.compile(r"step_([0-9]+)_ms")


def step_column(number: int) -> str:
    """The column of how long the wait of step `number` took."""
    return f"step_{number}_ms"


def place_of(name: str) -> float:
    """Sort key of a column among the figures of several scenarios: steps by their numbers, then values of parts."""
    step = STEP.fullmatch(name)
    return float(step[1]) if step else math.inf if "." in name else 0.0
