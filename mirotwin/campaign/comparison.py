"""Pairs of runs that differ in one thing, and whether the second ones are worse.

Runs on the same seed have the same noise, so their difference varies less than either. A seed with all its pairs is one
sample, because they share that noise. A figure is worse when the whole interval of its mean difference is on the bad
side, by more than a tolerance. Errors and firmware faults need no statistics: one more is worse.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from mirotwin.campaign.rows import ResultRows
from mirotwin.campaign.statistics import Interval, Numbers, Seeds, mean, mean_interval, quantile

FEWEST_FOR_GATE = 20
"""Seeds below which a comparison fails or passes by the luck of a few."""
COUNTED = ("error", "fault")
GATED = ("rms_position_cm", "rms_theta_deg", "settling_s", "unsettled", "failed", *COUNTED)
"""What is judged unless told. A smaller number is better in each."""
MORE_IS_BETTER = ("frames_accepted", "frames_sent", "simulated_s", "vision_frames", "idle_cycles")


class MetricDifference(msgspec.Struct, frozen=True):
    """A metric in `pairs` pairs of `seeds` seeds: means of both, and of second minus first with its interval.

    `without`: pairs that are left out, because one of the two runs does not have the metric. `median`: of the
    differences. `higher`, `lower`: in so many pairs the second is. `interval` is None for fewer than 8 seeds.
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
        """Whether the second is worse by more than this share of the first's mean."""
        if self.metric in COUNTED:
            return self.higher > self.lower
        if self.interval is None:
            return False
        allowed = tolerance * abs(self.first)
        if self.metric in MORE_IS_BETTER:
            return self.interval.high < -allowed
        return self.interval.low > allowed


def both_have(
    metric: str, first: ResultRows, second: ResultRows, pairs: Sequence[tuple[int, int]]
) -> tuple[Numbers, Numbers, Seeds]:
    """The metric's numbers in the pairs in which both have it, and the rows of `second` that these are."""
    places = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    before, after = first.numbers(metric)[places[:, 0]], second.numbers(metric)[places[:, 1]]
    both = ~(np.isnan(before) | np.isnan(after))
    return before[both], after[both], places[both, 1]


def differences(
    metrics: Sequence[str], first: ResultRows, second: ResultRows, pairs: Sequence[tuple[int, int]]
) -> list[MetricDifference]:
    """Those of the metrics that both have in a pair."""
    found = [difference(name, first, second, pairs) for name in metrics]
    return [one for one in found if one is not None]


def difference(
    metric: str, first: ResultRows, second: ResultRows, pairs: Sequence[tuple[int, int]]
) -> MetricDifference | None:
    """Of the pairs (row of `first`, row of `second`) in which both have the metric; None where there are none."""
    before, after, places = both_have(metric, first, second, pairs)
    if not len(before):
        return None
    apart, seeds = after - before, second.samples()[places]
    return MetricDifference(
        metric=metric,
        pairs=len(apart),
        without=len(pairs) - len(apart),
        seeds=len(np.unique(seeds)),
        first=mean(before),
        second=mean(after),
        difference=mean(apart),
        interval=mean_interval(apart, seeds),
        median=quantile(np.sort(apart), 0.5),
        higher=int(np.count_nonzero(apart > 0.0)),
        lower=int(np.count_nonzero(apart < 0.0)),
    )
