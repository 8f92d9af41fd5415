"""Local variables in registers, and the C block of an instruction.

The debug file contains the block of declaration of each variable, not the range in which it is live: within its block a
register may hold something else already, and one without registers was optimised away.
"""

from __future__ import annotations

import bisect
import re
from functools import lru_cache

import msgspec

from miro_robot.image.c_types import MOST_BYTES, CType, type_of

_KEPT = 32
STACK = "B"  # storage, as the debug file has it; R: registers
_LOCAL = re.compile(
    r"^S:L(?:([\w.]*)\.)?(\w+)\$(\w+)\$([0-9]{1,4})_[0-9]+\$([0-9]{1,6})"
    r"\(\{([0-9]{1,6})\}([^():]*):([SU])\),([A-Z]),[0-9],(-?[0-9]{1,3})(?:,\[([\w,]*)\])?"
)
_FUNCTION = re.compile(r"^F:(?:G|F(\w+))\$(\w+)\$[^(]*\(.*\),[A-Z],-?[0-9]+,-?[0-9]+,[0-9]+,[0-9]+,([0-3])$")
_LINE = re.compile(r"^L:C\$[^$]+\$[0-9]+\$([0-9]{1,4})_[0-9]+\$([0-9]{1,6}):([0-9A-F]{1,8})$")


class LocalVariable(msgspec.Struct, frozen=True):
    """`registers`: `r7`, `dpl`, .., low byte first; none where it was optimised away. `offset`: from the frame pointer,
    where `storage` is STACK.
    """

    name: str
    module: str
    function: str
    level: int
    block: int
    type: CType
    storage: str
    registers: tuple[str, ...]
    offset: int


class Blocks(msgspec.Struct, frozen=True, eq=False):
    """The blocks of one debug file. `places`: (address, level, block) at which the code of a block begins or continues,
    sorted by address. `banks`: (name, module) of a function -> its register bank; module is "" for a function that is
    not static.
    """

    variables: tuple[LocalVariable, ...]
    places: tuple[tuple[int, int, int], ...]
    banks: dict[tuple[str, str], int]

    def bank(self, name: str, module: str) -> int:
        """The number of the register bank that a function was compiled for."""
        return self.banks.get((name, module), self.banks.get((name, ""), 0))

    def of_function(self, name: str, module: str) -> list[LocalVariable]:
        """Local variables of a function; `module` distinguishes static functions of the same name."""
        own = [variable for variable in self.variables if variable.function == name]
        alike = len({variable.module for variable in own}) < 2
        return own if alike else [variable for variable in own if variable.module == module]

    def parameters(self, own: list[LocalVariable], first: int, end: int) -> list[LocalVariable]:
        """The parameters among `own` of a function: their block is the one before its body's."""
        begin, after = (bisect.bisect_left(self.places, (address, 0, 0)) for address in (first, end))
        bodies = [(address, block) for address, level, block in self.places[begin:after] if level <= 1]
        _, body = min(bodies, default=(0, 0))  # of a function of one line, only its end is recorded
        return [variable for variable in own if variable.level <= 1 and variable.block < body]

    def visible(self, own: list[LocalVariable], first: int, address: int) -> list[LocalVariable]:
        """The variables among `own`, in registers or on the stack, that are in scope at an instruction; inner ones
        first.
        """
        around = self._around(first, address)
        seen = [variable for variable in own if variable.level <= 1 or variable.block in around]
        return sorted(
            (variable for variable in seen if variable.storage in "RB"), key=lambda variable: -variable.level
        )

    def _around(self, first: int, address: int) -> set[int]:
        """The blocks around an instruction: the one before with a lower level is the next outer one."""
        at = bisect.bisect_right(self.places, (address, 1 << 30, 0)) - 1
        start = bisect.bisect_left(self.places, (first, 0, 0))
        if at < start:
            return set()
        _, level, block = self.places[at]
        around = {block}
        opened = {(number, depth) for _, depth, number in self.places[start:] if number < block}
        for number, depth in sorted(opened, reverse=True):
            if depth < level:
                around.add(number)
                level = depth
        return around


@lru_cache(_KEPT)
def parse_blocks(text: str) -> Blocks:
    """From a debug file's text; records that are damaged or of an unknown type are left out."""
    variables, places, banks = [], [], {}
    for line in text.splitlines():
        if match := _LOCAL.match(line):
            kind = type_of(match[7], int(match[6]), match[8] == "S")
            if kind is not None and not re.fullmatch(r"sloc[0-9]+", match[3]):
                registers = tuple(match[11].split(",")) if match[11] else ()
                where = registers if len(registers) == kind.size else ()
                level, block, offset = int(match[4]), int(match[5]), int(match[10])
                variables.append(
                    LocalVariable(
                        match[3], match[1] or "", match[2], level, block, kind, match[9], where, offset
                    )
                )
        elif function := _FUNCTION.match(line):
            banks[function[2], function[1] or ""] = int(function[3])
        elif (place := _LINE.match(line)) and (address := int(place[3], 16)) < MOST_BYTES:
            places.append((address, int(place[1]), int(place[2])))
    return Blocks(tuple(variables), tuple(sorted(places)), banks)
