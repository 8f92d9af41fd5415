"""Places in code memory as people write and read them: symbols, and addresses as 0x..."""

from __future__ import annotations

from collections.abc import Iterable

from miro_exact.bad_input import BadInput
from miro_robot.image import SPACE_BYTES, Image
from miro_robot.inspect.symbol_names import SymbolNames
from mirotwin.shell.command import Option

SYMBOL = Option(
    "--symbol", metavar="SYMBOL|ADDRESS", help="Only the function at this symbol or address; may be repeated."
)


def address_of(text: str, image: Image, path: str, option: str) -> int:
    """A code address from 0x.. or from a symbol's name, with or without the underscore that C puts before
    it.
    """
    if text[:2].lower() == "0x":
        try:
            address = int(text, 16)
        except ValueError:
            raise BadInput("", option, f"{text} is not a hexadecimal number") from None
        if address >= SPACE_BYTES:
            raise BadInput("", option, f"{text} is beyond the last code address", "use 0x0000 to 0xffff")
        return address
    if not text:
        raise BadInput("", option, "the place is empty", "give a symbol or an address as 0x..")
    if text.isascii() and text.isdecimal() and len(text) <= 6:
        raise BadInput("", option, f"{text} is no symbol", f"write {int(text):#x} for an address")
    return image.code_address(text, path, option)


def check_code_at(address: int, image: Image, path: str, option: str) -> None:
    """Raises BadInput for an address that the processor cannot execute."""
    if not any(first <= address < end for first, end in image.used):
        raise BadInput(path, option, f"the image has no code at {address:#06x}", "see mirotwin fw disasm")


def functions_at(places: Iterable[str], image: Image, names: SymbolNames, path: str) -> set[tuple[int, str]]:
    """(first address, name) of the functions that --symbol names; static ones of several files may share a name.

    An address stands for the function around it.
    """
    functions = set()
    for place in places:
        address = address_of(place, image, path, "--symbol")
        check_code_at(address, image, path, "--symbol")
        around = names.function(address)
        by_address = place[:2].lower() == "0x"
        functions |= {around} if by_address else {other for other in names.functions if other[1] == around[1]}
    return functions


def place_of(address: int, image: Image) -> str:
    """An address for people."""
    name = image.symbols.name_at(address)
    return f"{address:#06x} in {name}" if name else f"{address:#06x}"
