"""All tables of a reproduction, as texts: claims, comparisons of the laws, figures, cameras, disturbances."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import product

from msgspec.structs import astuple, fields

from mirotwin.campaign.reproduce.better import (
    ALL_CAMERAS,
    ERRORS,
    OURS,
    THEIRS,
    Comparison,
    camera_name,
    comparisons,
)
from mirotwin.campaign.reproduce.claims import ClaimResult, findings, number
from mirotwin.campaign.reproduce.plan import (
    CAMERAS,
    CONTROLLERS,
    DISTURBANCES,
    IMPROVED,
    LEARNING,
    LOST,
    PAPER,
    RIVALS,
    STARTS,
)
from mirotwin.campaign.reproduce.rows import (
    RunRow,
    Table,
    middle,
    never_settled,
    percentile,
    rows_of,
    settled,
)
from mirotwin.campaign.reproduce.stored_tables import Row, StoredTables

NAMES = {
    PAPER: "the paper's law",
    IMPROVED: "`body_frame` with `ekf`",
    LEARNING: "the same, with `self_calibration`",
}
FIGURES = {f"Fig. {start.figure}": start.figure for start in STARTS[:3]}
"""Figures on which other cameras and disturbances are tried."""
COLUMNS: dict[str, Callable[[Sequence[RunRow]], str]] = {
    "truth cm: median": lambda rows: number(middle(rows, "rms_position_cm")),
    "95 %": lambda rows: number(percentile(rows, "rms_position_cm", 0.95)),
    "worst": lambda rows: number(percentile(rows, "rms_position_cm", 1.0)),
    "camera cm: median": lambda rows: number(middle(rows, "seen_position_cm")),
    "x / y cm": lambda rows: f"{number(middle(rows, 'rms_x_cm'))} / {number(middle(rows, 'rms_y_cm'))}",
    "heading deg": lambda rows: number(middle(rows, "rms_theta_deg")),
    "not settled": lambda rows: f"{never_settled(rows)} of {len(rows)}",
    "backward": lambda rows: f"{sum(row.reversals > 0 for row in rows)}",
    "across": lambda rows: f"{sum(row.crossings > 0 for row in rows)}",
    "chattering m/s2": lambda rows: number(middle(settled(rows), "chattering_m_s2")),
}
"""Columns of `figures` after figure and controller.

backward     runs in which the robot drives backward for a while
across       runs in which its heading crosses the limit of assumption 3
chattering   total variation of the commanded wheel speeds less the net change, in windows of ten frames, per second;
             the median of the runs that settle. All others are of all runs.
"""


def tables_of(table: Table, seeds: str) -> StoredTables:
    """`claims`, `comparisons`, `figures`, `cameras`, `disturbances`, and `lost`: runs that leave the camera's view."""
    tables = {
        "claims": _claims(table),
        "comparisons": _comparisons(table),
        "figures": _figures(table),
        "cameras": _cameras(table),
        "disturbances": _disturbances(table),
        "lost": _lost(table),
    }
    about = {"runs": f"{sum(map(len, table.values()))}", "seeds": seeds}
    return StoredTables(about, {name: list(rows) for name, rows in tables.items()})


def _claims(table: Table) -> Iterator[Row]:
    yield [field.name for field in fields(ClaimResult)]
    yield from (list(astuple(finding)) for finding in findings(table))


def _comparisons(table: Table) -> Iterator[Row]:
    yield ["rival", "camera", "error", "figure", "medians, cm", "settle", "nearer by, cm", "better"]
    for rival, camera, error in product(RIVALS, ALL_CAMERAS, ERRORS):
        for case in comparisons(table, rival, camera, error):
            yield [rival, camera_name(camera), error, f"Fig. {case.figure}", *_compared(case)]


def _compared(case: Comparison) -> Row:
    """Medians of both laws; runs of both that settle, if these decide; by how much the better one is nearer."""
    medians = f"{number(case.ours_cm)} / {number(case.theirs_cm)}" if case.pairs else ""
    decide = case.by_settled or case.nearer is None
    settle = f"{case.settled[0]} / {case.settled[1]} of {case.runs}" if decide else ""
    by = ""
    if case.nearer is not None and not decide and case.verdict in (OURS, THEIRS):
        by = "{:.2f} to {:.2f}".format(*sorted((abs(case.nearer.low), abs(case.nearer.high))))
    return [medians, settle, by, case.verdict]


def _figures(table: Table) -> Iterator[Row]:
    yield ["figure", "controller", *COLUMNS]
    for start, controller in product(STARTS, CONTROLLERS):
        if rows := rows_of(table, start.figure, controller):
            cells = (cell(rows) for cell in COLUMNS.values())
            yield [f"Fig. {start.figure}", NAMES.get(controller, controller), *cells]


def _error(rows: Sequence[RunRow]) -> str:
    """Its median and the 95 %, in truth."""
    return " / ".join(COLUMNS[name](rows) for name in ("truth cm: median", "95 %"))


def _cameras(table: Table) -> Iterator[Row]:
    yield ["camera", "controller", *FIGURES]
    for camera, controller in (*product((*CAMERAS, ""), (PAPER, IMPROVED)), ("", LEARNING)):
        cells = [_error(rows_of(table, figure, controller, camera)) for figure in FIGURES.values()]
        yield [camera_name(camera), NAMES[controller], *cells]


def _disturbances(table: Table) -> Iterator[Row]:
    yield ["disturbance", *FIGURES]
    for disturbance in ("", *DISTURBANCES):
        groups = [rows_of(table, figure, PAPER, "", disturbance) for figure in FIGURES.values()]
        cells = [f"{_error(rows)} ({COLUMNS['not settled'](rows)})" for rows in groups]
        yield [disturbance or "none: Euler's rule, words of 16 bits, no noise", *cells]


def _lost(table: Table) -> Iterator[Row]:
    """Rows that explain why one controller ends far off from one start."""
    yield ["figure", "controller", "frames lost", "frames", "median, cm", f"with {LOST.camera}, cm"]
    seen, everywhere = (
        rows_of(table, LOST.start.figure, LOST.controller, camera) for camera in ("", LOST.camera)
    )
    frames = [number(middle(seen, name), 0) for name in ("vision_lost", "vision_frames")]
    ends = [number(middle(rows, "rms_position_cm")) for rows in (seen, everywhere)]
    yield [f"Fig. {LOST.start.figure}", LOST.controller, *frames, *ends]
