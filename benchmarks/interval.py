"""The exact confidence interval of a probability of which there is a count; Wilson's is `mirotwin.campaign.chances`."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, lgamma, log, log1p


def clopper_pearson(count: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Exact interval for a probability of which `count` of `trials` are a sample; meant for small counts."""
    tail = (1 - confidence) / 2
    low = _solve(lambda p: 1 - _at_most(count - 1, trials, p), tail) if count else 0.0
    high = _solve(lambda p: -_at_most(count, trials, p), -tail) if count < trials else 1.0
    return low, high


def _at_most(count: int, trials: int, probability: float) -> float:
    """P(X <= count) of a binomial X."""
    return sum(
        exp(
            lgamma(trials + 1)
            - lgamma(k + 1)
            - lgamma(trials - k + 1)
            + k * log(probability)
            + (trials - k) * log1p(-probability)
        )
        for k in range(count + 1)
    )


def _solve(rising: Callable[[float], float], value: float) -> float:
    """Where a rising function of a probability reaches `value`, by bisection of the exponent."""
    low, high = log(1e-18), log1p(-1e-12)
    for _ in range(200):
        middle = (low + high) / 2
        if rising(exp(middle)) < value:
            low = middle
        else:
            high = middle
    return exp((low + high) / 2)
