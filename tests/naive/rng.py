"""Philox and the streams, written straight from the layout in `miro_exact.rng`: arbitrary integers, no cache,
mpmath.

The Gaussian looks its cell up by walking a table that mpmath makes; it shares no code with the module it
checks.
"""

import hashlib
from functools import cache

import mpmath


def philox4x32_10(counter, key):
    a, b, c, d = counter
    for step in range(10):
        k0 = (key[0] + step * 0x9E3779B9) % 2**32
        k1 = (key[1] + step * 0xBB67AE85) % 2**32
        high0, low0 = divmod(a * 0xD2511F53, 2**32)
        high1, low1 = divmod(c * 0xCD9E8D57, 2**32)
        a, b, c, d = high1 ^ b ^ k0, low1, high0 ^ d ^ k1, low0
    return a, b, c, d


def bits(seed, name, kind, number):
    """One block as a 128-bit integer, word 0 lowest."""
    tag = hashlib.sha256(name.encode("utf-8")).digest()[:8]
    counter = number.to_bytes(7, "little") + bytes([kind]) + tag
    words = [int.from_bytes(counter[i : i + 4], "little") for i in (0, 4, 8, 12)]
    key = (seed % 2**32, seed // 2**32)
    out = philox4x32_10((words[0], words[1], words[2], words[3]), key)
    return sum(word << 32 * place for place, word in enumerate(out))


def u32(seed, name, index):
    return bits(seed, name, 0, index // 4) >> 32 * (index % 4) & 0xFFFFFFFF


def u64(seed, name, index):
    return bits(seed, name, 1, index // 2) >> 64 * (index % 2) & (2**64 - 1)


def bit(seed, name, index):
    return bits(seed, name, 2, index // 128) >> (index % 128) & 1


def uniform(seed, name, index):
    return (u64(seed, name, index) // 2**11) / 2**53


@cache
def half_normal(k):
    """2^63 P(|z| < k / 16), rounded."""
    with mpmath.workprec(200):
        return int(mpmath.floor(mpmath.erf(mpmath.mpf(k) / 16 / mpmath.sqrt(2)) * 2**63 + mpmath.mpf("0.5")))


def gauss(seed, name, index):
    magnitude, sign = divmod(bits(seed, name, 3, index // 2) >> 64 * (index % 2) & (2**64 - 1), 2)
    k = 0
    while half_normal(k + 1) <= magnitude:
        k += 1
    fraction = float(magnitude - half_normal(k)) / float(half_normal(k + 1) - half_normal(k))
    middle = (k + 0.5) / 16
    z = (k + (fraction - middle / 32 * fraction * (1.0 - fraction))) / 16
    return -z if sign else z


def exact_gauss(seed, name, index):
    """The number that the same draw would give by exact inversion of the normal distribution."""
    magnitude, sign = divmod(bits(seed, name, 3, index // 2) >> 64 * (index % 2) & (2**64 - 1), 2)
    with mpmath.workprec(120):
        z = mpmath.sqrt(2) * mpmath.erfinv((mpmath.mpf(magnitude) + 0.5) / 2**63)
    return float(-z if sign else z)
