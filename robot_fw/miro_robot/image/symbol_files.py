"""Parses SDCC's files beside an image: `.map`, `.cdb` and `.rst`, each in one pass, and looks up names in them.

Parsed files are cached by content, so a file is parsed only once in a process, also for another image or world. Lines
count from 1, as `str.splitlines` has them. The files are read with the first look-up of a name: most programs that load
an image look up none.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Callable
from functools import cached_property, lru_cache
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import decode, read_input

_KEPT = 32
_SPACE = 0x10000  # an address beyond is damage: no memory of the 8051 has it
_Scope = tuple[str, str]
"""(scope, name) of a C name: scope is G, or F and the file."""


class Symbol(msgspec.Struct, frozen=True):
    """Address of a name from the linker; `space` is code, iram, xram, sfr or bit."""

    address: int
    space: str


class SourceLine(msgspec.Struct, frozen=True, order=True):
    """A line of a source file, by the name the compiler was given; lines count from 1."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class CodePlace(msgspec.Struct, frozen=True):
    """A name inside a relocatable code area that has a size, and the line of the map; one at its end marks the end."""

    area: str
    name: str
    address: int
    line: int


class MapFile(msgspec.Struct, frozen=True, eq=False):
    """A map. `instructions`: (address, line of the file) of assembler lines, by address, each address once."""

    names: dict[str, Symbol]
    places: tuple[CodePlace, ...]
    instructions: tuple[tuple[int, int], ...]


class CdbFile(msgspec.Struct, frozen=True, eq=False):
    """A debug file. `lines`: (address, C line); `begins`, `ends`: first and last instruction of functions."""

    names: dict[str, Symbol]
    instructions: tuple[tuple[int, int], ...]
    lines: tuple[tuple[int, SourceLine], ...]
    begins: dict[_Scope, int]
    ends: tuple[tuple[_Scope, int], ...]


class ListedCode(msgspec.Struct, frozen=True):
    """Bytes in a listing. `line`: the C line named above them; `timed`: an instruction, with a number of clocks."""

    number: int
    address: int
    data: bytes
    line: SourceLine | None
    timed: bool


def read_text(path: Path) -> str:
    """The text of a file beside an image, "" if there is none. Raises InputError for one that is too long."""
    return decode(read_input(path)) if path.is_file() else ""


_HEX = re.compile(r"[0-9A-F]{8}")
_ATTRIBUTES = re.compile(r"bytes \(([A-Z,]+)\)")
_RECORD = re.compile(r"^([CDB]:)?\s+([0-9A-F]{8})\s+(?:(_\w+)\s|(A\$))")


@lru_cache(_KEPT)
def parse_map(text: str) -> MapFile:
    """Parses an SDCC (ASxxxx) map file: the area in a page's heading gives the space of its names."""
    names: dict[str, Symbol] = {}
    places: list[CodePlace] = []
    instructions: dict[int, int] = {}
    area = space = ""
    first = end = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if " = " in line and (head := _map_area(line)):
            area, first, size, attributes = head
            space = _map_space(area, attributes)
            end = first + size if "CODE" in attributes and "REL" in attributes else 0
        elif (line[:1].isspace() or line[1:2] == ":") and (record := _RECORD.match(line)):
            prefix, address = record[1], int(record[2], 16)
            if name := record[3]:
                if space and address < _SPACE:
                    names[name] = Symbol(address, space)
                if prefix in (None, "C:") and first <= address < min(end, _SPACE):
                    places.append(CodePlace(area, name, address, number))
            elif prefix == "C:" and address < _SPACE:
                instructions.setdefault(address, number)
    return MapFile(names, tuple(places), tuple(sorted(instructions.items())))


def _map_area(line: str) -> tuple[str, int, int, list[str]] | None:
    """Name, address, size and attributes of an area, where a line is the head of one: `NAME ADDRESS SIZE = ..`."""
    left, equals, right = line.partition(" = ")
    fields = left.rsplit(None, 2) if equals and not line[:1].isspace() else []
    attributes = _ATTRIBUTES.search(right)
    if len(fields) < 3 or attributes is None or not all(map(_HEX.fullmatch, fields[1:])):
        return None
    return fields[0], int(fields[1], 16), int(fields[2], 16), attributes[1].split(",")


def _map_space(area: str, attributes: list[str]) -> str:
    for attribute, space in (("CODE", "code"), ("XDATA", "xram"), ("BIT", "bit")):
        if attribute in attributes:
            return space
    return "sfr" if "ABS" in area else "bit" if area == "BSEG" else "iram"


_MAP_MODULE = re.compile(r"^(\S+)\.rel\s+\[", re.MULTILINE)
_MAP_CONSTANTS, _MAP_OVERLAYS = (
    re.compile(rf"^(?:{areas})\s+([0-9A-F]{{8}})\s+([0-9A-F]{{8}}) =", re.MULTILINE)
    for areas in ("CONST|XINIT", "OSEG")
)


def map_modules(text: str) -> list[str]:
    """The modules that were linked, in their order, each once."""
    return list(dict.fromkeys(_MAP_MODULE.findall(text)))


def map_constants(text: str) -> list[tuple[int, int]]:
    """(first, end) of the areas of constants."""
    return _extents(_MAP_CONSTANTS, text)


def map_overlays(text: str) -> list[tuple[int, int]]:
    """(first, end) of what functions share that are not under way at a time."""
    return _extents(_MAP_OVERLAYS, text)


def _extents(areas: re.Pattern[str], text: str) -> list[tuple[int, int]]:
    spans = dict.fromkeys(areas.findall(text))
    return [(int(at, 16), int(at, 16) + int(size, 16)) for at, size in spans if int(size, 16)]


CDB_SPACES = {
    "C": "code", "D": "code", "E": "iram", "G": "iram", "F": "xram", "H": "bit", "I": "sfr", "J": "bit",
}  # fmt: skip
# Numbers have at most as many digits as SDCC writes, with some to spare: a longer one is damage, and no record.
_CDB_SYMBOL = re.compile(r"^S:((?:G|F\w+)\$(\w+)\$\w+\$\w+)\(.*\),([A-Z]),")
_CDB_INSTRUCTION = re.compile(r"^L:A\$[^:]*:([0-9A-F]{1,8})\b")
_CDB_LINE = re.compile(r"^L:C\$([^$]+)\$([0-9]{1,9})\$\w+\$\w+:([0-9A-F]{1,8})$")
_CDB_NAME = re.compile(r"^L:(X?)(G|F\w+)\$(\w+)\$\w+\$\w+:([0-9A-F]{1,8})$")


@lru_cache(_KEPT)
def parse_cdb(text: str) -> CdbFile:
    """An SDCC debug file: globals and file statics, SFRs apart from SFR bits, C lines, and where functions are."""
    spaces: dict[_Scope, str] = {}
    names: dict[str, Symbol] = {}
    instructions: dict[int, int] = {}
    lines: list[tuple[int, SourceLine]] = []
    begins: dict[_Scope, int] = {}
    ends: list[tuple[_Scope, int]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("S:"):
            symbol = _CDB_SYMBOL.match(line)
            if symbol and symbol[3] in CDB_SPACES:
                spaces[_scope(symbol[1])] = CDB_SPACES[symbol[3]]
        elif line.startswith("L:A$"):
            if (match := _CDB_INSTRUCTION.match(line)) and (address := int(match[1], 16)) < _SPACE:
                instructions.setdefault(address, number)
        elif line.startswith("L:C$"):
            if (match := _CDB_LINE.match(line)) and (address := int(match[3], 16)) < _SPACE:
                lines.append((address, SourceLine(match[1], int(match[2]))))
        elif line.startswith("L:") and (match := _CDB_NAME.match(line)):
            scope, address = (match[2], match[3]), int(match[4], 16)
            if address >= _SPACE:
                continue
            if match[1]:
                ends.append((scope, address))
                continue
            begins[scope] = address
            if scope in spaces:
                names["_" + match[3]] = Symbol(address, spaces[scope])
    return CdbFile(names, tuple(sorted(instructions.items())), tuple(lines), begins, tuple(ends))


def _scope(qualified: str) -> _Scope:
    """`G$main$0_0$0` and its link record `G$main$0$0` alike: (scope, name)."""
    scope, name = qualified.split("$")[:2]
    return scope, name


_RST_LINE = re.compile(r"^\s*[0-9]+ ;\t([^\s:]+\.\w+):([0-9]{1,9}): ")
_RST_CODE = re.compile(r"^ {6}([0-9A-F]{6})((?: [0-9A-F]{2})+) +(\[\d+\])?")


@lru_cache(_KEPT)
def parse_listing(text: str) -> tuple[ListedCode, ...]:
    """A relinked listing: the bytes of each of its lines, with the C line that a comment above names."""
    listed: list[ListedCode] = []
    line = None
    for number, row in enumerate(text.splitlines(), start=1):
        if named := _RST_LINE.match(row):
            line = SourceLine(named[1], int(named[2]))
        elif code := _RST_CODE.match(row):
            data = bytes.fromhex(code[2])
            listed.append(ListedCode(number, int(code[1], 16), data, line, bool(code[3])))
    return tuple(listed)


_BIT_CODES = b"\x10\x20\x30\x72\x82\x92\xa0\xa2\xb0\xb2\xc2\xd2"  # their second byte is the address of a bit
_RST_BIT = re.compile(r"^ {6}[0-9A-F]{6} ([0-9A-F]{2}) ([0-9A-F]{2}).*\t\w+\t(?:c,\s*/?)?(_\w+)\b")


@lru_cache(_KEPT)
def parse_bits(text: str) -> dict[str, frozenset[int]]:
    """Addresses of the bits that instructions of a relinked listing name: SDCC's linker writes them nowhere else."""
    bits: dict[str, frozenset[int]] = {}
    for row in text.splitlines():
        if (code := _RST_BIT.match(row)) and int(code[1], 16) in _BIT_CODES:
            bits[code[3]] = bits.get(code[3], frozenset()) | {int(code[2], 16)}
    return bits


STACK = "__start__stack"


class Symbols:
    """Names of an image. C names carry the compiler's underscore; lookups take them with or without.

    `names`: the names, or a function that reads them, which may raise BadInput. `used`: (first, end) of the addresses
    that the image has bytes for; code anywhere else has no name. Not given: all have. `set_up`: address of the
    instruction of the start-up code that sets SP, and the value, or a function that finds them.
    """

    def __init__(
        self,
        names: dict[str, Symbol] | Callable[[], dict[str, Symbol]],
        used: tuple[tuple[int, int], ...] = (),
        set_up: Callable[[], tuple[int, int] | None] = lambda: None,
    ) -> None:
        self._given = names
        self._used = used
        self._set_up = set_up

    def with_stack(self, start: int) -> Symbols:
        """A copy whose stack reaches from that address of internal RAM to FFh."""
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
        """The symbol of this name; None if there is none. Raises ImageError as `names` does."""
        return self.names.get(name) or self.names.get("_" + name)

    @cached_property
    def stack(self) -> tuple[int, int]:
        """First and last address that the stack may use: from where the linker begins it to the next name above.

        Without a map: from where the start-up code sets it to the top. All of internal RAM where nothing says so. The
        stack grows upwards, and what lies above it is data.
        """
        start = None if self.problem is not None else self.names.get(STACK)
        if start is None or start.space != "iram":
            set_up = self._set_up()
            return (0, 0xFF) if set_up is None else (set_up[1] + 1, 0xFF)
        in_ram = [symbol.address for symbol in self.names.values() if symbol.space == "iram"]
        return start.address, min([*(at for at in in_ram if at > start.address), 0x100]) - 1

    @property
    def stack_source(self) -> str:
        """The instruction that the bounds of the stack come from; "" where they are a map's, or not known."""
        set_up = self._set_up() if self.problem is not None or STACK not in self.names else None
        return "" if set_up is None else f"MOV SP,#{set_up[1]:02X}h at {set_up[0]:#06x}"

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
