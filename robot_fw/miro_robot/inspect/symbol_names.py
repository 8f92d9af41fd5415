"""Addresses by name: symbols of the image, registers of the chip, numbers for the rest."""

from __future__ import annotations

import bisect

from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo
from miro_robot.mcs51.opcodes import BITS, INTERRUPTS, LENGTH, SFRS, Names, goes_on, is_call, target

_NOP = 0x00
_VECTORS = (0, *(8 * number + 3 for number in range(len(INTERRUPTS))))


class SymbolNames(Names):
    """Names of one image. Places between code symbols are written as symbol+offset if `offsets` is true."""

    def __init__(self, image: Image) -> None:
        symbols = image.symbols.names
        self.functions = functions(image)
        self._starts = [address for address, _ in self.functions]
        self._code = dict(self.functions)
        self._direct = {address: name for name, address in SFRS.items()}
        self._bits = {address: name for name, address in BITS.items()}
        for name, symbol in sorted(symbols.items(), reverse=True):
            if symbol.space == "iram" and symbol.address < 0x80:
                self._direct[symbol.address] = name
            elif symbol.space == "bit" and symbol.address < 0x80:
                self._bits[symbol.address] = name

    def code(self, address: int) -> str:
        return self._code.get(address) or super().code(address)

    def direct(self, address: int) -> str:
        return self._direct.get(address) or super().direct(address)

    def bit(self, bit: int) -> str:
        return self._bits.get(bit) or super().bit(bit)

    def function(self, address: int) -> tuple[int, str]:
        """(first address, name) of what the instruction belongs to."""
        index = bisect.bisect_right(self._starts, address) - 1
        return self.functions[index] if index >= 0 else (0, super().code(0))

    def place(self, address: int) -> str:
        """Symbol and offset: `_main+12`."""
        first, name = self.function(address)
        return name if address == first else f"{name}+{address - first}"


def functions(image: Image) -> list[tuple[int, str]]:
    """(first address, name) of every piece of code that has a name, ascending.

    An image without symbols has those that can be seen: reset, interrupt vectors, and where calls and vectors lead.
    """
    named: dict[int, str] = {}
    for name, symbol in sorted(image.symbols.names.items(), reverse=True):
        if symbol.space == "code":
            named[symbol.address] = name
    # static functions may share a name, of which the symbols have one
    for function in DebugInfo.of(image).functions:
        named.setdefault(function.first, function.name)
    instructions = _sweep(image)
    if not named:
        leading = [at for at in instructions if is_call(image.code[at]) or at in _VECTORS]
        entries = {target(image.code, address) for address in leading}
        named = {address: f"{address:04X}h" for address in instructions if address in entries}
    first = min(named, default=len(image.code))
    for vector, source in zip(_VECTORS[1:], INTERRUPTS, strict=True):
        if vector < first and instructions.get(vector) and image.code[vector] != _NOP:
            named[vector] = f"vector {source}"
    named.setdefault(0, "reset")
    return sorted(named.items())


def _sweep(image: Image) -> dict[int, bool]:
    """Addresses of instructions, one after the other, and whether the one before goes elsewhere or is padding."""
    entries: dict[int, bool] = {}
    for first, end in image.used:
        address = first
        entry = True
        while address < end:
            entries[address] = entry
            opcode = image.code[address]
            entry = opcode == _NOP or not goes_on(opcode)
            address += LENGTH[opcode]
    return entries
