"""Which of two laws is better from a start, under each camera and by each error.

Two errors are compared. *truth*: the robot against its reference. *camera*: the measurement against the reference at
its exposure, which is all that a laboratory without a second camera has. A law that follows its camera exactly inherits
the camera's own error, so the two rank laws differently.

Runs with the same seed share calibration, wheels and noise: they are compared in pairs. The first thing that counts is
how many settle. If that does not decide, the median of the differences does, over the pairs of which both settle. The
sign test decides, at a level at which all comparisons together are wrong with a probability of `SHARE` at most
(Bonferroni).
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

import msgspec
import numpy as np

from mirotwin.campaign.reproduce.plan import CAMERAS, PAPER, RIVALS, STARTS
from mirotwin.campaign.reproduce.rows import RunRow, Table, rows_of
from mirotwin.campaign.statistics import Interval, rank_interval, sign_test

ERRORS = {"truth": "rms_position_cm", "camera": "seen_position_cm"}
ALL_CAMERAS = ("", *CAMERAS)
"""The first is the scenarios' own: `1997`."""
COMPARISONS = len(STARTS) * len(ALL_CAMERAS) * len(ERRORS) * len(RIVALS)
SHARE = 0.05
LEVEL = SHARE / COMPARISONS
OURS, THEIRS, NEITHER, NOT_JUDGED = "paper", "epsilon", "neither", "not judged"


def camera_name(camera: str) -> str:
    """A camera of `ALL_CAMERAS`, for people."""
    return camera or "pixels, 1997"


class Comparison(msgspec.Struct, frozen=True):
    """The paper's law against a rival with the same seeds, from `figure`'s start, under `camera`, compared by `error`.

    `settled`: settled runs of each law, of `runs`. Medians in cm, over the `pairs` in which both settle. `nearer`:
    advantage of the paper's law in the median pair, in cm. `by_settled`: the number of settled runs decides.
    """

    figure: int
    camera: str
    error: str
    runs: int
    settled: tuple[int, int]
    pairs: int
    ours_cm: float | None
    theirs_cm: float | None
    nearer: Interval | None
    by_settled: bool
    verdict: str


def compare(table: Table, figure: int, rival: str, camera: str, error: str) -> Comparison:
    """Compares the laws; seeds that one of the two did not run are left out."""
    ours, theirs = (
        {row.seed: row for row in rows_of(table, figure, controller, camera)} for controller in (PAPER, rival)
    )
    pairs = [(ours[seed], theirs[seed]) for seed in ours if seed in theirs]
    only_ours = sum(our.settled and not other.settled for our, other in pairs)
    only_theirs = sum(other.settled and not our.settled for our, other in pairs)
    errors = _errors(pairs, ERRORS[error])
    nearer = rank_interval(np.array([other - our for our, other in errors]), 1.0 - LEVEL)
    by_settled = sign_test(only_ours, only_theirs) <= LEVEL
    if by_settled:
        verdict = OURS if only_ours > only_theirs else THEIRS
    elif nearer is None:
        verdict = NOT_JUDGED
    else:
        verdict = OURS if nearer.low > 0.0 else THEIRS if nearer.high < 0.0 else NEITHER
    return Comparison(
        figure=figure,
        camera=camera,
        error=error,
        runs=len(pairs),
        settled=(sum(our.settled for our, _ in pairs), sum(other.settled for _, other in pairs)),
        pairs=len(errors),
        ours_cm=median(our for our, _ in errors) if errors else None,
        theirs_cm=median(other for _, other in errors) if errors else None,
        nearer=nearer,
        by_settled=by_settled,
        verdict=verdict,
    )


def _errors(pairs: Sequence[tuple[RunRow, RunRow]], name: str) -> list[tuple[float, float]]:
    """Of the pairs of which both settle."""
    both = [
        (getattr(our, name), getattr(other, name)) for our, other in pairs if our.settled and other.settled
    ]
    return [(our, other) for our, other in both if our is not None and other is not None]


def comparisons(table: Table, rival: str, camera: str, error: str) -> list[Comparison]:
    """From all starts."""
    return [compare(table, start.figure, rival, camera, error) for start in STARTS]


def wins(cases: Sequence[Comparison], verdict: str) -> int:
    """In how many of them this is the verdict."""
    return len([case for case in cases if case.verdict == verdict])
