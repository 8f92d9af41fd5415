"""The state of a part and of all parts below it, as one flat block of bytes.

A class declares what is its state once, in a table of names:

    STATE = {
        "cycles": TICK,                               # a number with its limits
        "iram": "256B",                               # a fixed array, by its `struct` code
        "timers": Timers,                             # a part that has a table of its own (None: it is not there)
        "robots": [Robot],                            # a list or a dict of such parts
        "edges": Items("q", 4096),                    # a list of numbers, or a property that gives and takes one
        "ticks": Queue("q", 4096, "end"),             # the first items of an array
        "pending": Rows(64, "q", "B", "B"),           # a list of tuples
    }

Everything else comes from the tables: saving, restoring, hashing, the names of what differs, and the check that nothing
was forgotten (what is not state stands in `NOT_STATE`; tests/project/test_state_tables.py). What is saved but does not
enter a digest stands in `NOT_HASHED`. Tables of base classes come first. The order of fields is that of the tables,
depth first; bytes are those of `fields.py`.

Two methods of a part are called if it has them. `before_save` brings up to date what runs late; it changes nothing that
the part will do. `after_load` works out again what follows from the fields (caches, edges seen), and raises ValueError
where fields that are each in their range contradict each other.

`load` takes any bytes: it first checks all lengths and ranges and writes nothing, then writes and calls `after_load`.
Where a check fails, the state stays as it was, and a ValueError names the field. The very same bytes object, loaded
again, is not checked again: bytes do not change. Parts are looked up once, when a `Flat` is made: a part must not be
replaced afterwards.

In the compiled engine the build adds to each compiled module where the fields of its classes lie (`_places_NAME`), and
neighbouring fields are copied by `memory.pyx`. Both engines give the same bytes.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import groupby
from operator import attrgetter
from struct import Struct, calcsize
from typing import Any, NamedTuple, Protocol

from miro_exact import engine
from miro_exact.domain import DomainError
from miro_exact.fields import (
    FLAG,
    TICK,
    Items,
    Kind,
    Number,
    Octets,
    Queue,
    Row,
    Rows,
    out_of_range,
)

__all__ = [
    "FLAG",
    "TICK",
    "Flat",
    "Items",
    "Number",
    "Octets",
    "Queue",
    "Row",
    "Rows",
    "restore",
    "snapshot",
    "table",
    "values",
]

CODES = {
    "int": "i",
    "short": "h",
    "bint": "i",
    "long long": "q",
    "double": "d",
    "unsigned char": "B",
    "unsigned int": "I",
    "unsigned short": "H",
    "unsigned long long": "Q",
}
"""C types of fields and their codes."""


_PACKED_CODES = frozenset("qidB?Is()[]0123456789")
"""Letters in the forms of fields that `memory.pyx` packs without help."""


class StateField(NamedTuple):
    """A field of a part that exists; `path` names it from the root on."""

    part: Any
    name: str
    kind: Kind
    path: str


class Block(Protocol):
    """Neighbouring fields that are packed together."""

    def pack(self) -> bytes: ...
    def check(self, data: bytes, at: int) -> int: ...
    def put(self) -> None: ...


def table(cls: type) -> dict[str, Any]:
    """Name -> kind of every field of a class, base classes first, as declared."""
    found: dict[str, Any] = {}
    for base in reversed(cls.__mro__):
        found.update(base.__dict__.get("STATE", {}))
    return found


@cache
def kind_of(declared: Any) -> Kind:
    """What a table says of a field that is no part."""
    if isinstance(declared, str):
        return Number(declared)
    if isinstance(declared, tuple):
        return Number(*declared)
    kind: Kind = declared
    return kind


class One:
    """A field that is not compiled."""

    def __init__(self, field: StateField, before: Block | None) -> None:
        self.field = field
        self.part, self.name, self.kind, _ = field
        self.fields = [field]
        self.value: Any = None
        self.sibling: One | None = None
        if isinstance(before, One) and isinstance(before.field.kind, Queue) and isinstance(field.kind, Queue):
            if before.field.part is field.part and before.field.kind.end == field.kind.end:
                self.sibling = before

    def pack(self) -> bytes:
        try:
            return self.kind.encode(self.kind.read(self.part, self.name))
        except ValueError as error:
            raise DomainError(f"{self.field.path} {error}") from None

    def check(self, data: bytes, at: int) -> int:
        try:
            self.value, at = self.kind.decode(data, at)
        except ValueError as error:
            raise ValueError(f"{self.field.path} {error}") from None
        if self.sibling is not None and len(self.value) != len(self.sibling.value):
            raise ValueError(f"{self.field.path} has {len(self.value)} items, not {len(self.sibling.value)}")
        return at

    def put(self) -> None:
        self.kind.write(self.part, self.name, self.value)


class Some:
    """Numbers of one part that is not compiled: packed together, because that is quicker."""

    def __init__(self, fields: list[StateField]) -> None:
        self.fields = fields
        self.part = fields[0].part
        numbers = [field.kind for field in fields if isinstance(field.kind, Number)]
        self.layout = Struct("<" + "".join(number.code for number in numbers))
        self.get = attrgetter(*(field.name for field in fields))
        self.reals = [index for index, number in enumerate(numbers) if number.is_real]
        self.bounded = [(index, *number.bounds) for index, number in enumerate(numbers) if number.bounds]
        self.names = [field.name for field in fields]
        self.values: tuple[Any, ...] = ()

    def pack(self) -> bytes:
        values = self.get(self.part)
        for index in self.reals:
            if values[index] != values[index]:
                raise DomainError(f"{self.fields[index].path} is NaN")
        return self.layout.pack(*values)

    def check(self, data: bytes, at: int) -> int:
        end = at + self.layout.size
        if end > len(data):
            raise ValueError(f"{self.fields[0].path} ends {end - len(data)} bytes early")
        self.values = self.layout.unpack_from(data, at)
        for index, low, high in self.bounded:
            if not low <= self.values[index] <= high:
                what = out_of_range(self.values[index], low, high)
                raise ValueError(f"{self.fields[index].path} {what}")
        return end

    def put(self) -> None:
        for name, value in zip(self.names, self.values, strict=True):
            setattr(self.part, name, value)


class Flat:
    """The state of `root` and of all parts below it."""

    def __init__(self, root: Any) -> None:
        self.fields: list[StateField] = []
        self._before: list[Callable[[], object]] = []
        self._after: list[Callable[[], object]] = []
        self._blocks: list[Block] = []
        self._hashed: list[Block] = []  # those of them that enter a digest
        self._group: list[Any] = []  # of fields that will be one block
        self._counts = True  # whether they enter a digest
        self._tables = ""
        self._accepted: bytes | None = None  # the bytes that the blocks hold, once they were found good
        self._compiled = engine.active() == "compiled"
        self._walk(root, "")
        self._close()
        if not self.fields:
            raise TypeError(f"{type(root).__name__} declares no state")
        self._steps = [*(block.put for block in self._blocks), *self._after]
        self._packed = _together(self._blocks) if self._compiled else self._blocks
        self._hashed = _together(self._hashed) if self._compiled else self._hashed

    def save(self) -> bytes:
        """The state as it is. Raises DomainError with the field's name for NaN."""
        for settle in self._before:
            settle()
        return b"".join([block.pack() for block in self._packed])

    def hashed(self) -> bytes:
        """The part of the state that a digest is made of: all but what tables name in `NOT_HASHED`."""
        for settle in self._before:
            settle()
        return b"".join([block.pack() for block in self._hashed])

    def load(self, data: bytes) -> None:
        """Puts back what `save` gave. Raises ValueError, and changes nothing, for anything else."""
        if data is not self._accepted:
            self._first_load(data)
        else:
            self._put()

    def _first_load(self, data: bytes) -> None:
        before = self._before_load()
        self._accepted = None
        self._check(data)
        try:
            self._put()
        except Exception:
            if before is not None:
                self._check(before)
                self._put()
            raise
        self._accepted = data

    def _before_load(self) -> bytes | None:
        """What to go back to; None for a state that holds NaN, which can only be left."""
        try:
            return self.save()
        except DomainError:
            return None

    def decode(self, data: bytes) -> dict[str, Any]:
        """Path -> value of every field in the bytes of a state. Raises ValueError as `load` does."""
        values, at = {}, 0
        for field in self.fields:
            try:
                values[field.path], at = field.kind.decode(data, at)
            except ValueError as error:
                raise ValueError(f"{field.path} {error}") from None
        return values

    def tables(self) -> str:
        """SHA-256 in hex over names and forms of all fields. Bytes with the same layout fit this state."""
        if not self._tables:
            text = "\n".join(f"{field.path} {field.kind.form}" for field in self.fields)
            self._tables = hashlib.sha256(text.encode()).hexdigest()
        return self._tables

    def difference(self, one: bytes, other: bytes) -> tuple[str, Any, Any] | None:
        """Path and both values of the first field that differs between two states, None if none does."""
        first, second = self.decode(one), self.decode(other)
        return next(
            ((path, first[path], second[path]) for path in first if first[path] != second[path]), None
        )

    def _check(self, data: bytes) -> None:
        at = 0
        for block in self._blocks:
            at = block.check(data, at)
        if at != len(data):
            raise ValueError(f"the state has {len(data)} bytes, not {at}")

    def _put(self) -> None:
        for step in self._steps:
            step()

    # ---- making it: which fields there are, and which of them go together

    def _walk(self, part: Any, path: str, hashed: bool = True) -> None:
        if hasattr(part, "before_save"):
            self._before.append(part.before_save)
        for cls in reversed(type(part).__mro__):
            places = self._places(cls, part)
            apart = cls.__dict__.get("NOT_HASHED", ())
            for name, declared in cls.__dict__.get("STATE", {}).items():
                counts = hashed and name not in apart
                inner = f"{path}.{name}" if path else name
                if isinstance(declared, type):
                    if getattr(part, name) is not None:
                        self._walk(getattr(part, name), inner, counts)
                elif isinstance(declared, list):
                    for key, child in _numbered(getattr(part, name)):
                        self._walk(child, f"{inner}[{key}]", counts)
                else:
                    self._add(StateField(part, name, kind_of(declared), inner), places, counts)
        if hasattr(part, "after_load"):
            self._after.append(part.after_load)

    def _places(self, cls: type, part: Any) -> dict[str, tuple[int, str, int]]:
        """Name -> (address, C type, size in bytes) of the compiled fields that a class adds."""
        if not self._compiled:
            return {}
        places = getattr(sys.modules.get(cls.__module__), f"_places_{cls.__name__}", None)
        return {} if places is None else places(part)

    def _add(self, field: StateField, places: dict[str, tuple[int, str, int]], counts: bool) -> None:
        if counts != self._counts:
            self._close()
            self._counts = counts
        self.fields.append(field)
        if field.name in places and isinstance(field.kind, Number | Queue):
            if not self._group or isinstance(self._group[0], StateField):
                self._close()
            self._group.append(_memory_field(field, field.kind, places))
        elif isinstance(field.kind, Number) and not field.kind.count:
            last = self._group[len(self._group) - 1] if self._group else None
            if not isinstance(last, StateField) or last.part is not field.part:
                self._close()
            self._group.append(field)
        else:
            self._close()
            self._append(One(field, self._blocks[len(self._blocks) - 1] if self._blocks else None))

    def _close(self) -> None:
        group, self._group = self._group, []
        if not group:
            return
        if not isinstance(group[0], StateField):
            from miro_exact.memory import Memory

            self._append(Memory(group))
        elif len(group) > 1:
            self._append(Some(group))
        else:
            self._append(One(group[0], None))

    def _append(self, block: Block) -> None:
        self._blocks.append(block)
        if self._counts:
            self._hashed.append(block)


def _together(blocks: list[Block]) -> list[Block]:
    """The same blocks for packing alone: neighbours become one, but for those that only `fields` can pack."""
    from miro_exact.memory import Attributes

    found: list[Block] = []
    for simple, group in groupby(blocks, _is_simple):
        together: list[Any] = list(group)
        if simple:
            parts = [part for block in together for part in _attributes(block)]
            packed = Attributes(parts, partial(_pack_each, together))
            together = [packed]
        found += together
    return found


def _is_simple(block: Block) -> bool:
    """Whether `Attributes` can pack it."""
    if not isinstance(block, One | Some):
        return True
    return all(
        not isinstance(field.kind, Queue) and set(field.kind.form) <= _PACKED_CODES for field in block.fields
    )


def _attributes(block: Any) -> list[tuple[Any, ...]]:
    """What `memory.pyx` has to know of the fields of a block."""
    from miro_exact import memory

    if isinstance(block, memory.Memory):
        return [(block, "", memory.MEMORY, "", 0, None)]
    return [_attribute(field) for field in block.fields]


def _attribute(field: StateField) -> tuple[Any, ...]:
    """What `memory.pyx` has to know of a field that is a Python object."""
    from miro_exact import memory

    part, name, kind, _ = field
    if isinstance(kind, Number):
        return (part, name, memory.NUMBER, kind.code, kind.count, None)
    if isinstance(kind, Items):
        return (part, name, memory.ITEMS, kind.code, kind.room, None)
    if isinstance(kind, Octets):
        return (part, name, memory.OCTETS, "s", 0, None)
    row: Row = kind.row if isinstance(kind, Rows) else kind  # type: ignore[assignment]
    if isinstance(kind, Rows):
        return (part, name, memory.ROWS, row.form, kind.room, row.split)
    return (part, name, memory.ROW, row.form, 0, row.split)


def _pack_each(blocks: Sequence[Block]) -> bytes:
    return b"".join([block.pack() for block in blocks])


def _numbered(parts: Any) -> Iterator[tuple[Any, Any]]:
    yield from parts.items() if isinstance(parts, dict) else enumerate(parts)


def _memory_field(
    field: StateField, kind: Number | Queue, places: dict[str, tuple[int, str, int]]
) -> tuple[Any, ...]:
    """What `memory.pyx` has to know. Raises TypeError if table and C layout do not agree."""
    address, c_type, size = places[field.name]
    count = kind.room if isinstance(kind, Queue) else max(kind.count, 1)
    if CODES.get(c_type) != kind.code or size % count or (kind.bounds and kind.code not in "iqBd"):
        raise TypeError(f"{field.path}: {c_type} of {size} bytes is declared as {count} {kind.code}")
    if size // count != calcsize(f"<{kind.code}"):
        raise TypeError(f"{field.path}: {size} bytes are declared as {count} {kind.code}")
    low, high = kind.bounds or (None, None)
    end = (places[kind.end][0], places[kind.end][2]) if isinstance(kind, Queue) else None
    return (field.part, field.path, address, size // count, count, kind.code, low, high, end)


def snapshot(part: Any) -> bytes:
    """The state of a part and of all below it. To take it often, keep a `Flat`."""
    return Flat(part).save()


def restore(part: Any, data: bytes) -> None:
    """Puts back what `snapshot` gave of a part built alike. Raises ValueError and changes nothing for anything else."""
    Flat(part).load(data)


def values(part: Any) -> dict[str, Any]:
    """Path -> value of every field of a part and of all below it."""
    flat = Flat(part)
    return flat.decode(flat.save())
