"""Static data of an image for the sanitizer: C lines, the bytes of variables, and accesses of instructions."""

from __future__ import annotations

import re
from collections.abc import Iterator

import msgspec

from miro_robot.image import Image
from miro_robot.image.c_types import CType, Fields
from miro_robot.image.debug_info import DebugInfo
from miro_robot.image.keil_map import KeilMap, keil_map
from miro_robot.image.symbol_files import map_overlays, read_text
from miro_robot.image.variables import variables_of
from miro_robot.inspect.writes import READS_BY_ROW, written_form
from miro_robot.mcs51.opcodes import LENGTH, ROW

SCALAR, LOCAL = 1, 2
"""A byte of a variable that the whole program has; of parameters, local variables, and what functions share."""
FORMS = {"": 0, "dir": 1, "src": 1, "dst": 2, "@Ri": 3, "x@DPTR": 4, "x@Ri": 5}
XRAM = _IRAM_BYTES = 256
"""Places from here on are external RAM."""
_INDIVISIBLE = {0x05, 0x06, 0x15, 0x16, 0x42, 0x43, 0x52, 0x53, 0x62, 0x63, 0xC5, 0xC6, 0xD5, 0xD6}  # rows
_IMMEDIATE = {0x75, 0x76}
_DPTR, _INC_DPTR, _LONGEST = 0x90, 0xA3, 4
_PARAMETER = "_PARM_"
_MOST_PARAMETER_BYTES = 4
_LOCAL_PLACE = re.compile(r"^L:L\w+\.(\w+)\$(\w+)\$\w+\$\w+:([0-9A-F]{1,8})$", re.MULTILINE)
"""Of a .cdb: function, C name and address; it has them of parameters without their types."""

READS = bytes(next((FORMS[word] for word in READS_BY_ROW[ROW[op]] if word in FORMS), 0) for op in range(256))
WRITES = bytes(FORMS[written_form(ROW[op])] for op in range(256))
CONSTANT = bytes(ROW[op] in _INDIVISIBLE | _IMMEDIATE for op in range(256))
"""By opcode: what it reads and writes of memory, and whether what it writes follows from itself alone."""
_SPECIAL = {
    0x11: 1, 0x12: 1, 0x22: 2, 0x32: 3, 0xC0: 4, 0xC2: 5, 0x10: 6, 0x83: 7, 0x93: 7, 0xE0: 8, 0xE2: 8, 0xF0: 9, 0xF2: 9,
}  # fmt: skip
SPECIAL = bytes(_SPECIAL.get(ROW[op], 0) for op in range(256))
"""Calls 1, RET 2, RETI 3, PUSH 4, CLR bit 5, JBC 6, MOVC 7, MOVX 8 and 9."""
_PUT_GENERIC = "__gptrput"


class Layout(msgspec.Struct, frozen=True, eq=False):
    """`lines`: instruction -> a number of its C line; `places`: place -> (kind, key), of which a scalar's bytes share
    one, its first place; `names`: key -> the variable's name; `local_names`: (key, function) -> the name there;
    `elements`: keys of numbers in arrays; `put_generic`:
    where SDCC's store through a generic pointer is, -1 without it; `by_map`: a Keil map names the variables.
    """

    lines: dict[int, int]
    places: dict[int, tuple[int, int]]
    names: dict[int, str]
    local_names: dict[tuple[int, str], str]
    elements: set[int]
    put_generic: int
    debug: DebugInfo
    by_map: bool = False

    @property
    def unseen(self) -> str:
        """Text about findings that need a .cdb; "" with one."""
        if self.by_map:
            return "no .cdb beside it: variables are as long as its map leaves room, and overlays are not observable"
        known = self.names or self.local_names
        return "" if known else "no .cdb beside it: races and overlays are not observable"


def layout_of(image: Image) -> Layout:
    """Raises ImageError for debug files of another image."""
    debug = DebugInfo.of(image)
    numbers: dict[object, int] = {}
    addresses = (address for first, end in image.used for address in range(first, end))
    places_of_lines = ((address, debug.line_at(address)) for address in addresses)
    lines = {
        at: numbers.setdefault(line, len(numbers) + 1) for at, line in places_of_lines if line is not None
    }
    variables = variables_of(image)
    places, local_names = _shared(image)
    names, elements = {}, set()
    kept = [
        variable
        for each in variables.by_name.values()
        for variable in each
        if variable.space in ("iram", "xram")
    ]
    # Locals first: where both claim a byte, the whole program's variable overwrites them.
    for variable in sorted(kept, key=lambda variable: not variable.local):
        base = variable.address + (XRAM if variable.space == "xram" else 0)
        if variable.local:
            for place in range(base, base + variable.type.size):
                places[place] = LOCAL, place
                local_names[place, variable.scope] = variable.name
            continue
        for offset, size, name in _scalars(variable.type, variables.fields(variable), variable.name):
            for place in range(base + offset, base + offset + size):
                places[place] = SCALAR, base + offset
            names[base + offset] = name
            if variable.type.kind == "array":
                elements.add(base + offset)
    keil = None if kept or places else keil_map(image.path)
    for base, size, name in () if keil is None else _of_keil(image, keil, lines):
        places |= dict.fromkeys(range(base, base + size), (SCALAR, base))
        names[base] = name
    put = image.symbols.names.get(_PUT_GENERIC)
    at = -1 if put is None else put.address
    return Layout(lines, places, names, local_names, elements, at, debug, keil is not None and bool(names))


def _of_keil(image: Image, keil: KeilMap, lines: dict[int, int]) -> Iterator[tuple[int, int, str]]:
    """(place, size, name) of bytes, and of numbers of 2 to 4 bytes: what one line of C takes all bytes of, by their own
    addresses. The others are arrays or structs.
    """
    touched: dict[int, set[int]] = {}
    code, at, dptr = image.code + bytes(2), 0, -1
    while at < len(image.code):
        number, length = lines.get(at), LENGTH[code[at]]
        if number is None:
            at += 1
            continue
        within = touched.setdefault(number, set())
        within |= {code[at + form] for form in (READS[code[at]], WRITES[code[at]]) if form in (1, 2)}
        dptr = code[at + 1] << 8 | code[at + 2] if code[at] == _DPTR else dptr + (code[at] == _INC_DPTR)
        within.add(XRAM + dptr)
        at = next((at + more for more in range(1, length) if lines.get(at + more) != number), at + length)
    words = [touched_bytes for touched_bytes in touched.values() if len(touched_bytes) > 1]
    for space, first, size, name in keil.variables:
        base, room = (first + XRAM, XRAM + 0x10000) if space == "xram" else (first, _IRAM_BYTES)
        bytes_of_it = {*range(base, base + size)}
        if base + size <= room and (
            size == 1 or (size <= _LONGEST and any(bytes_of_it <= touched_bytes for touched_bytes in words))
        ):
            yield base, size, name


def _shared(image: Image) -> tuple[dict[int, tuple[int, int]], dict[tuple[int, str], str]]:
    """Data from the map alone: the area of overlays, and parameters of library functions."""
    symbols = image.symbols.names
    in_ram = sorted({symbol.address for symbol in symbols.values() if symbol.space == "iram"})
    records = _LOCAL_PLACE.findall(read_text(image.path.with_suffix(".cdb")))
    names = {(int(at, 16), function): name for function, name, at in records}
    places: dict[int, tuple[int, int]] = {}
    for first, end in map_overlays(read_text(image.path.with_suffix(".map"))):
        places.update((place, (LOCAL, place)) for place in range(first, min(end, _IRAM_BYTES)))
    for name, symbol in symbols.items():
        if _PARAMETER in name and symbol.space == "iram":
            end = min([at for at in in_ram if at > symbol.address], default=_IRAM_BYTES)
            size = min(end - symbol.address, _MOST_PARAMETER_BYTES)
            function, _, number = name.removeprefix("_").partition(_PARAMETER)
            known = names.get((symbol.address, function), f"parameter {number}")
            for place in range(symbol.address, symbol.address + size):
                places[place] = LOCAL, place
                names[place, function] = known
    return places, names


def _scalars(kind: CType, fields: Fields, name: str) -> Iterator[tuple[int, int, str]]:
    """(offset, bytes, name) of the numbers that a variable is made of; elements of an array have the array's name."""
    if kind.kind == "array" and kind.element is not None:
        inner = [*_scalars(kind.element, fields, name)]
        for index in range(kind.count):
            yield from ((index * kind.element.size + offset, size, text) for offset, size, text in inner)
    elif kind.kind == "struct":
        for member in fields.get(kind.tag, ()):
            for offset, size, text in _scalars(member.type, fields, f"{name}.{member.name}"):
                yield member.offset + offset, size, text
    else:
        yield 0, max(1, kind.size), name
