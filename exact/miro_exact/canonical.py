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

from miro_exact.domain import DomainError

GENESIS = bytes(32)
"""The digest before the first state of a chain."""

_DEPTH = 64
_ROOM = 512
_HIGHEST = (1 << 63) - 1
_LOWEST = -(1 << 63)
_FLOAT = struct.Struct("<d").pack


class CanonicalError(ValueError):
    """A state without canonical bytes; the message begins with the path of the value at fault."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
        self.path = ""

    def __str__(self) -> str:
        return f"state{self.path}: {self.reason}"


class NotANumberError(CanonicalError, DomainError):
    """A state with NaN in it: the computation has left its domain."""


def encode(state: object) -> bytes:
    """The canonical bytes of nested dict, list, tuple, int, float, bool, str, bytes and None.

    Raises CanonicalError with the path of the value for NaN, for another type, for a key that is no str and
    for nesting deeper than 64 (a cycle).
    """
    encoder = Encoder()
    encoder.put(state, 0)
    encoder.flush()
    return bytes(encoder.out)


def digest_chain(previous: bytes, state: object) -> bytes:
    """SHA-256 over the 32 bytes of the previous digest (`GENESIS` at first) and the canonical bytes of
    `state`."""
    if len(previous) != 32:
        raise ValueError(f"a digest has 32 bytes, not {len(previous)}")
    return hashlib.sha256(previous + encode(state)).digest()


class Encoder:
    """Bytes on their way out: what is in `room` up to `used` follows what is in `out`.

    A state has some hundred values of a few bytes each, so none of them becomes an object of its own on the
    way: they are written byte by byte into the room, whose content moves to `out` when it is full.
    """

    NOT_STATE = ("out", "room", "used")

    def __init__(self) -> None:
        self.out = bytearray()
        self.room = bytearray(_ROOM)
        self.used = 0

    def flush(self) -> None:
        """Moves the room's content to `out`."""
        self.out += self.room[: self.used]
        self.used = 0

    def put(self, value: object, depth: int) -> None:
        """Appends one value: the common exact types first."""
        kind = type(value)
        if kind is int:
            self.put_int(value)  # type: ignore[arg-type]
        elif kind is dict:
            self.put_dict(value, depth)  # type: ignore[arg-type]
        elif kind is float:
            self.put_float(value)  # type: ignore[arg-type]
        elif kind is list or kind is tuple:
            self.put_items(value, depth)  # type: ignore[arg-type]
        elif kind is bool:
            self.put_tag(0x54 if value else 0x46)  # T, F
        elif value is None:
            self.put_tag(0x4E)  # N
        else:
            self.put_other(value, depth)

    def put_other(self, value: object, depth: int) -> None:
        """The rare types, and subclasses, which count as what they are derived from (an IntEnum as its number)."""
        if isinstance(value, str):
            self.put_content(0x73, value.encode("utf-8", "surrogatepass"))  # s
        elif isinstance(value, bytes):
            self.put_content(0x62, bytes(value))  # b
        elif isinstance(value, int):
            self.put_int(int(value))
        elif isinstance(value, float):
            self.put_float(value)
        elif isinstance(value, dict):
            self.put_dict(dict(value), depth)
        elif isinstance(value, (list, tuple)):
            self.put_items(value, depth)
        else:
            raise CanonicalError(f"{type(value).__name__} has no canonical form")

    def put_tag(self, tag: int) -> None:
        if self.used > _ROOM - 9:  # tag and eight bytes
            self.flush()
        self.room[self.used] = tag
        self.used += 1

    def put_number(self, tag: int, number: int, size: int) -> None:
        """Appends a tag and the `size` low bytes of a number, least significant first.

        Raises OverflowError for a number that has no 64 bits in two's complement.
        """
        if number < _LOWEST or number > _HIGHEST:
            raise OverflowError
        self.put_tag(tag)
        at = self.used
        self.used = at + size
        while at < self.used:
            self.room[at] = number & 255
            number >>= 8
            at += 1

    def put_int(self, value: int) -> None:
        try:
            self.put_number(0x69, value, 8)  # i
        except OverflowError:
            size = (value if value >= 0 else ~value).bit_length() // 8 + 1
            self.put_content(0x49, value.to_bytes(size, "little", signed=True))  # I

    def put_float(self, value: float) -> None:
        if value != value:
            raise NotANumberError("NaN has no canonical form")
        self.put_tag(0x64)  # d
        self.put_bytes(_FLOAT(value + 0.0))  # -0.0 + 0.0 is 0.0; no other float changes

    def put_text(self, value: str) -> None:
        """Appends text: letter by letter as if it were ASCII, and once more if it was not."""
        size = len(value)
        if size > _ROOM // 2:
            self.put_content(0x73, value.encode("utf-8", "surrogatepass"))  # s
        else:
            if self.used + size > _ROOM - 9:  # a flush must not come between `begin` and the end
                self.flush()
            begin = self.used
            self.put_number(0x73, size, 4)  # s
            at = self.used
            others = 0
            for letter in value:
                self.room[at] = ord(letter) & 127
                others |= ord(letter)
                at += 1
            self.used = at
            if others > 127:
                self.used = begin
                self.put_content(0x73, value.encode("utf-8", "surrogatepass"))

    def put_content(self, tag: int, content: bytes) -> None:
        """Appends a tag, the length and the content."""
        self.put_number(tag, len(content), 4)
        self.put_bytes(content)

    def put_bytes(self, content: bytes) -> None:
        if len(content) > _ROOM - self.used:
            self.flush()
            self.out += content
        else:
            at = self.used
            for byte in content:
                self.room[at] = byte
                at += 1
            self.used = at

    def put_items(self, value: Sequence[object], depth: int) -> None:
        if depth == _DEPTH:
            raise CanonicalError(f"nested deeper than {_DEPTH}")
        self.put_number(0x6C, len(value), 4)  # l
        index = 0
        try:
            for item in value:
                self.put(item, depth + 1)
                index += 1
        except CanonicalError as error:
            error.path = f"[{index}]{error.path}"
            raise

    def put_dict(self, value: dict[str, object], depth: int) -> None:
        if depth == _DEPTH:
            raise CanonicalError(f"nested deeper than {_DEPTH}")
        keys = list(value)
        for found in keys:
            if type(found) is not str:
                raise CanonicalError(f"key {found!r} is no str")
        keys.sort()
        self.put_number(0x6D, len(keys), 4)  # m
        key = ""
        try:
            for key in keys:
                self.put_text(key)
                self.put(value[key], depth + 1)
        except CanonicalError as error:
            error.path = f".{key}{error.path}"
            raise
