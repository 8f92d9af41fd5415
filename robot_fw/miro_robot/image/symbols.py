"""Names of an image: what the linker wrote into the `.map` and `.cdb` beside it.

The files are read with the first look-up of a name. Most programs that load an image look up none.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable
from functools import cached_property

from miro_exact.bad_input import BadInput
from miro_robot.image.symbol_files import Symbol

STACK = "__start__stack"


class Symbols:
    """Names of an image. C names carry the compiler's underscore; lookups take them with or without.

    `names`: the names, or a function that reads them, which may raise BadInput. `used`: (first, end) of the addresses
    that the image has bytes for; code anywhere else has no name. Not given: all have.
    """

    def __init__(
        self,
        names: dict[str, Symbol] | Callable[[], dict[str, Symbol]],
        used: tuple[tuple[int, int], ...] = (),
    ) -> None:
        self._given = names
        self._used = used

    def with_stack(self, start: int) -> Symbols:
        """The same names with a stack from that address of internal RAM to FFh."""
        return Symbols(lambda: {**self.names, STACK: Symbol(start, "iram")}, self._used)

    @cached_property
    def names(self) -> dict[str, Symbol]:
        """Raises ImageError where a file beside the image belongs to another one."""
        return self._given() if callable(self._given) else self._given

    @property
    def problem(self) -> BadInput | None:
        """Why there are no names: the error that `names` raises, None if it raises none."""
        try:
            _ = self.names
        except BadInput as error:
            return error
        return None

    def find(self, name: str) -> Symbol | None:
        """Where the name is. Raises ImageError as `names` does."""
        return self.names.get(name) or self.names.get("_" + name)

    @cached_property
    def stack(self) -> tuple[int, int]:
        """First and last address that the stack may use: from where the linker begins it to the next name above.

        All of internal RAM where nothing says so. SDCC's stack grows upwards, and what lies above it is data.
        """
        start = None if self.problem is not None else self.names.get(STACK)
        if start is None or start.space != "iram":
            return 0, 0xFF
        above = [
            one.address for one in self.names.values() if one.space == "iram" and one.address > start.address
        ]
        return start.address, min([*above, 0x100]) - 1

    def name_at(self, address: int) -> str:
        """The last code symbol at or before `address`, "" if there is none or there is a `problem`.

        Names the place of a fault, which is to be reported whatever lies beside the image.
        """
        if self.problem is not None:
            return ""
        if self._used and not any(first <= address < end for first, end in self._used):
            return ""
        addresses, names = self._code
        index = bisect.bisect_right(addresses, address)
        return names[index - 1] if index else ""

    @cached_property
    def _code(self) -> tuple[list[int], list[str]]:
        """Addresses and names of code, by address."""
        code = sorted((symbol.address, name) for name, symbol in self.names.items() if symbol.space == "code")
        return [address for address, _ in code], [name for _, name in code]

    def __repr__(self) -> str:
        if self.problem is not None:
            return "Symbols(files of another image)"
        return f"Symbols({len(self.names)} names, {len(self._code[0])} in code)"
