"""Random numbers as pure functions: Philox 4x32-10, named streams, and a Gaussian by table inversion.

A draw depends only on (master seed, stream name, kind of draw, index). So drawing one stream never shifts another, a
switched-off noise source does not change the others, any part of a run can be evaluated separately, and there is no
generator state to save.

Layout of a Philox block (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011):

    key      k0, k1   the master seed, low and high 32 bits
    counter  c0       block number, low 32 bits
             c1       block number, high 24 bits; kind of draw in the top byte
             c2, c3   first 8 bytes of SHA-256(stream name in UTF-8), little-endian

A block is 128 bits. Kinds of draw, and how many of each one block holds (from word 0 up, least significant
bits first): 0 `u32` and `below`, 4; 1 `u64` and `uniform`, 2; 2 `bit`, 128; 3 `gauss`, 2.
"""

from __future__ import annotations

import hashlib
from array import array

from miro_exact.domain import MAX_SEED

_INDICES = 1 << 56  # C constants when compiled
_WORD = 0xFFFFFFFF
_M0 = 0xD2511F53
_M1 = 0xCD9E8D57
_W0 = 0x9E3779B9
_W1 = 0xBB67AE85
_PAIRS = 1 << 56  # kinds of draw, in the top byte of the block number
_BITS = 2 << 56
_GAUSS = 3 << 56
_NO_BLOCK = (1 << 64) - 1


def philox4x32(c0: int, c1: int, c2: int, c3: int, k0: int, k1: int) -> tuple[int, int, int, int]:
    """Ten rounds of Philox 4x32: four counter words and two key words to four random words, 32 bits each."""
    for _ in range(10):
        p0 = _M0 * c0
        p1 = _M1 * c2
        c0 = (p1 >> 32) ^ c1 ^ k0
        c1 = p1 & _WORD
        c2 = (p0 >> 32) ^ c3 ^ k1
        c3 = p0 & _WORD
        k0 = (k0 + _W0) & _WORD
        k1 = (k1 + _W1) & _WORD
    return c0, c1, c2, c3


class Stream:
    """One named stream of a master seed. Indices 0 .. 2^56 - 1 may be drawn in any order, and again.

    Raises ValueError for a seed outside 0 .. 2^63 - 1 and for an index outside its range.
    """

    NOT_STATE = ("*",)

    def __init__(self, seed: int, name: str) -> None:
        tag = hashlib.sha256(name.encode()).digest()
        self.name = name
        self.name0 = int.from_bytes(tag[0:4], "little")
        self.name1 = int.from_bytes(tag[4:8], "little")
        self.words = [0] * 4
        self.draws = [0] * 16
        self.least = 0  # of them
        self.reseed(seed)

    def reseed(self, seed: int) -> None:
        """From now on the stream of this name of another master seed. Raises ValueError as a new one does."""
        if not 0 <= seed <= MAX_SEED:
            raise ValueError(f"seed {seed} is outside 0 .. {MAX_SEED}")
        self.seed = seed
        self.k0 = seed & 0xFFFFFFFF
        self.k1 = seed >> 32
        self.block = _NO_BLOCK  # what is cached is the old seed's
        self.group = -1  # number of the 16 draws of `u32` that are in `draws`

    def __repr__(self) -> str:
        return f"Stream({self.seed}, {self.name!r})"

    def load(self, block: int) -> None:
        """Puts block `kind << 56 | number` into `words`; the last one stays there as a cache."""
        if block != self.block:
            self.words[0], self.words[1], self.words[2], self.words[3] = philox4x32(
                block & _WORD, block >> 32, self.name0, self.name1, self.k0, self.k1
            )
            self.block = block

    def blocks(self, first: int, count: int, words: list[int]) -> None:
        """Writes up to 112 blocks of kind 0 into `words`, from block number `first` on.

        Their first words are at index 0 and up, their second words at 112 and up, and so on. Four blocks are computed
        at a time, so up to three more than `count` are written.
        """
        four = [0] * 16
        for at in range(0, count, 4):
            self._four_blocks(first + at, four)
            for lane in range(4):
                words[at + lane] = four[lane]
                words[at + lane + 112] = four[lane + 4]
                words[at + lane + 224] = four[lane + 8]
                words[at + lane + 336] = four[lane + 12]

    def _four_blocks(self, first: int, four: list[int]) -> None:
        """Four blocks of kind 0 from block number `first` on, equal to those of `philox4x32`, computed in vectors.

        Their first words are at index 0 and up, their second words at 4 and up, and so on.
        """
        m0, m1, mask = 0xD2511F53, 0xCD9E8D57, 0xFFFFFFFF  # in locals, compilers know that these are 32 bits
        for lane in range(4):
            four[lane] = (first + lane) & mask
            four[lane + 4] = (first + lane) >> 32
            four[lane + 8] = self.name0
            four[lane + 12] = self.name1
        k0, k1 = self.k0, self.k1
        for _ in range(10):
            for lane in range(4):
                p0 = m0 * four[lane]
                p1 = m1 * four[lane + 8]
                four[lane] = (p1 >> 32) ^ four[lane + 4] ^ k0
                four[lane + 4] = p1 & mask
                four[lane + 8] = (p0 >> 32) ^ four[lane + 12] ^ k1
                four[lane + 12] = p0 & mask
            k0 = (k0 + _W0) & mask
            k1 = (k1 + _W1) & mask

    def u32(self, index: int) -> int:
        """32 random bits."""
        if index < 0 or index >= _INDICES:
            raise ValueError(f"{self!r}: index {index} is outside 0 .. 2^56 - 1")
        if index >> 4 != self.group:
            self._load_draws(index >> 4)
        return self.draws[(index & 3) << 2 | (index >> 2) & 3]

    def _load_draws(self, group: int) -> None:
        """Sixteen draws of `u32`, which are worked out at once and stay there as a cache."""
        self._four_blocks(group << 2, self.draws)
        self.group = group
        self.least = self.draws[0]
        for place in range(1, 16):
            self.least = min(self.least, self.draws[place])

    def below(self, index: int, threshold: int) -> bool:
        """True with probability threshold / 2^32 (threshold 0 .. 2^32); the draw is `u32(index)`."""
        return self.u32(index) < threshold

    def next_below(self, index: int, end: int, threshold: int) -> int:
        """The first index from `index` on, and before `end`, at which `below` is true; `end` if there is none."""
        if index < 0 or end > _INDICES:
            raise ValueError(f"{self!r}: indices {index} .. {end} are outside 0 .. 2^56 - 1")
        if threshold == 0:
            return end
        while index < end:
            if index >> 4 != self.group:
                self._load_draws(index >> 4)
            if self.least >= threshold:
                index = (index >> 4) + 1 << 4
            elif self.u32(index) >= threshold:
                index += 1
            else:
                return index
        return end

    def u64(self, index: int) -> int:
        """64 random bits."""
        return self.pair(_PAIRS, index)

    def pair(self, kind: int, index: int) -> int:
        """64 random bits of the kind of draw that is given in its place (the top byte)."""
        if index < 0 or index >= _INDICES:
            raise ValueError(f"{self!r}: index {index} is outside 0 .. 2^56 - 1")
        self.load(kind | (index >> 1))
        first = (index & 1) << 1
        return (self.words[first + 1] << 32) | self.words[first]

    def bit(self, index: int) -> int:
        """One random bit, 0 or 1."""
        return (self.bits(index) >> (index & 31)) & 1

    def bits(self, index: int) -> int:
        """The 32 random bits to which `bit(index)` belongs, the one of the lowest index lowest."""
        if index < 0 or index >= _INDICES:
            raise ValueError(f"{self!r}: index {index} is outside 0 .. 2^56 - 1")
        self.load(_BITS | (index >> 7))
        return self.words[(index >> 5) & 3]

    def uniform(self, index: int) -> float:
        """A multiple of 2^-53 in [0, 1): the upper 53 bits of `u64(index)`, exact."""
        return float(self.pair(_PAIRS, index) >> 11) * (1.0 / 9007199254740992.0)

    def gauss(self, index: int) -> float:
        """A standard normal number out of one 64-bit draw: bit 0 is the sign, the other 63 the magnitude.

        The magnitude is looked up in `HALF_NORMAL` (integers), and placed inside its cell of 1/16 sigma by
        the inverse of a density that falls linearly there. P(|z| < k/16) is right to 2^-64 for every k; in
        between the distribution function is off by less than 1.6e-6. The largest magnitude is a little
        above 9.
        """
        draw = self.pair(_GAUSS, index)
        magnitude = draw >> 1
        cell, above = 0, 147  # entries of the table between which the magnitude is
        while above - cell > 1:
            half = (cell + above) >> 1
            if _TABLE[half] <= magnitude:
                cell = half
            else:
                above = half
        low = _TABLE[cell]
        fraction = float(magnitude - low) / float(_TABLE[above] - low)
        middle = (float(cell) + 0.5) * 0.0625
        place = fraction - 0.03125 * middle * fraction * (1.0 - fraction)
        z = (float(cell) + place) * 0.0625
        if draw & 1:
            return 0.0 - z
        return z


def half_normal_table() -> list[int]:
    """Entry k: 2^63 P(|z| < k/16) rounded to an integer, for k = 0, 1, .. until that is 2^63.

    In integers with 128 fraction bits, from P(|z| < x) = 2 phi(x) (x + x^3/3 + x^5/15 + ..) (Marsaglia
    2004), a series without cancellation; 1/phi(x) = sqrt(2 pi) exp(x^2/2) grows by exp((2k + 1)/512) after entry k.
    """
    unit = 1 << 128
    root = 0x281B263FEC4E0B2CAF9483F5CE459DC5F  # floor(2^128 sqrt(2 pi))
    growth, ratio = unit, 0x100802005560011127D41D5BD72F4C8F3  # exp(1/512)
    table = []
    area_63 = k = 0
    while area_63 < 1 << 63:
        table.append(area_63)
        k += 1
        odd = k * unit // 16
        area = 0
        n = 1
        while odd:
            area += odd
            n += 2
            odd = odd * k * k // (256 * n)
        growth = growth * ratio >> 128  # exp(x^2/2)
        ratio = ratio * 0x10100802AB55777D28A2A42D26AA9EE67 >> 128  # times exp(1/256)
        area_63 = ((2 * area * unit // root) * unit // growth + (1 << 64)) >> 65
    return [*table, area_63]


HALF_NORMAL = half_normal_table()
_TABLE = array("Q", HALF_NORMAL)
assert len(HALF_NORMAL) == 148
