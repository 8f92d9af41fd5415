"""How often the intervals of campaigns hold the truth, by simulation: 93 to 97 % is meant by 95 %.

    python -m benchmarks.intervals [--trials 2000] [--samples 8,20,50,200] [--quick]

Each trial draws a campaign whose truth is known: so many seeds, five scenarios a seed, whose values are correlated as
those of a benchmark are. The interval is the product's own. `pairs alone` is what treats each run as independent, as
`campaign show` did up to version 0.2: it stands beside to show what the seeds are for. `skewed` is log-normal with a
shape of 0.5, as errors that cannot be negative are. `runaway` is the same in cm with 2 % of the runs lost, which end 1
to 3 m off: the interval of a mean fails there, since many samples of few seeds have no such run; that of the median
does not.
"""

from __future__ import annotations

import argparse
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mirotwin.campaign.statistics import Interval, Numbers, figures, mean_interval

SHAPE = 0.5
SKEWED_MEAN = float(np.exp(SHAPE * SHAPE / 2))
LOST = 0.02
LOST_CM = (100.0, 300.0)
LOST_MEAN = (1.0 - LOST) * SKEWED_MEAN + LOST * sum(LOST_CM) / 2
LOST_MEDIAN = float(np.exp(SHAPE * NormalDist().inv_cdf(0.5 / (1.0 - LOST))))  # all runaways lie above it
KINDS = {"normal": (0.0, 0.0), "skewed": (SKEWED_MEAN, 1.0), "runaway": (LOST_MEAN, LOST_MEDIAN)}
"""Kind of values -> their mean and their median in truth."""


class Coverage(NamedTuple):
    """Shares of the trials in which the interval of the mean, that of the median, and one by pairs held the truth.

    `median` is NaN where it was not asked for.
    """

    mean: float
    median: float
    by_pairs: float


def campaign(
    draw: np.random.Generator, samples: int, scenarios: int, correlation: float, kind: str
) -> Numbers:
    """One value for each seed and scenario, all scenarios of a seed together."""
    own = draw.standard_normal((samples, scenarios)) * np.sqrt(1.0 - correlation)
    shared = draw.standard_normal((samples, 1)) * np.sqrt(correlation)
    found = (own + shared).reshape(-1)
    if kind == "normal":
        return found
    found = np.exp(SHAPE * found)
    if kind == "runaway":
        found = np.where(draw.random(len(found)) < LOST, draw.uniform(*LOST_CM, len(found)), found)
    return found


def coverage(
    samples: int,
    scenarios: int = 5,
    correlation: float = 0.95,
    trials: int = 1000,
    kind: str = "normal",
    medians: bool = False,
) -> Coverage:
    """Simulates `trials` campaigns; the same arguments give the same shares."""
    draw = np.random.Generator(np.random.Philox(key=samples * 1000 + scenarios))
    seeds = np.repeat(np.arange(samples), scenarios)
    alone = np.arange(samples * scenarios)
    truth, middle = KINDS[kind]
    held = np.zeros(3)
    for _ in range(trials):
        numbers = campaign(draw, samples, scenarios, correlation, kind)
        median = figures(numbers, seeds) if medians else None
        held += (
            holds(mean_interval(numbers, seeds), truth),
            median is not None and holds(median.median_interval, middle),
            holds(mean_interval(numbers, alone), truth),
        )
    shares: npt.NDArray[np.float64] = held / trials
    return Coverage(float(shares[0]), float(shares[1]) if medians else float("nan"), float(shares[2]))


def holds(interval: Interval | None, truth: float) -> bool:
    return interval is not None and interval.low <= truth <= interval.high


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--trials", type=int, default=2000, help="campaigns of each kind (default 2000)")
    parser.add_argument("--samples", default="8,20,50,200", help="seeds of a campaign (default 8,20,50,200)")
    parser.add_argument("--quick", action="store_true", help="no medians, which take 2000 resamples each")
    asked = parser.parse_args()
    print(f"{'seeds':>5}  {'values':7} {'correlation':>11}  {'mean':>6}  {'median':>6}  {'pairs alone':>11}")
    for samples in map(int, asked.samples.split(",")):
        for kind in KINDS:
            for correlation in (0.0, 0.5, 0.95):
                trials = asked.trials
                found = coverage(samples, 5, correlation, trials, kind, medians=not asked.quick)
                shares = f"{found.mean:6.1%}  {found.median:6.1%}  {found.by_pairs:11.1%}"
                print(f"{samples:5}  {kind:7} {correlation:11.2f}  {shares}", flush=True)


if __name__ == "__main__":
    main()
