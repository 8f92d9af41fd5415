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
from mirotwin.campaign.statistics import Interval, mean, mean_interval, quantile

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


def difference(
    metric: str, first: ResultRows, second: ResultRows, pairs: Sequence[tuple[int, int]]
) -> MetricDifference | None:
    """Of the pairs (row of `first`, row of `second`) in which both have the metric; None where there are none."""
    before, after = first.numbers(metric), second.numbers(metric)
    places = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    ours, theirs = before[places[:, 0]], after[places[:, 1]]
    both = ~(np.isnan(ours) | np.isnan(theirs))
    ours, theirs = ours[both], theirs[both]
    if not len(ours):
        return None
    apart, seeds = theirs - ours, second.samples()[places[both, 1]]
    return MetricDifference(
        metric=metric,
        pairs=len(apart),
        without=len(places) - len(apart),
        seeds=len(np.unique(seeds)),
        first=mean(ours),
        second=mean(theirs),
        difference=mean(apart),
        interval=mean_interval(apart, seeds),
        median=quantile(np.sort(apart), 0.5),
        higher=int(np.count_nonzero(apart > 0.0)),
        lower=int(np.count_nonzero(apart < 0.0)),
    )
