"""Pairs of runs that differ in one thing, and whether the second ones are worse.

Runs on the same seed have the same noise, so their difference varies less than either. A seed with all its pairs is one
sample, because they share that noise. A figure is worse when the whole interval of its mean difference is on the bad
side, by more than a tolerance. Errors and firmware faults need no statistics: one more is worse.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from mirotwin.campaign.columns import BOARD_FIGURES, CHECK, STEP
from mirotwin.campaign.rows import SHARES, ResultRows
from mirotwin.campaign.statistics import Interval, Numbers, mean, mean_interval, quantile

FEWEST_FOR_GATE = 20
"""Seeds below which a comparison fails or passes by the luck of a few."""
COUNTED = ("error", "fault")
SHOWN = ("rms_position_cm", "rms_theta_deg", "settling_s")
"""Metrics of robots that are shown unless others are requested."""
GATED = (*SHOWN, "unsettled", "failed", *COUNTED)
"""Metrics of robots that are judged unless others are requested. A smaller number is better in each."""
MORE_IS_BETTER = ("frames_accepted", "frames_sent", "simulated_s", "vision_frames", "idle_cycles")


def shown(rows: ResultRows) -> tuple[str, ...]:
    """The metrics that are shown unless others are requested: of boards the times of waits, and values of parts."""
    if not rows.alone:
        return SHOWN
    own = [name for name in rows.metrics() if name not in (*BOARD_FIGURES, *SHARES) and CHECK not in name]
    return tuple(own) or ("failed",)


def judged(rows: ResultRows) -> tuple[str, ...]:
    """The metrics that are judged unless others are requested: of boards the times of waits, and shares of runs."""
    times = [name for name in rows.metrics() if STEP.fullmatch(name)]
    return (*times, "failed", *COUNTED) if rows.alone else GATED


class MetricDifference(msgspec.Struct, frozen=True):
    """A metric in `pairs` pairs of `seeds` seeds: means of both, and of second minus first with its interval.

    `without`: pairs left out because one of the two runs does not have the metric. `median`: of the differences.
    `higher`, `lower`: pairs in which the second run is higher or lower. `interval` is None for fewer than 8 seeds.
    """

    metric: str
    pairs: int
    without: int
    seeds: int
    first: float
    second: float
    difference: float
    interval: Interval | None
    median: float
    higher: int
    lower: int

    def worse(self, tolerance: float = 0.0) -> bool:
        """True if the second is worse by more than this share of the first's mean."""
        if self.metric in COUNTED:
            return self.higher > self.lower
        if self.interval is None:
            return False
        allowed = tolerance * abs(self.first)
        if self.metric in MORE_IS_BETTER:
            return self.interval.high < -allowed
        return self.interval.low > allowed


def differences(
    metrics: Sequence[str], first: ResultRows, second: ResultRows, pairs: Sequence[tuple[int, int]]
) -> list[tuple[MetricDifference, Numbers]]:
    """The difference (second minus first) of each metric that both rows of a pair have. A pair: two row numbers."""
    compared = []
    places, samples = np.array(pairs, dtype=np.int64).reshape(-1, 2), second.samples()
    for name in metrics:
        before, after = first.numbers(name)[places[:, 0]], second.numbers(name)[places[:, 1]]
        both = ~(np.isnan(before) | np.isnan(after))
        if not both.any():
            continue
        apart, seeds = (after - before)[both], samples[places[both, 1]]
        of_metric = MetricDifference(
            metric=name,
            pairs=len(apart),
            without=len(pairs) - len(apart),
            seeds=len(np.unique(seeds)),
            first=mean(before[both]),
            second=mean(after[both]),
            difference=mean(apart),
            interval=mean_interval(apart, seeds),
            median=quantile(np.sort(apart), 0.5),
            higher=int(np.count_nonzero(apart > 0.0)),
            lower=int(np.count_nonzero(apart < 0.0)),
        )
        compared.append((of_metric, apart))
    return compared
