"""Intervals by seed, number by number, as their definitions read: the bootstrap of a median and Student's of a mean."""

import math
from statistics import NormalDist

from miro_exact.rng import Stream

RESAMPLES = 2000


def quantile(numbers, share):
    ordered = sorted(numbers)
    place = share * (len(ordered) - 1)
    below = int(place)
    if below == len(ordered) - 1:
        return ordered[below]
    return ordered[below] + (ordered[below + 1] - ordered[below]) * (place - below)


def mean(numbers):
    total = 0.0
    for number in numbers:
        total += number
    return total / len(numbers)


def by_seed(numbers, seeds):
    """A list of numbers for each seed, in the order of the seeds."""
    found = {}
    for number, seed in zip(numbers, seeds, strict=True):
        found.setdefault(seed, []).append(number)
    return [found[seed] for seed in sorted(found)]


def median_interval(numbers, seeds, student):
    """The medians of 2000 sets of as many seeds, each drawn from 32 bits of one stream: the middle, wider for few."""
    samples = by_seed(numbers, seeds)
    stream = Stream(0, "campaign bootstrap")
    found = []
    for number in range(RESAMPLES):
        words = [stream.u32(number * len(samples) + at) for at in range(len(samples))]
        drawn = [one for word in words for one in samples[word * len(samples) >> 32]]
        found.append(quantile(drawn, 0.5))
    beyond = NormalDist().cdf(-math.sqrt(len(samples) / (len(samples) - 1)) * student)
    return quantile(found, beyond), quantile(found, 1.0 - beyond)


def mean_interval(numbers, seeds, student):
    """The mean, and `student` times its standard error with the variance between seeds."""
    middle = mean(numbers)
    total = 0.0
    samples = by_seed(numbers, seeds)
    for sample in samples:
        apart = 0.0
        for number in sample:
            apart += number - middle
        total += apart * apart
    count = len(samples)
    reach = student * math.sqrt(count / (count - 1) * total) / len(numbers)
    return middle - reach, middle + reach
