"""Numbers that stand for many runs: quantiles, means, and how far another set of seeds could move them.

What belongs here: a column of numbers to its figures. What does not: which rows (`comparison`), and words (`cli`).

Intervals are percentile bootstrap intervals (Efron, "Bootstrap methods: another look at the jackknife", Annals of
Statistics 7, 1979, doi:10.1214/aos/1176344552): the figure is computed for 2000 sets of the same size, drawn with
replacement, and the middle 95 % of what comes out is the interval. The draws are those of a stream of `miro_exact.rng`,
and sums are made in a written order: the same rows give the same digits everywhere.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import msgspec
import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]
RESAMPLES = 2000
LOW, HIGH = 0.025, 0.975
STREAM = "campaign bootstrap"
"""Of seed 0."""
BATCH = 100_000
"""Words that are drawn at once."""
_TAG = hashlib.sha256(STREAM.encode()).digest()
_HALF, _WORD = np.uint64(32), np.uint64(0xFFFFFFFF)
QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


class Interval(msgspec.Struct, frozen=True):
    """The middle 95 %."""

    low: float
    high: float


class Figures(msgspec.Struct, frozen=True):
    """What `count` numbers amount to. `quantiles`: share -> value, as `quantile`."""

    count: int
    mean: float
    mean_interval: Interval
    median: float
    median_interval: Interval
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


def figures(numbers: Numbers) -> Figures | None:
    """None where there are no numbers."""
    if not len(numbers):
        return None
    ordered = np.sort(numbers)
    means, medians = [], []
    for places in draws(len(numbers)):
        drawn = numbers[places]
        means.append(mean(drawn))
        medians.append(quantile(np.sort(drawn), 0.5))
    return Figures(
        count=len(numbers),
        mean=mean(numbers),
        mean_interval=_middle(means),
        median=quantile(ordered, 0.5),
        median_interval=_middle(medians),
        quantiles={f"{share:g}": quantile(ordered, share) for share in QUANTILES},
    )


def mean_interval(numbers: Numbers) -> Interval:
    """The bootstrap interval of the mean alone."""
    return _middle([mean(numbers[places]) for places in draws(len(numbers))])


def _middle(found: list[float]) -> Interval:
    ordered = np.sort(np.array(found))
    return Interval(quantile(ordered, LOW), quantile(ordered, HIGH))
