"""The canonical encoding once more, from the table in `miro_exact.canonical`, and the decoder that proves it
injective."""

from __future__ import annotations

import math
import struct


def encode(value: object) -> bytes:
    if value is None:
        return b"N"
    if value is True:
        return b"T"
    if value is False:
        return b"F"
    if isinstance(value, int):
        try:
            return b"i" + struct.pack("<q", value)
        except struct.error:
            size = 1
            while not -(1 << 8 * size - 1) <= value < 1 << 8 * size - 1:
                size += 1
            return b"I" + struct.pack("<I", size) + (value % (1 << 8 * size)).to_bytes(size, "little")
    if isinstance(value, float):
        assert not math.isnan(value)
        return b"d" + struct.pack("<d", 0.0 if value == 0.0 else value)
    if isinstance(value, str):
        text = value.encode()
        return b"s" + struct.pack("<I", len(text)) + text
    if isinstance(value, bytes):
        return b"b" + struct.pack("<I", len(value)) + value
    if isinstance(value, (list, tuple)):
        return b"l" + struct.pack("<I", len(value)) + b"".join(encode(item) for item in value)
    assert isinstance(value, dict)
    entries = b"".join(encode(key) + encode(value[key]) for key in sorted(value))
    return b"m" + struct.pack("<I", len(value)) + entries


def decode(data: bytes) -> object:
    """The value again (tuples as lists); the whole of `data` must be one value."""
    value, end = _value(data, 0)
    assert end == len(data)
    return value


def _value(data: bytes, at: int) -> tuple[object, int]:
    tag, at = data[at : at + 1], at + 1
    if tag in b"NTF":
        return {b"N": None, b"T": True, b"F": False}[tag], at
    if tag == b"i":
        return int.from_bytes(data[at : at + 8], "little", signed=True), at + 8
    if tag == b"d":
        return struct.unpack("<d", data[at : at + 8])[0], at + 8
    length, at = int.from_bytes(data[at : at + 4], "little"), at + 4
    if tag == b"l":
        items = []
        for _ in range(length):
            item, at = _value(data, at)
            items.append(item)
        return items, at
    if tag == b"m":
        entries = {}
        for _ in range(length):
            key, at = _value(data, at)
            entries[key], at = _value(data, at)
        return entries, at
    content, at = data[at : at + length], at + length
    if tag == b"s":
        return content.decode(), at
    if tag == b"I":
        return int.from_bytes(content, "little", signed=True), at
    assert tag == b"b"
    return content, at
