"""The whitening string: what HDR..CRC are XORed with on the air. Knows nothing about frames.

A data slicer is AC-coupled and needs about as many marks as spaces in any 4 ms. Stopped robots mean zero
bytes; raw, 63 % of their 4 ms windows lie outside 30..70 % marks, whitened 0.01 % (README.md, "Why"). XOR
with a fixed string is linear, so the CRC's Hamming distance is untouched.
"""

from __future__ import annotations

LENGTH = 31


def pn9(length: int, register: int = 0x1FF, tap: int = 5) -> bytes:
    """`length` bytes of the PN9 sequence x^9 + x^tap + 1 from `register` on, low bit of each byte first."""
    out = bytearray()
    for _ in range(length):
        byte = 0
        for bit in range(8):
            byte |= (register & 1) << bit
            register = register >> 1 | ((register ^ register >> tap) & 1) << 8
        out.append(byte)
    return bytes(out)


STRING = pn9(LENGTH)
_AS_NUMBER = [int.from_bytes(STRING[:length], "little") for length in range(LENGTH + 1)]


def whiten(data: bytes | bytearray) -> bytes:
    """XORs up to 31 bytes with the string; the same call takes it off again."""
    length = len(data)
    return (int.from_bytes(data, "little") ^ _AS_NUMBER[length]).to_bytes(length, "little")
