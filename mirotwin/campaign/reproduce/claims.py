"""Each claim of the paper's section V beside what was measured.

A verdict is computed. "holds" and "does not hold" are a criterion that stands with it; what is true of some cases only
"holds in part". Errors and chattering are compared over the runs that settle: a robot that ran away does not chatter.
Where none settles, that case is not judged. The two claims about runs that fail to converge are about all runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec

from mirotwin.campaign.reproduce.plan import (
    CONTROL_NOISE,
    EPSILONS,
    IMPROVED,
    INTEGRATION,
    PAPER,
    RETUNED,
    STARTS,
    Group,
)
from mirotwin.campaign.reproduce.rows import RunRow, Table, middle, never_settled, settled

HOLDS, PART, NOT, NOT_JUDGED = "holds", "holds in part", "does not hold", "not judged"
MOST = 0.9
"""A motion "is there" if so large a share of the runs has it."""
BOUND_CM = 2.40
"""The paper's own measurement error."""


class ClaimResult(msgspec.Struct, frozen=True):
    """A claim, its criterion, what was measured, and what follows."""

    figure: str
    claim: str
    criterion: str
    measured: str
    verdict: str


def findings(table: Table) -> list[ClaimResult]:
    """All claims, in the order of the paper."""
    return [claim(table) for claim in CLAIMS]


def rows_of(
    table: Table, figure: int, controller: str, camera: str = "", disturbance: str = ""
) -> Sequence[RunRow]:
    """The rows of one group; none, if it was not run."""
    start = next(start for start in STARTS if start.figure == figure)
    return table.get(Group(start, controller, camera, disturbance).label, ())


def _converges(rows: Sequence[RunRow]) -> str:
    """The verdict on runs of one group that have to converge."""
    position = middle(settled(rows), "rms_position_cm")
    near = position is not None and position <= BOUND_CM
    enough = len(settled(rows)) >= MOST * len(rows)
    return HOLDS if near and enough else PART if near else NOT


CONVERGES = (
    f"{100 * MOST:.0f} % of the runs end within 3 cm and 0.15 rad, and their median error is within the measurement"
    f" error of {BOUND_CM:.2f} cm"
)


def _approach(figure: int, words: str) -> Callable[[Table], ClaimResult]:
    def claim(table: Table) -> ClaimResult:
        rows = rows_of(table, figure, PAPER)
        return ClaimResult(f"Fig. {figure}", words, CONVERGES, _error(rows), _converges(rows))

    return claim


def _error(rows: Sequence[RunRow]) -> str:
    found = settled(rows)
    return f"{number(middle(found, 'rms_position_cm'))} cm; {len(found)} of {len(rows)} runs"


def _robust(words: str, disturbances: Sequence[str]) -> Callable[[Table], ClaimResult]:
    def claim(table: Table) -> ClaimResult:
        measured, verdicts = [], []
        for disturbance in disturbances:
            groups = [rows_of(table, figure, PAPER, "", disturbance) for figure in (6, 7, 8)]
            verdicts += [_converges(rows) for rows in groups]
            measured.append(f"{disturbance}: {', '.join(_error(rows) for rows in groups)}")
        return ClaimResult(
            "Figs. 6 to 8",
            words,
            f"with each disturbance and from each start {CONVERGES}",
            "; ".join(measured),
            _of_cases([one == HOLDS for one in verdicts]),
        )

    return claim


def _of_cases(cases: Sequence[bool | None]) -> str:
    """The verdict on a claim that is to hold in all cases. None: a case that is not judged."""
    if all(case is None for case in cases):
        return NOT_JUDGED
    return HOLDS if all(cases) else PART if any(cases) else NOT


def _asymptotic(table: Table) -> ClaimResult:
    pairs = [
        [middle(settled(rows_of(table, figure, one)), "seen_position_cm") for one in (PAPER, IMPROVED)]
        for figure in (6, 7, 8)
    ]
    small = [None if seen is None or better is None else seen <= 2.0 * better for seen, better in pairs]
    texts = [numbers(values) for values in zip(*pairs, strict=True)]
    return ClaimResult(
        "Figs. 6 to 8",
        "all three posture variables converge asymptotically",
        "what the camera sees of the error, and the law therefore could take away, is at most twice that of the"
        " improved chain, each over the runs that settle",
        f"{texts[0]} cm as the camera sees it, where the improved chain leaves {texts[1]} cm",
        HOLDS if all(small) else NOT_JUDGED if all(case is None for case in small) else NOT,
    )


def _heading(table: Table) -> ClaimResult:
    groups = [rows_of(table, figure, PAPER) for figure in (6, 7, 8)]
    headings = [middle(settled(rows), "rms_theta_deg") for rows in groups]
    measured = [
        f"not judged: 0 of {len(rows)} settle" if heading is None else number(heading)
        for heading, rows in zip(headings, groups, strict=True)
    ]
    judged = [heading <= 4.83 for heading in headings if heading is not None]
    return ClaimResult(
        "Figs. 6 to 8",
        "the heading error goes to zero, robustly",
        "its median rms over the runs that settle is within the measurement error of 4.83 degrees",
        f"{', '.join(measured)} degrees",
        NOT_JUDGED if not judged else HOLDS if all(judged) and len(judged) == 3 else NOT,
    )


def _motion(figure: int, words: str) -> Callable[[Table], ClaimResult]:
    def claim(table: Table) -> ClaimResult:
        rows = rows_of(table, figure, PAPER)
        moved = sum(row.reversals > 0 for row in rows)
        share = moved / len(rows) if rows else 0.0
        return ClaimResult(
            f"Fig. {figure}",
            words,
            f"in {100 * MOST:.0f} % of the runs the robot drives backward for a while",
            f"{moved} of {len(rows)} runs",
            HOLDS if share >= MOST else PART if moved else NOT,
        )

    return claim


def _assumption_3(table: Table) -> ClaimResult:
    rows = rows_of(table, 7, PAPER)
    crossed = sum(row.crossings > 0 for row in rows)
    return ClaimResult(
        "Fig. 7",
        "the motion comes from assumption 3, which the robot keeps: its heading is never across the line to the origin",
        "no run crosses it (from -3.09 rad, with the origin behind it, the robot cannot turn to 0 otherwise)",
        f"{crossed} of {len(rows)} runs cross it; the median run spends"
        f" {number(middle(rows, 'frames_across'), 0)} frames within 0.1 rad of it",
        HOLDS if rows and not crossed else NOT,
    )


def _epsilon_fails(table: Table) -> ClaimResult:
    measured, failing = [], 0
    for controller in EPSILONS:
        rows = [row for figure in (9, 10) for row in rows_of(table, figure, controller)]
        never = never_settled(rows)
        failing += bool(rows) and never >= MOST * len(rows)
        measured.append(f"{_short(controller)}: {never} of {len(rows)} runs never settle")
    return ClaimResult(
        "Figs. 9, 10",
        "epsilon-tracking fails to converge",
        f"{100 * MOST:.0f} % of the runs end outside of 3 cm or 0.15 rad, whatever the gains",
        "; ".join(measured),
        HOLDS if failing == len(EPSILONS) else PART if failing else NOT,
    )


def _epsilon_y(table: Table) -> ClaimResult:
    measured, wide = [], []
    for controller in EPSILONS:
        for figure in (9, 10):
            rows = rows_of(table, figure, controller)
            x, y = middle(rows, "rms_x_cm"), middle(rows, "rms_y_cm")
            wide.append(None if x is None or y is None else y >= 2.0 * x)
            measured.append(f"{_short(controller)}, Fig. {figure}: x {number(x)}, y {number(y)} cm")
    return ClaimResult(
        "Figs. 9, 10",
        "in particular in the Y direction",
        "the median error in y of all runs is at least twice that in x, on the line and on the curve, whatever the"
        " gains",
        "; ".join(measured),
        _of_cases(wide),
    )


def _short(controller: str) -> str:
    return controller.removeprefix("epsilon, ")


def _chattering(table: Table) -> ClaimResult:
    texts, higher = [], []
    for figure in (9, 10):
        for controller in EPSILONS:
            text, case = _compared(table, figure, controller, "chattering_m_s2")
            higher.append(case)
            texts.append(f"Fig. {figure}, {_short(controller)}: {text}")
    return ClaimResult(
        "Figs. 9, 10",
        "its chattering is higher than that of the proposed law",
        "from the same starts the median index of chattering in m/s2, over the runs that settle, is higher than that of"
        " the proposed law, whatever the gains",
        "; ".join(texts),
        _of_cases(higher),
    )


def _superior(table: Table) -> ClaimResult:
    texts, better = [], []
    for figure in (6, 7, 8, 9, 10):
        text, case = _compared(table, figure, RETUNED, "rms_position_cm")
        better.append(case)
        texts.append(f"Fig. {figure}: {text}")
    return ClaimResult(
        "Figs. 6 to 10",
        "the proposed law is superior in tracking and robustness",
        "its median error in cm, over the runs that settle, is smaller from every start than that of epsilon-tracking"
        " with gains for this loop",
        "; ".join(texts) + " (the gains of the proposed law are for the starts of Figs. 6 to 8)",
        _of_cases(better),
    )


def _compared(table: Table, figure: int, controller: str, name: str) -> tuple[str, bool | None]:
    """A figure of the paper's law beside that of another, and whether the former is smaller: over runs that settle."""
    groups = [rows_of(table, figure, one) for one in (PAPER, controller)]
    values = [middle(settled(rows), name) for rows in groups]
    ours, other = values
    if ours is None or other is None:
        counts = " beside ".join(f"{len(settled(rows))} of {len(rows)}" for rows in groups)
        return f"not judged: {counts} settle", None
    return f"{number(ours)} beside {number(other)}", ours < other


CLAIMS: tuple[Callable[[Table], ClaimResult], ...] = (
    _approach(6, "from small initial errors the robot approaches the line"),
    _approach(7, "from large initial errors, too"),
    _motion(7, "the heading is stabilised through forward and backward motion"),
    _assumption_3,
    _motion(8, "at first the robot goes forward and backward"),
    _approach(8, "on the curve all three posture variables converge"),
    _heading,
    _asymptotic,
    _robust("it is robust against integration error", INTEGRATION),
    _robust("it is robust against noise in the control signal", CONTROL_NOISE),
    _epsilon_fails,
    _epsilon_y,
    _chattering,
    _superior,
)


def number(value: float | None, digits: int = 2) -> str:
    """For people; a dash for what is not there."""
    return "-" if value is None else f"{value:.{digits}f}"


def numbers(found: Sequence[float | None]) -> str:
    """The same for several."""
    return ", ".join(number(value) for value in found)
