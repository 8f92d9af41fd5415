"""The types of C variables as SDCC's debug file writes them, and what the bytes of a variable mean.

A type record is `{SIZE}CHAIN:SIGN`, the chain from the variable inwards: `DA4d` an array of 4, `DG` `DC` `DX` `DD`
`DI` `DP` pointers, `DF` a function, `SC` `SS` `SI` `SL` whole numbers, `SF` a float, `SX` a bit, `SB3$5` 5 bits from
bit 3 on, `STname` a struct or union, nothing at all a `_Bool` (SDCC CDB file format). SIZE is that of the whole in
bytes and tells `long long` from `int`, which share a letter.

Values are what Python has for them: int (pointers too), float, bool, a list for an array, a dict for a struct. SDCC is
little-endian; its generic pointer is an address of two bytes and a byte that names the memory.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from typing import Any, Literal

import msgspec

Kind = Literal["int", "float", "bool", "bit", "bits", "array", "struct", "pointer", "function", "void"]


class CType(msgspec.Struct, frozen=True):
    """A type. `size` in bytes; of `bits`, those that hold them. `element`, `count`: of an array; `tag`: of a struct.

    Of a pointer, `element` is what it points to (None where that is not known) and `tag` the record's letters.
    """

    kind: Kind
    size: int
    signed: bool = False
    element: CType | None = None
    count: int = 0
    first_bit: int = 0
    bits: int = 0
    tag: str = ""

    def __str__(self) -> str:
        if self.kind == "array":
            return f"{self.element}[{self.count}]"
        if self.kind == "int":
            return f"{'' if self.signed else 'u'}int{8 * self.size}"
        return f"struct {self.tag}" if self.kind == "struct" else self.kind


class Member(msgspec.Struct, frozen=True):
    """A member of a struct or union, with its offset in bytes."""

    name: str
    offset: int
    type: CType


Fields = Mapping[str, tuple[Member, ...]]
"""The members of structs, by tag."""

MOST_BYTES = 0x10000
"""Largest size of a variable: a memory of the 8051."""
_MOST_DEEP = 8
_FLOAT_BYTES = 4
_ARRAY = re.compile(r"DA([0-9]{1,6})d")
_BITS = re.compile(r"SB([0-9]{1,2})\$([0-9]{1,2})")
_NAMED = re.compile(r"(u?)int(8|16|32|64)(?:\[([0-9]{1,5})\])?")
_POINTERS = ("DG", "DC", "DX", "DD", "DI", "DP", "DA")
_PLAIN: dict[str, Kind] = {"": "bool", "SF": "float", "SX": "bit", "SV": "void", "DF": "function"}
_NUMBERS = ("SC", "SS", "SI", "SL")
_POINTED_BYTES = {
    "SC": 1, "SS": 2, "SI": 2, "SL": 4, "SF": 4, "DG": 3, "DC": 2, "DX": 2, "DD": 1, "DI": 1, "DP": 1,
}  # fmt: skip


def type_of(chain: str, size: int, signed: bool) -> CType | None:
    """The type of a record's three parts, None for one that is damaged or unknown."""
    return _type_of(chain, size, signed) if size <= MOST_BYTES and chain.count(",") <= _MOST_DEEP else None


def _type_of(chain: str, size: int, signed: bool) -> CType | None:
    head, _, inner = chain.partition(",")
    if array := _ARRAY.fullmatch(head):
        count = int(array[1])
        element = _type_of(inner, size // count, signed) if count and size >= count else None
        return None if element is None else CType("array", size, element=element, count=count)
    if bits := _BITS.fullmatch(head):
        first_bit, width = int(bits[1]), int(bits[2])
        fits = 0 < width <= 8 * size - first_bit
        return CType("bits", size, signed, first_bit=first_bit, bits=width) if fits else None
    if head.startswith("ST"):
        return CType("struct", size, tag=head[2:])
    if head in _PLAIN:
        return CType(_PLAIN[head], size) if size == _FLOAT_BYTES or head != "SF" else None
    if not size:
        return None
    if head in _POINTERS:
        points = _type_of(inner, _POINTED_BYTES.get(inner.partition(",")[0], 0), signed)
        return CType("pointer", size, element=points, tag=head)
    return CType("int", size, signed) if head in _NUMBERS else None


def values_in(kind: CType, fields: Fields, inside: tuple[str, ...] = ()) -> int:
    """Number of values in a type. 0 for an impossible type: a member that lies outside its struct, a struct within
    itself, more than `MOST_BYTES` in all (of a union, members count that lie over each other).
    """
    if kind.kind == "array" and kind.element is not None:
        count = kind.count * values_in(kind.element, fields, inside)
    elif kind.kind == "struct":
        if kind.tag in inside or len(inside) >= _MOST_DEEP:
            return 0
        count = 0
        for field in fields.get(kind.tag, ()):
            more = values_in(field.type, fields, (*inside, kind.tag))
            if not more or field.offset + field.type.size > kind.size or count > MOST_BYTES:
                return 0
            count += more
        count = max(1, count)  # one that the file does not describe is empty
    else:
        count = 1
    return count if count <= MOST_BYTES else 0


def type_named(name: str) -> CType | None:
    """The type that people call `int16`, `uint8[4]`, `float` or `bit`; None for another word."""
    if name == "float":
        return CType("float", 4)
    if name == "bit":
        return CType("bit", 1)
    match = _NAMED.fullmatch(name)
    if match is None:
        return None
    number = CType("int", int(match[2]) // 8, signed=not match[1])
    if match[3] is None:
        return number
    return CType("array", number.size * int(match[3]), element=number, count=int(match[3]))


def value_of(kind: CType, data: bytes, fields: Fields) -> Any:
    """The value of `data`, the bytes of a variable of this type."""
    if kind.kind == "array" and kind.element is not None:
        size = kind.element.size
        parts = [data[at * size : (at + 1) * size] for at in range(kind.count)]
        return [value_of(kind.element, part, fields) for part in parts]
    if kind.kind == "struct":
        return {
            field.name: value_of(field.type, data[field.offset : field.offset + field.type.size], fields)
            for field in fields.get(kind.tag, ())
        }
    if kind.kind == "float":
        return struct.unpack("<f", data)[0]
    number = int.from_bytes(data, "little", signed=kind.signed and kind.kind == "int")
    if kind.kind == "bits":
        number = number >> kind.first_bit & (1 << kind.bits) - 1
        return number - (1 << kind.bits) if kind.signed and number >> (kind.bits - 1) else number
    return bool(number) if kind.kind == "bool" else number


def bytes_of(kind: CType, value: Any, before: bytes, fields: Fields) -> bytes:
    """The bytes that mean `value`; `before` are those that stand there now, of which what is not named stays.

    Raises ValueError for a value that the type cannot hold.
    """
    if kind.kind == "array" and kind.element is not None:
        return _array_bytes(kind, kind.element, value, before, fields)
    if kind.kind == "struct":
        return _struct_bytes(kind, value, before, fields)
    if kind.kind == "float" and isinstance(value, int | float):
        data: bytes = struct.pack("<f", value)
        return data
    if not isinstance(value, int):
        raise ValueError(f"{value!r} is no {kind}")
    width = {"bits": kind.bits, "bool": 1, "bit": 1}.get(kind.kind, 8 * kind.size)
    low = -(1 << width - 1) if kind.signed else 0
    if not low <= value < low + (1 << width):
        raise ValueError(f"{value} does not fit {kind}: it takes {low} to {low + (1 << width) - 1}")
    if kind.kind == "bits":
        mask = (1 << kind.bits) - 1 << kind.first_bit
        value = int.from_bytes(before, "little") & ~mask | value << kind.first_bit & mask
    number = int(value) & (1 << 8 * kind.size) - 1
    return number.to_bytes(kind.size, "little")


def _array_bytes(kind: CType, element: CType, value: Any, before: bytes, fields: Fields) -> bytes:
    if not isinstance(value, list | tuple | bytes) or len(value) != kind.count:
        raise ValueError(f"{value!r} is no {kind}: give {kind.count} values")
    size = element.size
    parts = [before[at * size : (at + 1) * size] for at in range(kind.count)]
    pairs = zip(value, parts, strict=True)
    return b"".join(bytes_of(element, each, part, fields) for each, part in pairs)


def _struct_bytes(kind: CType, value: Any, before: bytes, fields: Fields) -> bytes:
    members = {field.name: field for field in fields.get(kind.tag, ())}
    if not isinstance(value, Mapping) or not value.keys() <= members.keys():
        raise ValueError(f"{value!r} is no {kind}: its members are {', '.join(members)}")
    data = bytearray(before)
    for name, each in value.items():
        field = members[name]
        place = slice(field.offset, field.offset + field.type.size)
        data[place] = bytes_of(field.type, each, bytes(data[place]), fields)
    return bytes(data)
