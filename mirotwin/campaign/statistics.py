"""Numbers that stand for many runs: quantiles, means, and how far another set of seeds could move them.

Runs with the same seed share its calibration, its wheels and its noise, so they are not independent: a sample is a
seed with all its runs. The interval of a mean is Student's, with the variance between seeds (Liang and Zeger,
"Longitudinal data analysis using generalized linear models", Biometrika 73, 1986, doi:10.1093/biomet/73.1.13) and one
degree of freedom less than there are seeds. The interval of a median is a percentile bootstrap (Efron, "Bootstrap
methods: another look at the jackknife", Annals of Statistics 7, 1979, doi:10.1214/aos/1176344552): the median of 2000
sets of as many seeds, drawn with replacement, and the middle of what comes out: 95 % of it for many seeds, more for few
(Hesterberg, "What teachers should know about the bootstrap", The American Statistician 69, 2015,
doi:10.1080/00031305.2015.1089789: the expanded percentile interval). How often such intervals hold what they should:
`python -m benchmarks.intervals`.

The draws are those of a stream of `miro_exact.rng`, and sums are made in a written order: the same rows give the same
digits everywhere.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from itertools import pairwise

import msgspec
import numpy as np
import numpy.typing as npt

from miro_exact import dmath

Numbers = npt.NDArray[np.float64]
Seeds = npt.NDArray[np.int64]
RESAMPLES = 2000
STREAM = "campaign bootstrap"
"""Of seed 0."""
BATCH = 100_000
"""Words that are drawn at once."""
_TAG = hashlib.sha256(STREAM.encode()).digest()
_HALF, _WORD = np.uint64(32), np.uint64(0xFFFFFFFF)
QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
FEWEST = 8
"""Seeds below which an interval says nothing."""
# fmt: off
_STUDENT = (
    12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281,
    2.2010, 2.1788, 2.1604, 2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860,
    2.0796, 2.0739, 2.0687, 2.0639, 2.0595, 2.0555, 2.0518, 2.0484, 2.0452, 2.0423,
)
# fmt: on
"""97.5 % of Student's t is below these, for 1 to 30 degrees of freedom."""
_STUDENT_FROM_30 = ((30, 2.0423), (40, 2.0211), (60, 2.0003), (120, 1.9799))
_NORMAL = 1.95996


class Interval(msgspec.Struct, frozen=True):
    """The middle 95 %."""

    low: float
    high: float


class Figures(msgspec.Struct, frozen=True):
    """What `count` numbers of `seeds` seeds amount to. `quantiles`: share -> value, as `quantile`.

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
    together = max(1, BATCH // size)
    for number in range(0, count, together):
        words = _words(number * size, min(together, count - number) * size)
        yield from (words * np.uint64(size) >> _HALF).astype(np.int64).reshape(-1, size)


def _words(first: int, count: int) -> npt.NDArray[np.uint64]:
    """Draws `u32` of the stream from index `first` on: `miro_exact.rng`, for many blocks at once."""
    blocks = np.arange(first // 4, (first + count + 3) // 4, dtype=np.uint64)
    c0, c1 = blocks & _WORD, blocks >> _HALF
    c2, c3 = (
        np.full_like(blocks, int.from_bytes(_TAG[0:4], "little")),
        np.full_like(blocks, int.from_bytes(_TAG[4:8], "little")),
    )
    k0 = k1 = 0
    for _ in range(10):
        p0, p1 = np.uint64(0xD2511F53) * c0, np.uint64(0xCD9E8D57) * c2
        c0, c1, c2, c3 = (
            (p1 >> _HALF) ^ c1 ^ np.uint64(k0),
            p1 & _WORD,
            (p0 >> _HALF) ^ c3 ^ np.uint64(k1),
            p0 & _WORD,
        )
        k0, k1 = (k0 + 0x9E3779B9) & 0xFFFFFFFF, (k1 + 0xBB67AE85) & 0xFFFFFFFF
    words = np.stack((c0, c1, c2, c3), axis=1).reshape(-1)
    return words[first % 4 : first % 4 + count]


def student(freedom: int) -> float:
    """The t that 97.5 % are below; above 30 degrees of freedom interpolated in their inverse, to 0.0002."""
    if freedom <= len(_STUDENT):
        return _STUDENT[freedom - 1]
    for (low, at_low), (high, at_high) in pairwise((*_STUDENT_FROM_30, (0, _NORMAL))):
        if freedom <= high or not high:
            inverse = 1.0 / high if high else 0.0
            return at_high + (at_low - at_high) * (1.0 / freedom - inverse) / (1.0 / low - inverse)
    raise AssertionError(freedom)


def figures(numbers: Numbers, seeds: Seeds) -> Figures | None:
    """`seeds`: of which each number is. None where there are no numbers."""
    if not len(numbers):
        return None
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    count, of_seed = _numbered(seeds)
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
    count, of_seed = _numbered(seeds)
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
    found = np.sort(np.array(medians))
    beyond = _below(-math.sqrt(count / (count - 1)) * student(count - 1))
    return Interval(quantile(found, beyond), quantile(found, 1.0 - beyond))


def _below(deviations: float) -> float:
    """The share of a normal distribution below a negative number: Abramowitz and Stegun, 26.2.17, to 7.5e-8."""
    t = 1.0 / (1.0 - 0.2316419 * deviations)
    series = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))))
    return 0.3989422804014327 * dmath.exp(-0.5 * deviations * deviations) * series


def _numbered(seeds: Seeds) -> tuple[int, Seeds]:
    """How many seeds there are, and for each number which one it has, numbered as they first appear."""
    numbers: dict[int, int] = {}
    places = [numbers.setdefault(seed, len(numbers)) for seed in seeds.tolist()]
    return len(numbers), np.array(places, dtype=np.int64)
