"""The kinds of fields in tables of state, and their flat bytes.

All bytes are little-endian, without padding, as Python's `struct` writes them with `<`. Bytes are checked when read: a
value out of its range, a length beyond the capacity, NaN and an early end raise ValueError.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

from miro_exact.clock import NEVER_TICK

Bounds = tuple[Any, Any]
Column = str | tuple[str, int] | tuple[str, Any, Any]
"""A `struct` code, with the least and the greatest value if not all will do; "s" is bytes, ("s", room) many."""

TICK = ("q", 0, NEVER_TICK)
"""A tick, a cycle, or a count of events."""
FLAG = ("i", 0, 1)
"""An int of a compiled part that is 0 or 1."""
INFINITY = float("inf")
_COUNT = struct.Struct("<I")
_NONE = b"\0\0\0\0"
_ROOM = 1 << 16


NUMBER, ITEMS, OCTETS, ROW, ROWS, MEMORY, BLOCK = range(7)
"""How `memory.Attributes` packs a field; the last two are for a `Memory`, and for fields that pack themselves."""


class Kind:
    """The interface of all kinds of fields. `form`: a code of a few letters for the layout of its bytes.

    `packed`: shape, codes, number of items and `split` for `memory.Attributes`, None if that cannot pack it.
    """

    form = ""
    bounds: Bounds | None = None
    packed: tuple[int, str, int, Callable[[Any], tuple[Any, ...]] | None] | None = None

    def read(self, part: Any, name: str) -> Any:
        return getattr(part, name)

    def write(self, part: Any, name: str, value: Any) -> None:
        setattr(part, name, value)

    def encode(self, value: Any) -> bytes:
        raise NotImplementedError

    def decode(self, data: bytes, offset: int) -> tuple[Any, int]:
        raise NotImplementedError


def _take(layout: struct.Struct, data: bytes, offset: int) -> tuple[Any, ...]:
    if offset + layout.size > len(data):
        raise ValueError(f"ends {offset + layout.size - len(data)} bytes early")
    return layout.unpack_from(data, offset)


def out_of_range(value: Any, low: Any, high: Any) -> str:
    """The message about a value that is not from `low` to `high`."""
    # NaN alone is not equal to itself.
    return "is NaN" if value != value else f"is {value}, not from {low} to {high}"


def _checked(values: Iterable[Any], bounds: Bounds) -> None:
    low, high = bounds
    for value in values:
        # Written so that NaN, for which each comparison is false, is refused too.
        if not low <= value <= high:
            raise ValueError(out_of_range(value, low, high))


def _bounds(code: str, low: Any, high: Any) -> Bounds | None:
    """None where every value of the type will do; of a real number NaN never will."""
    if low is None:
        # Infinities pass, NaN does not: a digest of NaN would hide what made it.
        return (-INFINITY, INFINITY) if code == "d" else None
    return (low, high)


class Number(Kind):
    """A number, or a fixed array of them: a `struct` code such as "q", "d" or "256B"; limits include both ends."""

    def __init__(self, form: str, low: Any = None, high: Any = None) -> None:
        self.form = form
        # Not form[-1]: compiled code does not index from the end.
        self.code = form[len(form) - 1]
        self.count = int(form[: len(form) - 1]) if form[: len(form) - 1] else 0  # 0: no array
        self.bounds = _bounds(self.code, low, high)
        # "<": standard sizes without padding, the same bytes on every machine.
        self.layout = struct.Struct(f"<{form}")
        self.is_real = self.code == "d"
        self.packed = NUMBER, self.code, self.count, None

    def write(self, part: Any, name: str, value: Any) -> None:
        if self.count:
            # Item by item: others hold the array, and an array of C cannot be replaced.
            array = getattr(part, name)
            for index in range(self.count):
                array[index] = value[index]
        else:
            setattr(part, name, value)

    def encode(self, value: Any) -> bytes:
        values = value[: self.count] if self.count else (value,)
        if self.is_real:
            _checked(values, (-INFINITY, INFINITY))
        return self.layout.pack(*values)

    def decode(self, data: bytes, offset: int) -> tuple[Any, int]:
        values = _take(self.layout, data, offset)
        if self.bounds is not None:
            _checked(values, self.bounds)
        return values if self.count else values[0], offset + self.layout.size


class Items(Kind):
    """A list or a tuple of at most `room` numbers: their number (4 bytes), then they.

    With `ordered` each is greater than the one before. The part takes the values by assignment: it may
    keep them in another form, behind a property.
    """

    def __init__(
        self, code: str, room: int, low: Any = None, high: Any = None, ordered: bool = False
    ) -> None:
        self.form = f"{code}[]"
        self.packed = ITEMS, code, room, None
        self.code = code
        self.room = room
        self.bounds = _bounds(code, low, high)
        self.ordered = ordered
        self.made: type[Any] | None = None  # list or tuple, as the part has it

    def write(self, part: Any, name: str, value: Sequence[Any]) -> None:
        if self.made is None:  # read once: a property may have to make a list for the answer
            self.made = type(getattr(part, name))
        setattr(part, name, self.made(value))

    def encode(self, value: Sequence[Any]) -> bytes:
        if not value:
            return _NONE
        if len(value) > self.room:
            raise ValueError(f"has {len(value)} items, not at most {self.room}")
        if self.code == "d":
            _checked(value, (-INFINITY, INFINITY))
        return struct.pack(f"<I{len(value)}{self.code}", len(value), *value)

    def decode(self, data: bytes, offset: int) -> tuple[list[Any], int]:
        (count,) = _take(_COUNT, data, offset)
        # Before `count` is believed: four damaged bytes must not ask for gigabytes.
        if count > self.room:
            raise ValueError(f"has {count} items, not at most {self.room}")
        if not count:
            return [], offset + 4
        layout = struct.Struct(f"<{count}{self.code}")
        values = _take(layout, data, offset + 4)
        if self.bounds is not None:
            _checked(values, self.bounds)
        if self.ordered and any(later <= earlier for earlier, later in pairwise(values)):
            raise ValueError("is not in order")
        return list(values), offset + 4 + layout.size


class Queue(Items):
    """The used items of an array with capacity `room`; the field `end` contains their number.

    Bytes as of `Items`. Queues with the same `end` have one length.
    """

    def __init__(self, code: str, room: int, end: str, low: Any = None, high: Any = None) -> None:
        super().__init__(code, room, low, high)
        self.packed = None
        self.end = end

    def read(self, part: Any, name: str) -> list[Any]:
        array = getattr(part, name)
        return [array[index] for index in range(getattr(part, self.end))]

    def write(self, part: Any, name: str, value: Sequence[Any]) -> None:
        array = getattr(part, name)
        for index, item in enumerate(value):
            array[index] = item
        setattr(part, self.end, len(value))


class Octets(Kind):
    """Bytes of any length up to `room`: the length (4 bytes), then they. A bytearray stays the same object."""

    form = "s"
    packed = OCTETS, "s", 0, None

    def __init__(self, room: int) -> None:
        self.room = room

    def read(self, part: Any, name: str) -> bytes:
        return bytes(getattr(part, name))

    def write(self, part: Any, name: str, value: bytes) -> None:
        if isinstance(present := getattr(part, name), bytearray):
            # In place, because others hold it.
            present[:] = value
        else:
            setattr(part, name, value)

    def encode(self, value: bytes) -> bytes:
        return _COUNT.pack(len(value)) + value

    def decode(self, data: bytes, offset: int) -> tuple[bytes, int]:
        (length,) = _take(_COUNT, data, offset)
        # The room first: a length that is too large is named as that, not as an early end.
        if length > self.room:
            raise ValueError(f"has {length} bytes, not at most {self.room}")
        if offset + 4 + length > len(data):
            raise ValueError(f"ends {offset + 4 + length - len(data)} bytes early")
        return data[offset + 4 : offset + 4 + length], offset + 4 + length


class Row(Kind):
    """A tuple of a value a column; with `split` and `make` anything that can be taken apart into one and made of it."""

    def __init__(
        self,
        *columns: Column,
        split: Callable[[Any], tuple[Any, ...]] | None = None,
        make: Callable[[tuple[Any, ...]], Any] | None = None,
    ) -> None:
        kinds = [column if isinstance(column, tuple) else (column,) for column in columns]
        self.form = "".join(kind[0] for kind in kinds)
        self.columns: list[Kind] = [
            Octets(*(kind[1:] or (_ROOM,))) if kind[0] == "s" else Number(*kind) for kind in kinds
        ]
        self.packed = ROW, self.form, 0, split
        self.split = split
        self.make = make
        self.layout: struct.Struct | None = None
        if "s" not in self.form:
            self.layout = struct.Struct(f"<{self.form}")
        self.reals = [index for index, kind in enumerate(kinds) if kind[0] == "d"]
        self.bounded = [
            (index, *bounded.bounds) for index, bounded in enumerate(self.columns) if bounded.bounds
        ]

    def encode(self, value: Any) -> bytes:
        cells = value if self.split is None else self.split(value)
        for index in self.reals:
            # NaN: it alone is not equal to itself.
            if cells[index] != cells[index]:
                raise ValueError("holds NaN")
        if self.layout is not None:
            return self.layout.pack(*cells)
        return b"".join([column.encode(cell) for column, cell in zip(self.columns, cells, strict=True)])

    def decode(self, data: bytes, offset: int) -> tuple[Any, int]:
        if self.layout is not None:
            cells = _take(self.layout, data, offset)
            for index, low, high in self.bounded:
                if not low <= cells[index] <= high:
                    raise ValueError(out_of_range(cells[index], low, high))
            return cells if self.make is None else self.make(cells), offset + self.layout.size
        row = []
        for column in self.columns:
            cell, offset = column.decode(data, offset)
            row.append(cell)
        return tuple(row) if self.make is None else self.make(tuple(row)), offset

    def first(self, value: Any) -> Any:
        """The first column of a row."""
        return (value if self.split is None else self.split(value))[0]


class Rows(Kind):
    """At most `room` rows: their number (4 bytes), then they. A list or deque stays the same object; or it is a tuple.

    With `ordered` the first column never falls from one row to the next.
    """

    def __init__(self, room: int, *columns: Column, ordered: bool = False, **parts: Any) -> None:
        self.room = room
        self.row = Row(*columns, **parts)
        self.form = f"({self.row.form})[]"
        self.packed = ROWS, self.row.form, room, self.row.split
        self.ordered = ordered

    def read(self, part: Any, name: str) -> list[Any]:
        return list(getattr(part, name))

    def write(self, part: Any, name: str, value: list[Any]) -> None:
        rows = getattr(part, name)
        # A tuple cannot change; a list or deque stays the object that others hold.
        if isinstance(rows, tuple):
            setattr(part, name, tuple(value))
        else:
            rows.clear()
            rows.extend(value)

    def encode(self, value: Sequence[Any]) -> bytes:
        if not value:
            return _NONE
        if len(value) > self.room:
            raise ValueError(f"has {len(value)} rows, not at most {self.room}")
        return _COUNT.pack(len(value)) + b"".join([self.row.encode(row) for row in value])

    def decode(self, data: bytes, offset: int) -> tuple[list[Any], int]:
        (count,) = _take(_COUNT, data, offset)
        if count > self.room:
            raise ValueError(f"has {count} rows, not at most {self.room}")
        rows = []
        offset += 4
        for _ in range(count):
            row, offset = self.row.decode(data, offset)
            rows.append(row)
        if self.ordered and any(self.row.first(b) < self.row.first(a) for a, b in pairwise(rows)):
            raise ValueError("is not in order")
        return rows, offset
