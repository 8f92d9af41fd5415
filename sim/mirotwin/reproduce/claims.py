"""Each claim of the paper's section V beside what was measured.

What belongs here: the claims in our words, the criterion of each, and the verdict that follows from rows. What does
not: the runs (`plan`), the page (`page`).

A verdict is computed. "holds" and "does not hold" are a criterion that stands with it; what is true of some cases only
"holds in part".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec

from mirotwin.campaign.job import Row
from mirotwin.reproduce.plan import EPSILONS, IMPROVED, PAPER, RETUNED, STARTS, Group
from mirotwin.reproduce.rows import Table, count, middle, never_settled

HOLDS, PART, NOT = "holds", "holds in part", "does not hold"
MOST = 0.9
"""A motion "is there" if so large a share of the runs has it."""
BOUND_CM = 2.40
"""The paper's own measurement error."""


class Finding(msgspec.Struct, frozen=True):
    """A claim, its criterion, what was measured, and what follows."""

    figure: str
    claim: str
    criterion: str
    measured: str
    verdict: str


def findings(table: Table) -> list[Finding]:
    """All claims, in the order of the paper."""
    return [claim(table) for claim in CLAIMS]


def rows_of(table: Table, figure: int, controller: str, camera: str = "") -> Sequence[Row]:
    """The rows of one group; none, if it was not run."""
    start = next(start for start in STARTS if start.figure == figure)
    return table.get(Group(start, controller, camera).label, ())


def _approach(figure: int, words: str) -> Callable[[Table], Finding]:
    def claim(table: Table) -> Finding:
        rows = rows_of(table, figure, PAPER)
        settled, position = len(rows) - never_settled(rows), middle(rows, "rms_position_cm")
        near = position is not None and position <= BOUND_CM
        verdict = HOLDS if near and settled >= MOST * len(rows) else PART if near else NOT
        return Finding(
            f"Fig. {figure}",
            words,
            f"the median error is within the measurement error of {BOUND_CM:.2f} cm, and {100 * MOST:.0f} % of the runs"
            " end within 3 cm and 0.15 rad",
            f"{number(position)} cm; {settled} of {len(rows)} runs",
            verdict,
        )

    return claim


def _asymptotic(table: Table) -> Finding:
    seen = [middle(rows_of(table, figure, PAPER), "seen_position_cm") for figure in (6, 7, 8)]
    better = [middle(rows_of(table, figure, IMPROVED), "seen_position_cm") for figure in (6, 7, 8)]
    small = all(
        one is not None and two is not None and one <= 2.0 * two
        for one, two in zip(seen, better, strict=True)
    )
    return Finding(
        "Figs. 6 to 8",
        "all three posture variables converge asymptotically",
        "what the camera sees of the error, and the law therefore could take away, is at most twice that of the"
        " improved chain",
        f"{numbers(seen)} cm as the camera sees it, where the improved chain leaves {numbers(better)} cm",
        HOLDS if small else NOT,
    )


def _heading(table: Table) -> Finding:
    headings = [middle(rows_of(table, figure, PAPER), "rms_theta_deg") for figure in (6, 7, 8)]
    good = all(heading is not None and heading <= 4.83 for heading in headings)
    return Finding(
        "Figs. 6 to 8",
        "the heading error goes to zero, robustly",
        "its median rms is within the measurement error of 4.83 degrees",
        f"{numbers(headings)} degrees",
        HOLDS if good else NOT,
    )


def _motion(figure: int, words: str) -> Callable[[Table], Finding]:
    def claim(table: Table) -> Finding:
        rows = rows_of(table, figure, PAPER)
        moved = count(rows, lambda row: row.reversals > 0)
        share = moved / len(rows) if rows else 0.0
        return Finding(
            f"Fig. {figure}",
            words,
            f"in {100 * MOST:.0f} % of the runs the robot drives backward for a while",
            f"{moved} of {len(rows)} runs",
            HOLDS if share >= MOST else PART if moved else NOT,
        )

    return claim


def _assumption_3(table: Table) -> Finding:
    rows = rows_of(table, 7, PAPER)
    crossed = count(rows, lambda row: row.crossings > 0)
    return Finding(
        "Fig. 7",
        "the motion comes from assumption 3, which the robot keeps: its heading is never across the line to the origin",
        "no run crosses it (from -3.09 rad, with the origin behind it, the robot cannot turn to 0 otherwise)",
        f"{crossed} of {len(rows)} runs cross it; the median run spends"
        f" {number(middle(rows, 'frames_across'), 0)} frames within 0.1 rad of it",
        HOLDS if rows and not crossed else NOT,
    )


def _epsilon_fails(table: Table) -> Finding:
    measured, failing = [], 0
    for controller in EPSILONS:
        rows = [row for figure in (9, 10) for row in rows_of(table, figure, controller)]
        never = never_settled(rows)
        failing += bool(rows) and never >= MOST * len(rows)
        measured.append(f"{controller.removeprefix('epsilon, ')}: {never} of {len(rows)} runs never settle")
    return Finding(
        "Figs. 9, 10",
        "epsilon-tracking fails to converge",
        f"{100 * MOST:.0f} % of the runs end outside of 3 cm or 0.15 rad, whatever the gains",
        "; ".join(measured),
        HOLDS if failing == len(EPSILONS) else PART if failing else NOT,
    )


def _epsilon_y(table: Table) -> Finding:
    measured, wide = [], 0
    for controller in EPSILONS:
        rows = rows_of(table, 9, controller)
        x, y = middle(rows, "rms_x_cm"), middle(rows, "rms_y_cm")
        wide += bool(x and y and y >= 2.0 * x)
        measured.append(f"{controller.removeprefix('epsilon, ')}: x {number(x)}, y {number(y)} cm")
    return Finding(
        "Fig. 9",
        "in particular in the Y direction",
        "the median error in y is at least twice that in x, whatever the gains",
        "; ".join(measured),
        HOLDS if wide == len(EPSILONS) else PART if wide else NOT,
    )


def _chattering(table: Table) -> Finding:
    pairs = []
    for figure in (9, 10):
        ours = middle(rows_of(table, figure, PAPER), "chattering_m_s2")
        pairs.append((ours, [middle(rows_of(table, figure, one), "chattering_m_s2") for one in EPSILONS]))
    higher = [all(_less(ours, others[index]) for ours, others in pairs) for index in range(len(EPSILONS))]
    text = "; ".join(
        f"Fig. {figure}: {number(ours)} m/s2 beside {numbers(others)} ({', '.join(name[9:] for name in EPSILONS)})"
        for figure, (ours, others) in zip((9, 10), pairs, strict=True)
    )
    return Finding(
        "Figs. 9, 10",
        "its chattering is higher than that of the proposed law",
        "the median index of chattering is higher from the same starts, whatever the gains",
        text,
        HOLDS if all(higher) else PART if any(higher) else NOT,
    )


def _superior(table: Table) -> Finding:
    measured, better = [], 0
    for figure in (6, 7, 8, 9, 10):
        ours, other = (middle(rows_of(table, figure, one), "rms_position_cm") for one in (PAPER, RETUNED))
        better += _less(ours, other)
        measured.append(f"Fig. {figure}: {number(ours)} beside {number(other)} cm")
    return Finding(
        "Figs. 6 to 10",
        "the proposed law is superior in tracking and robustness",
        "its median error is smaller from every start than that of epsilon-tracking with gains for this loop",
        "; ".join(measured) + " (the gains of the proposed law are for the starts of Figs. 6 to 8)",
        HOLDS if better == 5 else PART if better else NOT,
    )


CLAIMS: tuple[Callable[[Table], Finding], ...] = (
    _approach(6, "from small initial errors the robot approaches the line"),
    _approach(7, "from large initial errors, too"),
    _motion(7, "the heading is stabilised through forward and backward motion"),
    _assumption_3,
    _motion(8, "at first the robot goes forward and backward"),
    _approach(8, "on the curve all three posture variables converge"),
    _heading,
    _asymptotic,
    _epsilon_fails,
    _epsilon_y,
    _chattering,
    _superior,
)


def _less(one: float | None, other: float | None) -> bool:
    return one is not None and other is not None and one < other


def number(value: float | None, digits: int = 2) -> str:
    """For people; a dash for what is not there."""
    return "-" if value is None else f"{value:.{digits}f}"


def numbers(found: Sequence[float | None]) -> str:
    """The same for several."""
    return ", ".join(number(value) for value in found)
