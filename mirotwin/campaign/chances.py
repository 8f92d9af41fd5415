"""Failure rates: the interval of a share of runs, the bound that clean runs prove, and the clean runs that a fix needs.

The interval of a share is Wilson's ("Probable inference, the law of succession, and statistical inference", Journal of
the American Statistical Association 22, 1927, doi:10.1080/01621459.1927.10502953). `count` clean runs in a row have the
chance (1 - p)^count where runs fail at rate p; at 95 % that has to be 0.05 or more: the bound that Clopper and Pearson
give for none of `count` ("The use of confidence or fiducial limits illustrated in the case of the binomial", Biometrika
26, 1934, doi:10.1093/biomet/26.4.404), of which 3/count is the rule of three.
"""

from __future__ import annotations

import math

from miro_exact import dmath

DEVIATIONS = 1.96
"""Standard deviations of a normal distribution, to either side, that hold 95 %."""
UNLIKELY = 0.05
"""Significance level: an event less likely than this is taken for impossible."""


def wilson(count: int, trials: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share, from a sample of `count` in `trials`."""
    share, spread = count / trials, DEVIATIONS * DEVIATIONS / trials
    middle = share + spread / 2
    half = DEVIATIONS * math.sqrt(share * (1 - share) / trials + spread / (4 * trials))
    return (middle - half) / (1 + spread), (middle + half) / (1 + spread)


def highest_rate(clean: int) -> float:
    """The highest failure rate that `clean` clean runs leave possible, at 95 %: 1 - 0.05^(1/clean)."""
    return 1.0 - dmath.exp(dmath.log(UNLIKELY) / clean)


def needed_runs(failed: int, runs: int) -> int:
    """Clean runs after which a rate of `failed` in `runs` is ruled out, at 95 %: ln 0.05 / ln(1 - failed/runs)."""
    if failed == runs:
        return 1
    return math.ceil(
        dmath.log(UNLIKELY) / dmath.log(1.0 - failed / runs) - 1e-12
    )  # 1e-12: the logarithms' rounding


def clean_line(seeds: int, was: tuple[int, int] | None = None) -> str:
    """One line: the bound that `seeds` clean seeds prove. `was`: failed seeds and all seeds before a fix."""
    text = f"{seeds} clean seeds: failure rate below {100.0 * highest_rate(seeds):.2g} % at 95 %"
    if was is None:
        return text
    needed = needed_runs(*was)
    verdict = "fixed" if seeds >= needed else f"not proven: {needed - seeds} more"
    return f"{text}; at the old rate of {was[0]}/{was[1]} a fix needs {needed}: {verdict}"
