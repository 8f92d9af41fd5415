"""Probabilities as thresholds of a 32-bit draw, and the bit errors of non-coherent FSK."""

from __future__ import annotations

from fractions import Fraction

from miro_exact import clock

ONE = 1 << 32
"""The threshold that every draw is below."""

LN10_TENTH = 0.23025850929940458
MARGIN_STEPS = 128
"""Entries of `margin_table` in a margin of 1."""


def threshold(probability: float | Fraction) -> int:
    """A probability as the number of the 2^32 values of a draw that mean "yes", rounded half up.

    The float stands for the decimal number that it prints as, as in `clock.ticks`. Raises ValueError outside 0 .. 1.
    """
    exact = clock.exact(probability)
    if not 0 <= exact <= 1:
        raise ValueError(f"the probability {probability} is outside 0 .. 1")
    return (2 * exact * ONE + 1) // 2


def _exp(x: float) -> float:
    from miro_exact import dmath  # a hot module: not before the engine was chosen

    return dmath.exp(x)


def fsk_threshold(eb_n0_db: float, margin: float = 1.0) -> int:
    """Bit errors of non-coherent FSK in white Gaussian noise, 0.5 exp(-Eb/2N0), of a signal of `margin` the amplitude.

    Source: J. G. Proakis, Digital Communications, non-coherent detection of binary orthogonal FSK.
    """
    exponent = 0.5 * _exp(eb_n0_db * LN10_TENTH)
    return int(2147483648.0 * _exp(-(exponent * (margin * margin))) + 0.5)


def margin_table(eb_n0_db: float) -> tuple[int, ...]:
    """Thresholds of a wrong decision at margins -1, -1 + 1/128, .. 3.

    The margin is the distance of the signal from the slicer's threshold, 1 when that is in the middle. A
    margin m has the errors of a signal of m times the amplitude, 0.5 exp(-m^2 Eb/2N0). A negative one means
    that the decision is wrong unless noise turns it over: 1 - that.
    """
    table = []
    for step in range(-MARGIN_STEPS, 3 * MARGIN_STEPS + 1):
        wrong = fsk_threshold(eb_n0_db, float(step) / float(MARGIN_STEPS))
        table.append(ONE - wrong if step < 0 else wrong)
    return tuple(table)
