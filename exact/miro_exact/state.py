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

Saving, restoring, hashing, names of differing fields, and the check for missing fields all use the tables. Fields that
are no state are listed in `NOT_STATE` (tests/project/test_state_tables.py). Fields that are saved but do not enter a
digest are listed in `NOT_HASHED`. Tables of base classes come first. The order of fields is that of the tables, depth
first; bytes are those of `fields.py`.

Two methods of a part are called if it has them. `before_save` updates values that are computed lazily; it does not
change the part's behaviour. `after_load` recomputes derived values (caches, edges seen), and raises ValueError if
fields contradict each other although each is in its range.

`load` takes any bytes: it first checks all lengths and ranges and writes nothing, then writes and calls `after_load`.
If a check fails, the state stays unchanged, and a ValueError names the field. The same bytes object is not checked
again when it is loaded again, because bytes are immutable.

Parts are looked up once, when a `Flat` is made: a part must not be replaced afterwards. Each class is examined once per
process. For the compiled engine the build adds the addresses of fields to each module (`_places_NAME`), and
neighbouring fields are copied by `memory.pyx`. Both engines give the same bytes.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache, cached_property, partial
from itertools import groupby
from operator import itemgetter
from struct import calcsize
from typing import Any, NamedTuple

from miro_exact import engine
from miro_exact.domain import DomainError
from miro_exact.fields import BLOCK, FLAG, MEMORY, TICK, Items, Kind, Number, Octets, Queue, Row, Rows

__all__ = ["FLAG", "TICK", "Flat", "Items", "Octets", "Queue", "Row", "Rows"]

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


def table(cls: type) -> dict[str, Any]:
    """Name -> kind of every field of a class, base classes first, as declared."""
    kinds: dict[str, Any] = {}
    for base in reversed(cls.__mro__):
        kinds.update(base.__dict__.get("STATE", {}))
    return kinds


@cache
def kind_of(declared: Any) -> Kind:
    """The kind of a field in a table; not for parts."""
    if isinstance(declared, str):
        return Number(declared)
    if isinstance(declared, tuple):
        return Number(*declared)
    kind: Kind = declared
    return kind


class Group(NamedTuple):
    """Neighbours in the table of a class, which are packed together in each of its parts.

    `counts`: whether they enter a digest. `layout`: where they lie in a part, if they are compiled.
    """

    fields: list[tuple[str, Kind]]
    counts: bool
    layout: Any = None


class Below(NamedTuple):
    """A field that is a part with a table of its own, or `many` of them."""

    name: str
    many: bool
    counts: bool


class Piece(NamedTuple):
    """A group of fields in one part. `prefix`: put before their names; `counts`: as of a group."""

    part: Any
    prefix: str
    group: Group
    counts: bool

    def fields(self) -> list[StateField]:
        return [StateField(self.part, name, kind, self.prefix + name) for name, kind in self.group.fields]


class One:
    """A field that is not compiled."""

    def __init__(self, field: StateField, before: Any) -> None:
        self.field = field
        self.part, self.name, self.kind, _ = field
        self.value: Any = None
        self.sibling: One | None = None
        if isinstance(before, One) and isinstance(before.field.kind, Queue) and isinstance(field.kind, Queue):
            # Two arrays share one `end`: of two lengths in bytes the second would cut or stretch the first.
            if before.field.part is field.part and before.field.kind.end == field.kind.end:
                self.sibling = before

    def pack(self) -> bytes:
        try:
            return self.kind.encode(self.kind.read(self.part, self.name))
        except ValueError as error:
            raise DomainError(f"{self.field.path} {error}") from None

    def check(self, data: bytes, offset: int) -> int:
        try:
            self.value, offset = self.kind.decode(data, offset)
        except ValueError as error:
            raise ValueError(f"{self.field.path} {error}") from None
        if self.sibling is not None and len(self.value) != len(self.sibling.value):
            raise ValueError(f"{self.field.path} has {len(self.value)} items, not {len(self.sibling.value)}")
        return offset

    def put(self) -> None:
        self.kind.write(self.part, self.name, self.value)


class Flat:
    """The state of `root` and of all parts below it."""

    def __init__(self, root: Any) -> None:
        self._before: list[Callable[[], object]] = []
        self._after: list[Callable[[], object]] = []
        self._pieces: list[Piece] = []
        self._tables = ""
        self._accepted: bytes | None = None  # the bytes that the blocks hold, once they were found good
        self._walk(root, "", True)
        if not self._pieces:
            raise TypeError(f"{type(root).__name__} declares no state")
        blocks = _blocks(self._pieces)
        self._blocks = [block for block, _ in blocks]
        # All fields before any `after_load`: it may look at any part.
        self._steps = [*(block.put for block in self._blocks), *self._after]
        self._packed = _together(self._blocks)
        self._hashed = _together([block for block, counts in blocks if counts])

    @cached_property
    def fields(self) -> list[StateField]:
        """All fields, in their order."""
        return [field for piece in self._pieces for field in piece.fields()]

    def save(self) -> bytes:
        """The present state. Raises DomainError with the field's name for NaN."""
        # All before the first byte is packed: settling one part may move fields of another.
        for settle in self._before:
            settle()
        return b"".join([block.pack() for block in self._packed])

    def hashed(self) -> bytes:
        """The bytes for a digest: the state without the fields listed in `NOT_HASHED`."""
        for settle in self._before:
            settle()
        return b"".join([block.pack() for block in self._hashed])

    def load(self, data: bytes) -> None:
        """Restores a state from `save`. Raises ValueError for any other bytes, and changes nothing then."""
        if data is not self._accepted:
            self._first_load(data)
        else:
            self._put()

    def _first_load(self, data: bytes) -> None:
        try:
            before = self.save()
        except DomainError:  # it holds NaN, and can only be left
            before = b""
        # From here on the blocks may hold other bytes; they are good only at the end.
        self._accepted = None
        self._check(data)
        try:
            self._put()
        except Exception:
            # `after_load` refuses what has been written already: what was there is put back.
            if before:
                self._check(before)
                self._put()
            raise
        self._accepted = data

    def decode(self, data: bytes) -> dict[str, Any]:
        """Path -> value of every field in the bytes of a state. Raises ValueError as `load` does."""
        values, offset = {}, 0
        for field in self.fields:
            try:
                values[field.path], offset = field.kind.decode(data, offset)
            except ValueError as error:
                raise ValueError(f"{field.path} {error}") from None
        return values

    def tables(self) -> str:
        """SHA-256 in hex over names and forms of all fields. Bytes with the same layout fit this state."""
        if not self._tables:
            text = "\n".join(f"{field.path} {field.kind.form}" for field in self.fields)
            self._tables = hashlib.sha256(text.encode()).hexdigest()
        return self._tables

    def _check(self, data: bytes) -> None:
        offset = 0
        for block in self._blocks:
            offset = block.check(data, offset)
        # Checked after the last block: what is too long would be read as far as it goes.
        if offset != len(data):
            raise ValueError(f"the state has {len(data)} bytes, not {offset}")

    def _put(self) -> None:
        for step in self._steps:
            step()

    def _walk(self, part: Any, prefix: str, counts: bool) -> None:
        if hasattr(part, "before_save"):
            # Before those of its parts: a CPU settles its peripherals.
            self._before.append(part.before_save)
        for entry in _entries(part):
            if isinstance(entry, Group):
                self._pieces.append(Piece(part, prefix, entry, counts and entry.counts))
            elif entry.many:
                parts = getattr(part, entry.name)
                for key, child in parts.items() if isinstance(parts, dict) else enumerate(parts):
                    self._walk(child, f"{prefix}{entry.name}[{key}].", counts and entry.counts)
            elif (child := getattr(part, entry.name)) is not None:
                self._walk(child, f"{prefix}{entry.name}.", counts and entry.counts)
        if hasattr(part, "after_load"):
            # After those of its parts: what it caches may come from what they cache.
            self._after.append(part.after_load)


# ---- what a class has

_ENTRIES: dict[type, list[Group | Below]] = {}
"""Class -> its groups and parts, in the order of its tables: worked out at its first part."""


def _entries(part: Any) -> list[Group | Below]:
    cls = type(part)
    if cls not in _ENTRIES:
        _ENTRIES[cls] = [entry for base in reversed(cls.__mro__) for entry in _own_entries(base, part)]
    return _ENTRIES[cls]


def _own_entries(cls: type, part: Any) -> Iterator[Group | Below]:
    """Of the table of one class."""
    places, declared = _places(cls, part), cls.__dict__.get("STATE", {})
    apart = cls.__dict__.get("NOT_HASHED", ())
    sorts = [(_sort(name, kind, places), name not in apart, name) for name, kind in declared.items()]
    # Neighbours only: the order of the bytes is that of the tables, whatever is compiled.
    for (sort, counts), group in groupby(sorts, itemgetter(0, 1)):
        names = [name for _, _, name in group]
        if sort == "below":
            yield from [Below(name, isinstance(declared[name], list), counts) for name in names]
            continue
        fields = [(name, kind_of(declared[name])) for name in names]
        if sort == "compiled":
            yield Group(fields, counts, _layout(part, fields, places))
        else:
            yield from [Group([field], counts) for field in fields]


def _sort(name: str, declared: Any, places: dict[str, Any]) -> str:
    """The packer of a field."""
    if isinstance(declared, type | list):
        return "below"
    return "compiled" if name in places and isinstance(kind_of(declared), (Number, Queue)) else "alone"


def _places(cls: type, part: Any) -> dict[str, tuple[int, str, int]]:
    """Name -> (address, C type, size in bytes) of the compiled fields of a part that a class adds."""
    if engine.active() != "compiled":
        return {}
    places = getattr(sys.modules.get(cls.__module__), f"_places_{cls.__name__}", None)
    return {} if places is None else places(part)


def _layout(part: Any, fields: list[tuple[str, Kind]], places: dict[str, tuple[int, str, int]]) -> Any:
    """The layout of a group for `memory.pyx`. Raises TypeError if table and C layout do not agree."""
    from miro_exact.memory import Layout

    rows: list[tuple[object, ...]] = []
    for name, kind in fields:
        assert isinstance(kind, (Number, Queue))
        address, c_type, size = places[name]
        count = kind.room if isinstance(kind, Queue) else max(kind.count, 1)
        # Fields are copied by address: a width that is wrong would take a neighbour's bytes along.
        fits = CODES.get(c_type) == kind.code and size == count * calcsize(f"<{kind.code}")
        if not fits or (kind.bounds and kind.code not in "iqBd"):
            problem = f"{c_type} of {size} bytes is declared as {count} {kind.code}"
            raise TypeError(f"{type(part).__name__}.{name}: {problem}")
        low, high = kind.bounds or (None, None)
        end = (places[kind.end][0], places[kind.end][2]) if isinstance(kind, Queue) else None
        rows.append((name, address, size // count, count, kind.code, low, high, end))
    return Layout(part, rows)


# ---- blocks


def _blocks(pieces: list[Piece]) -> list[tuple[Any, bool]]:
    """The blocks of a state, in order, and whether they enter a digest.

    A block is a `One` or a `memory.Memory`: neighbouring fields with `pack`, `check` and `put`.
    """
    blocks: list[tuple[Any, bool]] = []
    for (is_compiled, counts), group in groupby(
        pieces, lambda item: (item.group.layout is not None, item.counts)
    ):
        if is_compiled:
            from miro_exact.memory import Memory

            blocks.append(
                (Memory([(piece.part, piece.prefix, piece.group.layout) for piece in group]), counts)
            )
            continue
        for (field,) in map(Piece.fields, group):
            # Not found[-1]: compiled code does not index from the end.
            blocks.append((One(field, blocks[len(blocks) - 1][0] if blocks else None), counts))
    return blocks


def _together(blocks: list[Any]) -> list[Any]:
    """Blocks for packing alone: these, or one in which compiled code packs them all."""
    if engine.active() != "compiled":
        return blocks
    from miro_exact.memory import Attributes

    return [Attributes(list(map(_attributes, blocks)), partial(_pack_each, blocks))]


def _attributes(block: Any) -> tuple[Any, ...]:
    """The layout of a block for `memory.Attributes`."""
    if not isinstance(block, One):
        return block, "", MEMORY, b"", 0, None
    packed = block.kind.packed
    if packed is None or not set(block.kind.form) <= _PACKED_CODES:
        return block, "", BLOCK, b"", 0, None
    shape, codes, count, split = packed
    return block.part, block.name, shape, codes.encode(), count, split


def _pack_each(blocks: Sequence[Any]) -> bytes:
    return b"".join([block.pack() for block in blocks])
