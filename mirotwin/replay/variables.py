"""The variables of a firmware in internal RAM: which bytes belong to which name.

A symbol file tells where a variable begins.
"""

from __future__ import annotations

import bisect
import re
from itertools import pairwise

from miro_robot.image import Image
from miro_robot.image.symbol_files import read_text

_BANKS = 0x20
_RAM_BYTES = 0x100
_SIZE = re.compile(r"^S:(?:G|F\w+)\$(\w+)\$\w+\$\w+\(\{([0-9]{1,3})\}", re.MULTILINE)
STACK = "__start__stack"
"""SDCC's name for the first byte after all variables."""


def variables(image: Image) -> list[tuple[int, str]]:
    """(first address, name) of everything in internal RAM that has a name, by address; the first name of a place."""
    found: dict[int, str] = {}
    if image.symbols.problem is not None:
        return []
    for name, symbol in sorted(image.symbols.names.items()):
        if symbol.space == "iram" and 0 <= symbol.address <= 0xFF:
            found.setdefault(symbol.address, name)
    return sorted(found.items())


def name_of_byte(image: Image, address: int) -> str:
    """`_last_left+1`, `R3 of bank 1`, `stack`, or "" where nothing is known."""
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
    """Name -> (first address, bytes) of each variable; nothing of what lies on the stack.

    A debug file tells sizes; without one a variable ends where the next begins.
    """
    sizes = {f"_{name}": int(size) for name, size in _SIZE.findall(read_text(image.path.with_suffix(".cdb")))}
    places = variables(image)
    found = {}
    for (first, name), (end, _) in pairwise([*places, (_RAM_BYTES, "")]):
        if name != STACK:
            room = 1 if end == _RAM_BYTES else end - first  # where the last one ends is not known
            found[name] = (first, min(sizes.get(name, room), end - first))
    return found
