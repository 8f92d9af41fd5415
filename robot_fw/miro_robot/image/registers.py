"""Local variables that the compiler keeps in registers, and which block of C an instruction belongs to.

The debug file tells for each one the block it is declared in, not where it lives: within its block a register may hold
something else already, and one without registers was optimised away.
"""

from __future__ import annotations

import bisect
import re
from functools import lru_cache

import msgspec

from miro_robot.image.c_types import MOST_BYTES, CType, type_of

_KEPT = 32
_LOCAL = re.compile(
    r"^S:L(?:[\w.]*\.)?(\w+)\$(\w+)\$([0-9]{1,4})_[0-9]+\$([0-9]{1,6})"
    r"\(\{([0-9]{1,6})\}([^():]*):([SU])\),([RB]),[0-9],-?[0-9]+(?:,\[([\w,]*)\])?"
)
_LINE = re.compile(r"^L:C\$[^$]+\$[0-9]+\$([0-9]{1,4})_[0-9]+\$([0-9]{1,6}):([0-9A-F]{1,8})$")


class RegisterVariable(msgspec.Struct, frozen=True):
    """`registers`: `r7`, `dpl`, .., low byte first; none where it was optimised away. `on_stack`: it lies there."""

    name: str
    function: str
    level: int
    block: int
    type: CType
    registers: tuple[str, ...]
    on_stack: bool


class Blocks(msgspec.Struct, frozen=True, eq=False):
    """Of one debug file. `places`: (address, level, block) where the code of a block begins or goes on, by address."""

    variables: tuple[RegisterVariable, ...]
    places: tuple[tuple[int, int, int], ...]

    def visible(self, function: str, first: int, address: int) -> list[RegisterVariable]:
        """Those of a function, which begins at `first`, that the C of an instruction could name; inner ones first."""
        own = [one for one in self.variables if one.function == function]
        around = self._around(first, address)
        seen = [one for one in own if one.level <= 1 or one.block in around]
        return sorted(seen, key=lambda one: -one.level)

    def _around(self, first: int, address: int) -> set[int]:
        """The blocks around an instruction: the one before with a lower level is the next outer one."""
        at = bisect.bisect_right(self.places, (address, 1 << 30, 0)) - 1
        start = bisect.bisect_left(self.places, (first, 0, 0))
        if at < start:
            return set()
        _, level, block = self.places[at]
        found = {block}
        opened = {(number, depth) for _, depth, number in self.places[start:] if number < block}
        for number, depth in sorted(opened, reverse=True):
            if depth < level:
                found.add(number)
                level = depth
        return found


@lru_cache(_KEPT)
def parse_blocks(text: str) -> Blocks:
    """From a debug file's text; records that are damaged or of an unknown type are left out."""
    variables, places = [], []
    for line in text.splitlines():
        if found := _LOCAL.match(line):
            kind = type_of(found[6], int(found[5]), found[7] == "S")
            if kind is not None and not re.fullmatch(r"sloc[0-9]+", found[2]):
                registers = tuple(found[9].split(",")) if found[9] else ()
                sound = len(registers) in (0, kind.size)
                where = registers if sound else ()
                variables.append(
                    RegisterVariable(
                        found[2], found[1], int(found[3]), int(found[4]), kind, where, found[8] == "B"
                    )
                )
        elif (place := _LINE.match(line)) and (address := int(place[3], 16)) < MOST_BYTES:
            places.append((address, int(place[1]), int(place[2])))
    return Blocks(tuple(variables), tuple(sorted(places)))
