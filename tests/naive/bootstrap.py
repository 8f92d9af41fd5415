"""The bootstrap of a mean and a median, number by number, as its definition reads.

What belongs here: plain loops. What does not: anything of `mirotwin.campaign.statistics`, which it is compared with.
"""

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


def resampled(numbers):
    """2000 lists of as many numbers, each drawn from 32 bits of one stream."""
    stream = Stream(0, "campaign bootstrap")
    for number in range(RESAMPLES):
        words = [stream.u32(number * len(numbers) + at) for at in range(len(numbers))]
        yield [numbers[word * len(numbers) >> 32] for word in words]


def interval(numbers, figure):
    found = [figure(drawn) for drawn in resampled(numbers)]
    return quantile(found, 0.025), quantile(found, 0.975)
