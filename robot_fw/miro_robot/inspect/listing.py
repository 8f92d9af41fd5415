"""An image as a listing: every loaded byte once, as an instruction or as data, with its C line."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import msgspec

from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.symbol_files import SourceLine
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.opcodes import CYCLES, LENGTH, disassemble

_DATA_ROW = 8
_UNDEFINED = 0xA5


class ListingRow(msgspec.Struct, frozen=True):
    """`cycles` is 0 for data; `line` stands on the first row of what the compiler made of a C line."""

    address: int
    data: bytes
    text: str
    cycles: int
    line: SourceLine | None = None


def rows(
    image: Image, debug: DebugInfo, names: SymbolNames, executed: Collection[int] = ()
) -> Iterator[ListingRow]:
    """All of the image in the order of addresses. Instructions are taken one after the other from each name on; one
    whose operand would reach into what has a name of its own is data. `executed`: places where instructions begin
    for sure, which sets right what a table between instructions of a bare image has put out of step.
    """
    begins = dict(debug.lines)
    marks = {address for address, _ in names.functions} | set(executed)
    for first, end in image.used:
        address = first
        while address < end:
            opcode = image.code[address]
            constant = debug.is_constant(address)
            wanted = _DATA_ROW if constant else LENGTH[opcode]
            data = image.code[address : _cut(address, min(address + wanted, end), marks)]
            if constant or opcode == _UNDEFINED or len(data) < wanted:
                yield ListingRow(address, data, "DB " + ",".join(f"{byte:02X}h" for byte in data), 0)
            else:
                line = begins.get(address) if debug.line_at(address) else None
                yield ListingRow(address, data, disassemble(image.code, address, names), CYCLES[opcode], line)
            address += len(data)


def _cut(first: int, end: int, marks: set[int]) -> int:
    """`end`, or the first mark before it."""
    return next((address for address in range(first + 1, end) if address in marks), end)


def text_lines(
    image: Image, debug: DebugInfo, names: SymbolNames, sources: Sources, executed: Collection[int] = ()
) -> Iterator[str]:
    """The listing as text: names and C lines stand above the code they begin."""
    labels = dict(names.functions)
    for row in rows(image, debug, names, executed):
        if row.address in labels:
            yield ""
            yield f"{labels[row.address]}:"
        if row.line is not None:
            yield f"; {row.line}: {sources.text(row.line)}".rstrip(": ")
        cycles = str(row.cycles) if row.cycles else ""
        yield f"{row.address:04X}  {row.data.hex(' ').upper():<23}  {cycles:>1}  {row.text}".rstrip()
