"""The canonical bytes of a state and the digest chain over them.

What belongs here: one encoding in which equal states give equal bytes and different states different bytes.
What does not: which state there is (each object's `snapshot()`), files, and reading states back.

Each value is a tag byte and its content, little-endian throughout:

    N, T, F  None, True, False
    i        int of -2^63 .. 2^63 - 1: 8 bytes, two's complement
    I        any other int: u32 length, then the fewest bytes that hold it in two's complement
    d        float: 8 bytes of IEEE 754 binary64; -0.0 is written as 0.0, NaN is refused
    s, b     str in UTF-8, bytes: u32 length, then the content
    l        list or tuple, which count as equal: u32 number of items, then the items
    m        dict with str keys: u32 number of entries, then key and value in ascending order of the keys
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence

GENESIS = bytes(32)
"""The digest before the first state of a chain."""

_DEPTH = 64
_FLOAT = struct.Struct("<cd").pack


class CanonicalError(ValueError):
    """A state without canonical bytes; the message begins with the path of the value at fault."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
        self.path = ""

    def __str__(self) -> str:
        return f"state{self.path}: {self.reason}"


def encode(state: object) -> bytes:
    """The canonical bytes of nested dict, list, tuple, int, float, bool, str, bytes and None.

    Raises CanonicalError with the path of the value for NaN, for another type, for a key that is no str and
    for nesting deeper than 64 (a cycle).
    """
    out = bytearray()
    _put(out, state, 0)
    return bytes(out)


def digest_chain(previous: bytes, state: object) -> bytes:
    """SHA-256 over the 32 bytes of the previous digest (`GENESIS` at first) and the canonical bytes of
    `state`."""
    if len(previous) != 32:
        raise ValueError(f"a digest has 32 bytes, not {len(previous)}")
    return hashlib.sha256(previous + encode(state)).digest()


def _put(out: bytearray, value: object, depth: int) -> None:
    """Appends one value, which may be of a subclass (an IntEnum counts as its number)."""
    if value is None:
        out.append(0x4E)  # N
    elif isinstance(value, bool):
        out.append(0x54 if value else 0x46)  # T, F
    elif isinstance(value, int):
        _put_int(out, value)
    elif isinstance(value, float):
        _put_float(out, value)
    elif isinstance(value, str):
        _put_text(out, value)
    elif isinstance(value, bytes):
        _put_word(out, 0x62, len(value), 4)  # b
        out += value
    elif isinstance(value, dict):
        _put_dict(out, value, depth)
    elif isinstance(value, (list, tuple)):
        _put_items(out, value, depth)
    else:
        raise CanonicalError(f"{type(value).__name__} has no canonical form")


def _put_word(out: bytearray, tag: int, number: int, size: int) -> None:
    """Appends a tag and the `size` low bytes of a number, least significant first."""
    out.append(tag)
    while size:
        out.append(number & 255)
        number >>= 8
        size -= 1


def _put_int(out: bytearray, value: int) -> None:
    if -0x8000000000000000 <= value <= 0x7FFFFFFFFFFFFFFF:
        _put_word(out, 0x69, value, 8)  # i
    else:
        size = (value if value >= 0 else ~value).bit_length() // 8 + 1
        _put_word(out, 0x49, size, 4)  # I
        out += value.to_bytes(size, "little", signed=True)


def _put_float(out: bytearray, value: float) -> None:
    if value != value:
        raise CanonicalError("NaN has no canonical form")
    out += _FLOAT(b"d", value + 0.0)  # -0.0 + 0.0 is 0.0; no other float changes


def _put_text(out: bytearray, value: str) -> None:
    text = value.encode("utf-8", "surrogatepass")
    _put_word(out, 0x73, len(text), 4)  # s
    out += text


def _put_items(out: bytearray, value: Sequence[object], depth: int) -> None:
    if depth == _DEPTH:
        raise CanonicalError(f"nested deeper than {_DEPTH}")
    _put_word(out, 0x6C, len(value), 4)  # l
    index = 0
    try:
        for item in value:
            _put(out, item, depth + 1)
            index += 1
    except CanonicalError as error:
        error.path = f"[{index}]{error.path}"
        raise


def _put_dict(out: bytearray, value: dict[str, object], depth: int) -> None:
    if depth == _DEPTH:
        raise CanonicalError(f"nested deeper than {_DEPTH}")
    for key in value:
        if type(key) is not str:
            raise CanonicalError(f"key {key!r} is no str")
    _put_word(out, 0x6D, len(value), 4)  # m
    key = ""
    try:
        for key in sorted(value):
            _put_text(out, key)
            _put(out, value[key], depth + 1)
    except CanonicalError as error:
        error.path = f".{key}{error.path}"
        raise
