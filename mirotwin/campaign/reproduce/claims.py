"""Each claim of the paper's section V beside the measurement.

A verdict is computed. "holds" and "does not hold" follow from the criterion given with the claim; a claim that is true
of some cases only "holds in part". Errors and chattering are compared over the runs that settle: a robot that ran away
does not chatter. A case in which no run settles is not judged. The two claims about runs that fail to converge are
about all runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import msgspec

from mirotwin.campaign.reproduce.better import (
    ALL_CAMERAS,
    ERRORS,
    OURS,
    THEIRS,
    camera_name,
    comparisons,
    wins,
)
from mirotwin.campaign.reproduce.plan import (
    CONTROL_NOISE,
    EPSILONS,
    IMPROVED,
    INTEGRATION,
    PAPER,
    RIVALS,
    STARTS,
)
from mirotwin.campaign.reproduce.rows import RunRow, Table, middle, never_settled, rows_of, settled

HOLDS, PART, NOT, NOT_JUDGED = "holds", "holds in part", "does not hold", "not judged"
MOST = 0.9
"""A motion "is there" if so large a share of the runs has it."""
BOUND_CM = 2.40
"""The paper's own measurement error."""


FEW = 4
"""Largest number of cases of a claim that the page lists one by one."""


class Judged(NamedTuple):
    """The measured values as text, those of them that decide, and the verdict."""

    measured: str
    deciding: str
    verdict: str


class Case(NamedTuple):
    """A case of a claim, and whether the claim holds in it; None: not judged."""

    name: str
    measured: str
    holds: bool | None


class ClaimResult(msgspec.Struct, frozen=True):
    """A claim, its criterion, the measurement, the deciding part of it, and the verdict."""

    figure: str
    claim: str
    criterion: str
    measured: str
    deciding: str
    verdict: str


def _converges(rows: Sequence[RunRow]) -> str:
    """The verdict on runs of one group that have to converge."""
    position = middle(settled(rows), "rms_position_cm")
    near = position is not None and position <= BOUND_CM
    enough = len(settled(rows)) >= MOST * len(rows)
    return HOLDS if near and enough else PART if near else NOT


def _error(rows: Sequence[RunRow]) -> str:
    settled_rows = settled(rows)
    return f"{number(middle(settled_rows, 'rms_position_cm'))} cm, {len(settled_rows)} of {len(rows)} runs"


def _of_cases(cases: Sequence[bool | None], some: str = PART) -> str:
    """The verdict on a claim about all cases; `some`: the verdict if it holds in some only.

    A case None is not judged.
    """
    if all(case is None for case in cases):
        return NOT_JUDGED
    return HOLDS if all(cases) else some if any(cases) else NOT


def judged(cases: Sequence[Case]) -> Judged:
    """Judges a claim that must hold in all cases. Of many cases only the deciding few are listed."""

    def texts(some: Sequence[Case]) -> str:
        return "; ".join(f"{case.name}: {case.measured}" for case in some)

    verdict = _of_cases([case.holds for case in cases])
    if len(cases) <= FEW:
        return Judged(texts(cases), texts(cases), verdict)
    yes, no = ([case for case in cases if case.holds is holds] for holds in (True, False))
    deciding = f"{len(yes)} of {len(cases)} cases"
    if others := len(cases) - len(yes) - len(no):
        deciding += f", {others} not judged"
    if 0 < len(no) < FEW:
        deciding += f"; not {texts(no)}"
    elif 0 < len(yes) < FEW:
        deciding += f"; {texts(yes)}"
    return Judged(texts(cases), deciding, verdict)


def _plain(measured: str, verdict: str) -> Judged:
    """The result of a claim whose whole measurement decides."""
    return Judged(measured, measured, verdict)


def _approach(table: Table, figure: int) -> Judged:
    rows = rows_of(table, figure, PAPER)
    return _plain(_error(rows), _converges(rows))


def _robust(table: Table, disturbances: Sequence[str]) -> Judged:
    cases = []
    for disturbance in disturbances:
        for figure in (6, 7, 8):
            rows = rows_of(table, figure, PAPER, "", disturbance)
            cases.append(Case(f"{disturbance}, Fig. {figure}", _error(rows), _converges(rows) == HOLDS))
    return judged(cases)


def _asymptotic(table: Table) -> Judged:
    pairs = [
        [
            middle(settled(rows_of(table, figure, controller)), "seen_position_cm")
            for controller in (PAPER, IMPROVED)
        ]
        for figure in (6, 7, 8)
    ]
    small = [None if seen is None or better is None else seen <= 2.0 * better for seen, better in pairs]
    ours, theirs = (", ".join(map(number, values)) for values in zip(*pairs, strict=True))
    measured = f"{ours} cm as the camera sees it, where the improved chain leaves {theirs} cm"
    return _plain(measured, _of_cases(small, NOT))


def _heading(table: Table) -> Judged:
    groups = [rows_of(table, figure, PAPER) for figure in (6, 7, 8)]
    headings = [middle(settled(rows), "rms_theta_deg") for rows in groups]
    measured = [
        f"not judged: 0 of {len(rows)} settle" if heading is None else number(heading)
        for heading, rows in zip(headings, groups, strict=True)
    ]
    small = [None if heading is None else heading <= 4.83 for heading in headings]
    return _plain(f"{', '.join(measured)} degrees", _of_cases(small, NOT))


def _motion(table: Table, figure: int) -> Judged:
    rows = rows_of(table, figure, PAPER)
    moved = sum(row.reversals > 0 for row in rows)
    verdict = HOLDS if rows and moved >= MOST * len(rows) else PART if moved else NOT
    return _plain(f"{moved} of {len(rows)} runs", verdict)


def _assumption_3(table: Table) -> Judged:
    rows = rows_of(table, 7, PAPER)
    crossed = sum(row.crossings > 0 for row in rows)
    frames = number(middle(rows, "frames_across"), 0)
    measured = (
        f"{crossed} of {len(rows)} runs cross it; the median run spends {frames} frames within 0.1 rad of it"
    )
    return _plain(measured, HOLDS if rows and not crossed else NOT)


def _epsilon_fails(table: Table) -> Judged:
    cases = []
    for controller in EPSILONS:
        rows = [row for figure in (9, 10) for row in rows_of(table, figure, controller)]
        never = never_settled(rows)
        failing = bool(rows) and never >= MOST * len(rows)
        cases.append(Case(_short(controller), f"{never} of {len(rows)} never settle", failing))
    return judged(cases)


def _epsilon_y(table: Table) -> Judged:
    cases = []
    for controller in EPSILONS:
        for figure in (9, 10):
            rows = rows_of(table, figure, controller)
            x, y = middle(rows, "rms_x_cm"), middle(rows, "rms_y_cm")
            wide = None if x is None or y is None else y >= 2.0 * x
            cases.append(
                Case(f"{_short(controller)}, Fig. {figure}", f"x {number(x)}, y {number(y)} cm", wide)
            )
    return judged(cases)


def _short(controller: str) -> str:
    return controller.removeprefix("epsilon, ")


def _chattering(table: Table) -> Judged:
    cases = []
    for figure in (9, 10):
        for controller in EPSILONS:
            text, higher = _compared(table, figure, controller, "chattering_m_s2")
            cases.append(Case(f"Fig. {figure}, {_short(controller)}", text, higher))
    return judged(cases)


def _superior(table: Table) -> Judged:
    texts, verdicts = [], []
    for rival in RIVALS:
        counts = []
        for camera in ALL_CAMERAS:
            for error in ERRORS:
                cases = comparisons(table, rival, camera, error)
                verdicts += [case.verdict for case in cases]
                counts.append(f"{camera_name(camera)}, {error}: {wins(cases, OURS)} / {wins(cases, THEIRS)}")
        texts.append(f"beside {_short(rival)}: {'; '.join(counts)}")
    measured = (
        f"starts, of {len(STARTS)}, from which the paper's law is better / the other law: {'. '.join(texts)}"
    )
    deciding = superior(verdicts)
    return Judged(measured, deciding, _of_cases([verdict == OURS for verdict in verdicts]))


def superior(verdicts: Sequence[str]) -> str:
    """The text of the deciding measurement of the last claim."""
    better, worse = verdicts.count(OURS), verdicts.count(THEIRS)
    return f"better in {better} of {len(verdicts)} comparisons, worse in {worse}"


def _compared(table: Table, figure: int, controller: str, name: str) -> tuple[str, bool | None]:
    """A figure of the paper's law beside that of another, and whether the former is smaller: over runs that settle."""
    groups = [rows_of(table, figure, law) for law in (PAPER, controller)]
    ours, other = (middle(settled(rows), name) for rows in groups)
    if ours is None or other is None:
        counts = " beside ".join(f"{len(settled(rows))} of {len(rows)}" for rows in groups)
        return f"not judged: {counts} settle", None
    return f"{number(ours)} beside {number(other)}", ours < other


CONVERGES = (
    f"{100 * MOST:.0f} % of the runs settle (within 3 cm and 0.15 rad for the last second), and their median error is"
    f" within the measurement error of {BOUND_CM:.2f} cm"
)
DISTURBED = f"with each disturbance and from each start {CONVERGES}"
BACKWARD = f"in {100 * MOST:.0f} % of the runs the robot drives backward for a while"
# fmt: off
CLAIMS: tuple[tuple[str, str, str, Callable[[Table], Judged]], ...] = (
    ("Fig. 6", "from small initial errors the robot approaches the line", CONVERGES, partial(_approach, figure=6)),
    ("Fig. 7", "from large initial errors, too", CONVERGES, partial(_approach, figure=7)),
    ("Fig. 7", "the heading is stabilised through forward and backward motion", BACKWARD, partial(_motion, figure=7)),
    ("Fig. 7", "the motion comes from assumption 3, which the robot keeps: its heading is never across the line to the"
     " origin",
     "no run crosses it (from -3.09 rad, with the origin behind it, the robot cannot turn to 0 otherwise)",
     _assumption_3),
    ("Fig. 8", "at first the robot goes forward and backward", BACKWARD, partial(_motion, figure=8)),
    ("Fig. 8", "on the curve all three posture variables converge", CONVERGES, partial(_approach, figure=8)),
    ("Figs. 6 to 8", "the heading error goes to zero, robustly",
     "its median rms over the runs that settle is within the measurement error of 4.83 degrees", _heading),
    ("Figs. 6 to 8", "all three posture variables converge asymptotically",
     "what the camera sees of the error, and the law therefore could take away, is at most twice that of the improved"
     " chain, each over the runs that settle", _asymptotic),
    ("Figs. 6 to 8", "it is robust against integration error", DISTURBED,
     partial(_robust, disturbances=INTEGRATION)),
    ("Figs. 6 to 8", "it is robust against noise in the control signal", DISTURBED,
     partial(_robust, disturbances=CONTROL_NOISE)),
    ("Figs. 9, 10", "epsilon-tracking fails to converge",
     f"{100 * MOST:.0f} % of the runs do not settle, whatever the gains", _epsilon_fails),
    ("Figs. 9, 10", "in particular in the Y direction",
     "the median error in y of all runs is at least twice that in x, on the line and on the curve, whatever the gains",
     _epsilon_y),
    ("Figs. 9, 10", "its chattering is higher than that of the proposed law",
     "from the same starts the median index of chattering in m/s2, over the runs that settle, is higher than that of"
     " the proposed law, whatever the gains", _chattering),
    ("Figs. 6 to 10", "the proposed law is superior in tracking and robustness",
     "with each camera, by each error and from every start it is the better one, beside both sets of gains of"
     " epsilon-tracking for this loop ([the comparisons one by one](#which-of-the-two-laws-is-better))", _superior),
)
# fmt: on
"""Figure, claim, criterion, and the function that judges it; in the order of the paper."""


def findings(table: Table) -> list[ClaimResult]:
    """All claims, judged."""
    return [ClaimResult(figure, claim, rule, *judge(table)) for figure, claim, rule, judge in CLAIMS]


def number(value: float | None, digits: int = 2) -> str:
    """A number for people; a dash for None."""
    return "-" if value is None else f"{value:.{digits}f}"
