"""How entries of Mirotwin-Bench 2 are compared: pairs on the same seeds, shares that settle first, errors second.

A difference of errors is the median over the pairs of which both settle, with the interval of the sign test. Whether
more runs settle is a sign test of the pairs of which one settles (McNemar's). Of m comparisons each has a level of
0.05 / m (Bonferroni): that one of them is wrong has a chance of 5 % at most.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median
from typing import NamedTuple

import numpy as np

from benchmarks.bench2 import Row
from mirotwin.campaign.statistics import Interval, rank_interval, sign_test

ALPHA = 0.05


class Middle(NamedTuple):
    """A median with its interval, where there are enough numbers for one."""

    median: float
    interval: Interval | None

    @property
    def sign(self) -> int:
        """1 or -1 where the whole interval is on that side of 0."""
        if self.interval is None:
            return 0
        return (self.interval.low > 0.0) - (self.interval.high < 0.0)


class Comparison(NamedTuple):
    """The second entry against the first. `gained`, `lost`: seeds on which it alone settles, or the first alone.

    `settles`: 1 if more of its runs settle, -1 if fewer do, beyond chance. `truth`, `camera`: of the differences of
    errors, in the `both` pairs of which both settle; None without any.
    """

    gained: int
    lost: int
    both: int
    settles: int
    truth: Middle | None
    camera: Middle | None

    def verdict(self, figure: str) -> int:
        """1 if the second is better, -1 if it is worse: by the shares that settle, else by that error."""
        middle: Middle | None = getattr(self, figure)
        return self.settles or (0 if middle is None else -middle.sign)


def middle(numbers: Iterable[float], alpha: float) -> Middle | None:
    found = np.array(list(numbers))
    return Middle(median(found.tolist()), rank_interval(found, 1.0 - alpha)) if len(found) else None


def compared(first: Row, second: Row, alpha: float) -> Comparison:
    """Raises ValueError for runs that are no pairs."""
    pairs = list(zip(first.settled, second.settled, strict=True))
    both = [number for number, pair in enumerate(pairs) if pair == ("1", "1")]
    gained, lost = pairs.count(("0", "1")), pairs.count(("1", "0"))
    apart = sign_test(lost, gained) <= alpha
    return Comparison(
        gained,
        lost,
        len(both),
        ((gained > lost) - (gained < lost)) if apart else 0,
        middle(_apart(first.truth_cm, second.truth_cm, both), alpha),
        middle(_apart(first.camera_cm, second.camera_cm, both), alpha),
    )


def _apart(
    first: Sequence[float | None], second: Sequence[float | None], places: Iterable[int]
) -> list[float]:
    both = ((first[number], second[number]) for number in places)
    return [there - here for here, there in both if here is not None and there is not None]
