"""Statistics of many runs: quantiles, means, and their confidence intervals over seeds.

Runs with the same seed share its calibration, its wheels and its noise, so they are not independent: a sample is a seed
with all its runs. The interval of a mean is Student's, with the variance between seeds (Liang and Zeger, "Longitudinal
data analysis using generalized linear models", Biometrika 73, 1986, doi:10.1093/biomet/73.1.13) and one degree of
freedom less than there are seeds. The interval of a median is a percentile bootstrap (Efron, "Bootstrap methods:
another look at the jackknife", Annals of Statistics 7, 1979, doi:10.1214/aos/1176344552): the medians of 2000 sets of
equally many seeds, drawn with replacement, and their middle part: 95 % for many seeds, more for few (Hesterberg, "What
teachers should know about the bootstrap", The American Statistician 69, 2015, doi:10.1080/00031305.2015.1089789: the
expanded percentile interval). `python -m benchmarks.intervals` measures the coverage of these intervals.

The interval of a median of paired differences needs no draws: it is between two of the differences in order, whose
ranks are binomial (Thompson, "On confidence ranges for the median and other expectation distributions", Annals of
Mathematical Statistics 7, 1936, doi:10.1214/aoms/1177732502). It is exact for any distribution, at any confidence, and
0 is outside of it where the sign test says so (Dixon and Mood, "The statistical sign test", Journal of the American
Statistical Association 41, 1946, doi:10.1080/01621459.1946.10501898).

The interval of a mean is wrong where a few runs are far from all others: a sample without such runaways gives no hint
of them. `python -m benchmarks.intervals` has the figures; medians and counts of higher and lower are valid.

Draws come from a stream of `miro_exact.rng`, and sums have a fixed order: the same rows give the same digits
everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np
import numpy.typing as npt

from miro_exact import dmath
from miro_exact.rng import Stream

Numbers = npt.NDArray[np.float64]
Seeds = npt.NDArray[np.int64]
RESAMPLES = 2000
STREAM = "campaign bootstrap"
"""Of seed 0."""
QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
FEWEST = 8
"""Least number of seeds for an interval."""
_STUDENT = (1.589534, 2.55585, 2.822499, 2.372271, 1.959964)
"""Factors of 1/n^4 to 1 in the 97.5 % quantile of Student's t with n degrees of freedom."""


class Interval(msgspec.Struct, frozen=True):
    """The middle 95 %."""

    low: float
    high: float


class Figures(msgspec.Struct, frozen=True):
    """Statistics of `count` numbers of `seeds` seeds. `quantiles`: share -> value, as `quantile`.

    Intervals are None for fewer than 8 seeds.
    """

    count: int
    seeds: int
    mean: float
    mean_interval: Interval | None
    median: float
    median_interval: Interval | None
    quantiles: dict[str, float]


def quantile(ordered: Numbers, share: float) -> float:
    """Of numbers in order: between the two nearest, in proportion (Hyndman and Fan, 1996, definition 7)."""
    place = share * (len(ordered) - 1)
    below = int(place)
    above = min(below + 1, len(ordered) - 1)
    low, high = float(ordered[below]), float(ordered[above])
    return low + (high - low) * (place - below)


def mean(numbers: Numbers) -> float:
    """Added up from the first to the last."""
    return float(np.add.accumulate(numbers)[-1]) / len(numbers)


def draws(size: int, count: int = RESAMPLES) -> Iterator[npt.NDArray[np.int64]]:
    """`count` sets of `size` places from 0 to `size` - 1, each place as likely as any other."""
    word = Stream(0, STREAM).u32
    for first in range(0, count * size, size):
        words = np.fromiter(map(word, range(first, first + size)), np.uint64, size)
        yield (words * np.uint64(size) >> np.uint64(32)).astype(np.int64)


def sign_test(lower: int, higher: int) -> float:
    """Two-sided probability that chance alone splits these pairs at least as unevenly; pairs without a difference do
    not count.
    """
    count = lower + higher
    tail = sum(math.comb(count, fewer) for fewer in range(min(lower, higher) + 1))
    return min(1.0, tail / float(2 ** max(count - 1, 0)))


def rank_interval(numbers: Numbers, confidence: float = 0.95) -> Interval | None:
    """Of the median of independent numbers, exact. None where there are too few for such a confidence."""
    count, ordered = len(numbers), np.sort(numbers)
    outside = sum(
        1 for lower in range((count + 1) // 2) if sign_test(lower, count - lower) <= 1.0 - confidence
    )
    return Interval(float(ordered[outside - 1]), float(ordered[count - outside])) if outside else None


def student(freedom: int) -> float:
    """The t that 97.5 % are below: Abramowitz and Stegun, 26.7.5, to 0.00005 from 7 degrees of freedom on."""
    t = 0.0
    for factor in _STUDENT:
        t = t / freedom + factor
    return t


def figures(numbers: Numbers, seeds: Seeds) -> Figures | None:
    """`seeds`: of which each number is. None where there are no numbers."""
    if not len(numbers):
        return None
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    different, of_seed = np.unique(seeds, return_inverse=True)
    count = len(different)
    return Figures(
        count=len(numbers),
        seeds=count,
        mean=mean(numbers),
        mean_interval=mean_interval(numbers, seeds),
        median=quantile(ordered, 0.5),
        median_interval=_median_interval(ordered, of_seed[order], count),
        quantiles={f"{share:g}": quantile(ordered, share) for share in QUANTILES},
    )


def mean_interval(numbers: Numbers, seeds: Seeds) -> Interval | None:
    """Of the mean alone, with the variance between seeds. None for fewer than 8 seeds."""
    different, of_seed = np.unique(seeds, return_inverse=True)
    count = len(different)
    if count < FEWEST:
        return None
    middle = mean(numbers)
    apart = np.zeros(count)
    np.add.at(apart, of_seed, numbers - middle)
    variance = count / (count - 1) * float(np.add.accumulate(apart * apart)[-1])
    reach = student(count - 1) * math.sqrt(variance) / len(numbers)
    return Interval(middle - reach, middle + reach)


def _median_interval(ordered: Numbers, of_seed: Seeds, count: int) -> Interval | None:
    """`ordered`: all numbers; `of_seed`: the seed of each, from 0 to `count` - 1."""
    if count < FEWEST:
        return None
    medians = [
        quantile(np.repeat(ordered, np.bincount(drawn, minlength=count)[of_seed]), 0.5)
        for drawn in draws(count)
    ]
    in_order = np.sort(np.array(medians))
    beyond = _below(-math.sqrt(count / (count - 1)) * student(count - 1))
    return Interval(quantile(in_order, beyond), quantile(in_order, 1.0 - beyond))


def _below(deviations: float) -> float:
    """The share of a normal distribution below a negative number: Abramowitz and Stegun, 26.2.17, to 7.5e-8."""
    t = 1.0 / (1.0 - 0.2316419 * deviations)
    series = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))))
    return 0.3989422804014327 * dmath.exp(-0.5 * deviations * deviations) * series
