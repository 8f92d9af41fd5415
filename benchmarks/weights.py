"""How many wrong bits the CRC lets through: exact weight enumeration of a frame format's code.

HDR..CRC of one format are a linear code: a set of wrong bits passes exactly if it is a code word, whatever
the frame says. There are 2^(n-16) of them, too many to list, but the dual code has only 2^16, and
MacWilliams' identity gives the weights of the code from those of its dual.
"""

from __future__ import annotations

from math import comb

import numpy as np

from miro_protocol.crc import crc16
from miro_protocol.table import Format

CRC_BITS = 16


def covered_bits(form: Format) -> int:
    """Bits of HDR..CRC."""
    return 8 * (form.body_size + 2)


def syndromes(form: Format) -> list[int]:
    """What each single wrong bit of HDR..CRC, in the order sent, does to the CRC; those of several XOR."""
    size = form.body_size + 2
    start = crc16(bytes([form.layout]))
    good = crc16(bytes(size), start)
    return [crc16((1 << bit).to_bytes(size, "little"), start) ^ good for bit in range(covered_bits(form))]


def code_words(form: Format) -> list[int]:
    """A[w]: how many of the sets of w wrong bits the CRC lets through, for w = 0..n. A[0] = 1: none wrong."""
    length = covered_bits(form)
    counts = _dual_weights(form)
    words = []
    for weight in range(length + 1):
        total = sum(count * _krawtchouk(length, weight, dual) for dual, count in counts.items())
        words.append(total >> CRC_BITS)
    return words


def undetected_probability(form: Format, bit_error_rate: float) -> float:
    """Probability that independent bit errors in HDR..CRC make another frame with a good CRC."""
    length = covered_bits(form)
    return sum(
        count * bit_error_rate**weight * (1 - bit_error_rate) ** (length - weight)
        for weight, count in enumerate(code_words(form))
        if weight
    )


def _dual_weights(form: Format) -> dict[int, int]:
    """Weight -> how many words of the dual code have it."""
    length = covered_bits(form)
    transform = np.zeros(1 << CRC_BITS, dtype=np.int64)
    for syndrome in syndromes(form):
        transform[syndrome] += 1
    for bit in range(CRC_BITS):  # Walsh-Hadamard: bits that agree with a parity less those that do not
        halves = transform.reshape(-1, 2, 1 << bit)
        low, high = halves[:, 0].copy(), halves[:, 1].copy()
        halves[:, 0], halves[:, 1] = low + high, low - high
    weights, counts = np.unique((length - transform) // 2, return_counts=True)
    return dict(zip(weights.tolist(), counts.tolist(), strict=True))


def _krawtchouk(length: int, weight: int, dual: int) -> int:
    """Coefficient of x^weight in (1 - x)^dual (1 + x)^(length - dual)."""
    terms = (
        (-1) ** taken * comb(dual, taken) * comb(length - dual, weight - taken)
        for taken in range(min(dual, weight) + 1)
    )
    return sum(terms)
