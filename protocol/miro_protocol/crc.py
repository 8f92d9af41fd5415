"""The frame's check: CRC-16 5935h, reflected. Only arithmetic belongs here, not what the bytes mean.

5935h (the M17 CRC) is the one 16-bit polynomial among the usual candidates with Hamming distance 5 for
every length from 5 to 30 bytes, so any 1 to 4 wrong bits are refused; the reflected form catches bursts of
up to 20 wire bits because a UART sends the low bit first (README.md, "Why").
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import cast

from crcmod import mkCrcFun

POLYNOMIAL = 0x5935
POLYNOMIAL_REFLECTED = int(f"{POLYNOMIAL:016b}"[::-1], 2)
INITIAL = 0xFFFF
XOR_OUT = 0xFFFF

# crcmod states its start value after the final XOR: 0 here is a register of FFFFh.
_crc = cast("Callable[..., int]", mkCrcFun(0x10000 | POLYNOMIAL, initCrc=0, rev=True, xorOut=XOR_OUT))


def crc16(data: bytes | bytearray, start: int = 0) -> int:
    """CRC of `data` as 0..FFFFh. `start` is the CRC of what came before it, to compute it in pieces."""
    return _crc(data, start)


def register(data: bytes) -> int:
    """The shift register after `data`: what firmware holds before the closing XOR."""
    return crc16(data) ^ XOR_OUT


@cache
def table_of(bits: int) -> tuple[int, ...]:
    """Words t for 4 or 8 bits at once: `register = register >> 8 ^ t[(register ^ byte) & 255]`.

    Of the nibbles of a byte the low one comes first: `register = register >> 4 ^ t[(register ^ nibble) & 15]`.
    """
    table = []
    for value in range(1 << bits):
        for _ in range(bits):
            value = value >> 1 ^ (POLYNOMIAL_REFLECTED if value & 1 else 0)
        table.append(value)
    return tuple(table)


def residue() -> int:
    """The register after any intact message and its CRC, low byte first: one constant to compare with."""
    return register(crc16(b"").to_bytes(2, "little"))
