"""Fields that differ between two states, with the path in the state tables and the firmware's name."""

from __future__ import annotations

import bisect
import re
import struct
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from miro_robot.image import Image
from miro_robot.image.symbol_files import STACK
from miro_robot.image.variables import variables_of

if TYPE_CHECKING:
    from miro_sim.world.world import World

_BANKS = 0x20
_RAM_BYTES = 0x100


def variables(image: Image) -> list[tuple[int, str]]:
    """(first address, name) of everything in internal RAM that has a name, by address; the first name of a place."""
    names: dict[int, str] = {}
    if image.symbols.problem is not None:
        return []
    for name, symbol in sorted(image.symbols.names.items()):
        if symbol.space == "iram" and 0 <= symbol.address <= 0xFF:
            names.setdefault(symbol.address, name)
    return sorted(names.items())


def name_of_byte(image: Image, address: int) -> str:
    """`_last_left+1`, `R3 of bank 1`, `stack`; "" for a byte without a name."""
    places = variables(image)
    index = bisect.bisect_right(places, (address, "\uffff")) - 1
    if index >= 0:
        first, name = places[index]
        if name == STACK:
            return "stack"
        return name if address == first else f"{name}+{address - first}"
    if address < _BANKS:
        return f"R{address & 7} of bank {address >> 3}"
    return ""


def extents(image: Image) -> dict[str, tuple[int, int]]:
    """Name -> (first address, bytes) of each variable outside the stack.

    Sizes come from the debug file; without one a variable ends where the next begins.
    """
    places = variables(image)
    sizes = (
        {f"_{name}": known[0].type.size for name, known in variables_of(image).by_name.items()}
        if places
        else {}
    )
    ranges = {}
    for (first, name), (end, _) in pairwise([*places, (_RAM_BYTES, "")]):
        if name != STACK:
            room = 1 if end == _RAM_BYTES else end - first  # where the last one ends is not known
            ranges[name] = (first, min(sizes.get(name, room), end - first))
    return ranges


_RAM = ".cpu.iram"
_STEP = re.compile(r"(\w+)(?:\[(\w+)\])?")
_PART = re.compile(r"lines\[(\d+)\]\.devices\[(\d+)\]\.board\.parts\[(\d+)\]")
_CHAIN = "chain"
"""The digest before: it differs because something else did."""


Value = int | float | str | None


class Record(msgspec.Struct, frozen=True):
    """Part of a result. As JSON: fields by name, `one` and `other` as a pair, a tick also in seconds of its `clock`."""

    def as_json(self) -> dict[str, Any]:
        document: dict[str, Any] = {}
        fields = msgspec.structs.asdict(self)
        for name, value in fields.items():
            if name == "one":
                pair = "places" if isinstance(value, Record) else "values"
                document[pair] = [_as_json(value), _as_json(fields["other"])]
            elif name not in ("other", "clock"):
                document[name] = _as_json(value)
            if name == "tick":
                document["t_s"] = value / fields.get("clock", TICKS_PER_SECOND)
        return document


def _as_json(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_as_json(inner) for inner in value]
    return value.as_json() if isinstance(value, Record) else value


class FieldDifference(Record, frozen=True):
    """A field of the state: `path` by the tables, `symbol` where the firmware has a name for it, and both values. Of a
    part on a board `symbol` is the part's name.

    A value is a number, or the text of something longer; None: there is no such item.
    """

    path: str
    symbol: str | None
    one: Value
    other: Value

    def __str__(self) -> str:
        name = f" ({self.symbol})" if self.symbol else ""
        return f"{self.path}{name}: {_shown(self.one)}, {_shown(self.other)}"


def differing(world: World, other: World) -> Iterator[FieldDifference]:
    """The fields that differ, item by item, of the fields that both worlds have and that enter a digest."""
    first, second = world.state, other.state
    values, others = first.decode(first.save()), second.decode(second.save())
    for path, value in values.items():
        if path == _CHAIN or path not in others or _is_apart(world, path):
            continue
        for item, here, there in item_differences(value, others[path]):
            if path.endswith(_RAM):
                index = int(item[1:-1])
                symbol = name_of_byte(world.image, index) or None
                yield FieldDifference(f"{path}[{index:02X}h]", symbol, here, there)
            else:
                yield FieldDifference(path + item, _name_of_part(world, path), here, there)


def _name_of_part(world: World, path: str) -> str | None:
    """The name of the part that a field belongs to; None where it belongs to none."""
    match = _PART.match(path)
    if match is None:
        return None
    line, device, part = map(int, match.groups())
    name: str = world.lines[line].devices[device].board.parts[part].name
    return name


def _is_apart(root: Any, path: str) -> bool:
    """True if a table names it, or a part that it belongs to, in `NOT_HASHED`: it enters no digest."""
    part = root
    for name, index in _STEP.findall(path):
        if any(name in cls.__dict__.get("NOT_HASHED", ()) for cls in type(part).__mro__):
            return True
        part = getattr(part, name, None)  # None: a field of a compiled part, which has no parts
        if index and part is not None:
            part = part[int(index) if index.isdecimal() else index]
    return False


def item_differences(value: Any, other: Any, path: str = "") -> Iterator[tuple[str, Value, Value]]:
    """Path (`[3]`, `.x_m`, ..; "" for a value without items) and both values of each difference."""
    if _bits(value) == _bits(other):
        return
    items, others = _items(value), _items(other)
    if not items or not others:
        yield path, _plain(value), _plain(other)
        return
    for name in {**items, **others}:
        yield from item_differences(items.get(name), others.get(name), path + name)


def _items(value: Any) -> dict[str, Any]:
    if isinstance(value, msgspec.Struct):
        return {f".{name}": getattr(value, name) for name in value.__struct_fields__}
    if isinstance(value, bytes | bytearray | list | tuple):
        return {f"[{index}]": item for index, item in enumerate(value)}
    return {}


def _bits(value: Any) -> Any:
    """Floats by their bits: -0.0 is not 0.0 in a digest."""
    return struct.pack("<d", value) if isinstance(value, float) else value


def _plain(value: Any) -> Value:
    return value if value is None or isinstance(value, int | float | str) else repr(value)


def _shown(value: Value) -> str:
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return "nothing" if value is None else str(value)
    if isinstance(value, float):
        return f"{value!r} ({struct.pack('>d', value).hex()}h)"
    return f"{value} ({value:X}h)" if value > 9 else str(value)
