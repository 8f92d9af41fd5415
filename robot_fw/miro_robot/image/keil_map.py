"""Parses the map files of Keil's linkers: BL51's `.M51` and LX51's `.MAP`, in one pass.

    LINK MAP / MEMORY MAP      segments: `?PR?NAME?MODULE` is the code of a C function, `?CO?MODULE` constants, `?STACK`
                               the stack, `_DATA_GROUP_` the locals that functions share
    SYMBOL TABLE               names by module, `PROC` or `BLOCK` around locals, `LINE#` without the file

Raisonance's LX51 writes the same records. Neither map has types: a variable is read as the type that the reader gives.
A line's file is its module's object file with `.c` (or `.a51`, where the module has no function): the map has no more.
Sources: Keil, BL51 User's Guide "Listing (MAP) File" and support article 1676; LX51 User's Guide "Listing (MAP) File"
(www.keil.com/support/man/docs/lx51/lx51_ln_mapfile.htm). LX51's symbol table is as remembered of its listings: no file
of it was at hand.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import msgspec

from miro_robot.image.symbol_files import STACK, CodePlace, MapFile, SourceLine, Symbol, read_text

_KEPT = 32
_MOST_COLUMNS = 1000  # linkers write 132
_HEAD = re.compile(r"\s*(?:BL51|LX51|L51)\b.*LINKER/LOCAT[EO]R")
_SEGMENT = re.compile(r"^\s+([A-Z]+)\s+([0-9A-F]{4,8})H(?:\.[0-7])?\s+([0-9A-F]{4,8})H(?:\.([0-7]))?\s+(.+)$")
_SEGMENT_LX51 = re.compile(
    r"^([0-9A-F]{6})H(?:\.[0-7])?\s+([0-9A-F]{6})H(?:\.[0-7])?\s+[0-9A-F]{6}H\S*\s+\S+\s+\S+\s+([A-Z]+)\s+(.+)$"
)
_RECORD = re.compile(r"^\s+(?:([A-Z]):([0-9A-F]{4,8})H(?:\.([0-7]))?|-{7})\s+([A-Z]+#?)\s+(\S.*)$")
_RECORD_LX51 = re.compile(r"^\s+(?:([0-9A-F]{8})H(?:\.([0-7]))?|---)\s+([A-Z]+)\s+(\S+)\s+\S+\s+(\S.*)$")
_LX51_CLASSES = {"00": "DATA", "01": "CODE", "02": "XDATA"}  # the first byte of an address
_OPENS, _CLOSES = ("PROC", "DO", "BLOCK"), ("ENDPROC", "ENDDO", "BLOCKEND")
_SPACES = {
    "C": "code", "I": "iram", "X": "xram", "IDATA": "iram", "XDATA": "xram", "CODE": "code", "CONST": "code"
}  # fmt: skip
_NO_NAME = "_ICE_DUMMY_"  # of the compiler, at 0000h of each module
_LEAST_SFR, _BIT_BYTES = 0x80, 0x20
_LJMP = 0x02


class KeilSegment(msgspec.Struct, frozen=True):
    """`first` to before `end` of a memory, by the linker's word for it: CODE, DATA, IDATA, XDATA, BIT."""

    memory: str
    first: int
    end: int
    name: str


class KeilMap(msgspec.Struct, frozen=True, eq=False):
    """`functions`: name, first, end. `map_file`: names, and where functions begin, as of SDCC's map.
    `variables`: space, first, size and name of globals and statics; the size is up to the next or the segment's end.
    """

    map_file: MapFile
    segments: tuple[KeilSegment, ...]
    lines: tuple[tuple[int, SourceLine], ...]
    functions: tuple[tuple[str, int, int], ...]
    variables: tuple[tuple[str, int, int, str], ...] = ()

    def extents(self, name: str) -> list[tuple[int, int]]:
        """(first, end) of the segments whose names begin so."""
        return [(segment.first, segment.end) for segment in self.segments if segment.name.startswith(name)]

    def misses_start_up(self, code: bytes) -> str:
        """Why the map is not of this image: its reset leads elsewhere than to the start-up code. "" if it may be."""
        target, start_up = code[1] << 8 | code[2], self.extents("?C_C51STARTUP")
        if code[0] != _LJMP or not start_up or any(first <= target < end for first, end in start_up):
            return ""
        return f"the start-up code is at {start_up[0][0]:#06x} here, and the image's reset jumps to {target:#06x}"


_BUILD_FOLDERS = ("objects", "listings", "output", "obj", "list", "lst")


def project_folders(image: Path) -> tuple[Path, ...]:
    """The image's folder, and the project's above where it is a folder of uVision for its output."""
    folder = image.parent
    return (folder, folder.parent) if folder.absolute().name.lower() in _BUILD_FOLDERS else (folder,)


def keil_map_path(image: Path) -> Path | None:
    """The map of an image: of its name, in any case, beside it or in `Listings` or `Objects` of the project."""
    names = (f"{image.stem}.m51".lower(), f"{image.stem}.map".lower())
    for folder in project_folders(image):
        inner = [
            entry for entry in _entries(folder) if entry.name.lower() in _BUILD_FOLDERS and entry.is_dir()
        ]
        for path in [entry for place in (folder, *inner) for entry in _entries(place)]:
            if path.name.lower() in names and path.is_file() and is_keil(read_text(path)):
                return path
    return None


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def is_keil(text: str) -> bool:
    """True if a map is one of these, by its first line."""
    return _HEAD.match(text) is not None


def keil_map(image: Path) -> KeilMap | None:
    """The map of an image, read; None if there is none. Raises InputError for one that is too long."""
    path = keil_map_path(image)
    return None if path is None else parse_keil_map(read_text(path))


class _Reader:
    """Holds what has been read so far. `depth`: how many PROC, DO and BLOCK are open; names within them are locals."""

    NOT_STATE = (  # a reader belongs to no world
        *("files", "segments", "codes", "publics", "statics", "lines", "begun"),
        *("module", "function", "depth", "data"),
    )

    def __init__(self) -> None:
        self.files: dict[str, str] = {}  # of modules, without their endings
        self.segments: list[KeilSegment] = []
        self.codes: list[tuple[int, KeilSegment]] = []  # `?PR?NAME?MODULE`, with their lines of the map
        self.publics: dict[str, Symbol] = {}
        self.statics: dict[str, Symbol] = {}
        self.lines: list[tuple[int, str, int]] = []
        self.begun: dict[tuple[str, str], int] = {}  # module, function: its first line's address
        self.data: dict[
            tuple[str, str, int], str
        ] = {}  # module, space, address -> name; statics of functions, too
        self.module = self.function = ""
        self.depth = 0

    def read(self, number: int, row: str) -> None:
        if record := _RECORD.match(row):
            self.record(record[4], record[5], record[1] or "", record[2], record[3])
        elif record := _RECORD_LX51.match(row):
            memory = record[4] if record[4] != "---" else _LX51_CLASSES.get((record[1] or "")[:2], "")
            self.record(record[3], record[5].lstrip("#"), memory, record[1], record[2])
        elif segment := _SEGMENT.match(row):
            first, size = int(segment[2], 16) & 0xFFFF, int(segment[3], 16) + (segment[4] not in (None, "0"))
            self.segment(number, KeilSegment(segment[1], first, first + size, segment[5].split()[-1]))
        elif segment := _SEGMENT_LX51.match(row):
            first, last = (int(segment[index], 16) & 0xFFFF for index in (1, 2))
            self.segment(number, KeilSegment(segment[3], first, last + 1, segment[4].split()[-1]))
        elif not self.segments and row.endswith(")"):
            path, _, module = row[:-1].rpartition("(")  # `  .\Objects\car.obj (CAR)`
            self.files.setdefault(module, re.split(r"[\\/]", path.strip())[-1].rpartition(".")[0])

    def segment(self, number: int, segment: KeilSegment) -> None:
        self.segments.append(segment)
        if segment.memory == "CODE" and segment.name.startswith("?PR?"):
            self.codes.append((number, segment))

    def record(self, kind: str, name: str, memory: str, digits: str | None, bit: str | None) -> None:
        if kind == "MODULE":
            self.module, self.depth = name, 0
        elif kind in _CLOSES:
            self.depth = max(self.depth - 1, 0)
        elif kind in _OPENS:
            if not self.depth:
                self.function = name
            self.depth += 1
        elif digits is not None and memory:
            self.place(kind, name, memory, int(digits, 16) & 0xFFFF, bit)

    def place(self, kind: str, name: str, memory: str, address: int, bit: str | None) -> None:
        if kind in ("PUBLIC", "SYMBOL") and bit is None and _SPACES.get(memory, "iram") != "code":
            self.data.setdefault((self.module.upper(), _SPACES.get(memory, "iram"), address), name)
        if kind in ("LINE#", "LINE"):
            if name.isdecimal():
                self.lines.append((address, self.module, int(name)))
            if self.depth:
                self.begun.setdefault((self.module, self.function), address)
        elif kind in ("PUBLIC", "SYMBOL", "SFRSYM") and not self.depth and name != _NO_NAME:
            symbol = _symbol(memory, address, bit)
            if symbol is not None:
                (self.publics if kind == "PUBLIC" else self.statics).setdefault(name, symbol)

    def finish(self) -> KeilMap:
        names = self.statics | self.publics
        code = sorted((symbol.address, name) for name, symbol in names.items() if symbol.space == "code")
        placed = [each for each in (self.function_in(*each, code) for each in self.codes) if each is not None]
        for place, _ in placed:
            names.setdefault(place.name, Symbol(place.address, "code"))
        begun = {symbol.address for symbol in names.values() if symbol.space == "code"}
        for segment in self.segments:
            if segment.memory == "CODE" and "?" in segment.name and segment.first not in begun:
                names.setdefault(segment.name, Symbol(segment.first, "code"))  # of a library, of constants
            if segment.memory == "IDATA" and segment.name in ("?STACK", "_STACK"):
                begin = segment.first + (segment.name == "_STACK")  # Raisonance's is what SP is set to
                if begin <= 0xFF:  # what lies beyond is damage
                    names[STACK] = Symbol(begin, "iram")
        in_c = {place.area.rpartition("?")[2].upper() for place, _ in placed}
        lines = [
            (
                address,
                SourceLine(self.files.get(name, name) + (".c" if name.upper() in in_c else ".a51"), line),
            )
            for address, name, line in self.lines
        ]
        places = sorted((place for place, _ in placed), key=lambda place: place.address)
        functions = tuple((place.name, place.address, end) for place, end in placed)
        map_file = MapFile(names, tuple(places), ())
        return KeilMap(map_file, tuple(self.segments), tuple(lines), functions, tuple(self.variables()))

    def variables(self) -> Iterator[tuple[str, int, int, str]]:
        for segment in self.segments:
            kind, _, module = segment.name.removeprefix("?").partition("?")
            space = {"DT": "iram", "ID": "iram", "XD": "xram"}.get(kind)
            if space is not None and "?" not in module:
                known = [key[2] for key in self.data if key[:2] == (module, space)]
                begins = sorted(at for at in known if segment.first <= at < segment.end)
                for first, end in pairwise([*begins, segment.end]):
                    yield space, first, end - first, self.data[module, space, first]

    def function_in(
        self, number: int, segment: KeilSegment, code: list[tuple[int, str]]
    ) -> tuple[CodePlace, int] | None:
        """A segment's function, and the address after its end; None for assembler code, which has labels.

        Its name is written there in capitals. The optimizer may put code (`L?0038`) in front of it.
        """
        function, _, module = segment.name.removeprefix("?PR?").rpartition("?")
        begin, end = (bisect.bisect_left(code, (address,)) for address in (segment.first, segment.end))
        inside = [(at, name) for at, name in code[begin:end] if "?" not in name]
        unnamed = () if inside else ((self.begun.get((module, function), segment.first), function),)
        own = next(
            (candidate for candidate in (*inside, *unnamed) if candidate[1].upper() == function.upper()), None
        )
        return None if own is None else (CodePlace(segment.name, own[1], own[0], number), segment.end)


def _symbol(memory: str, address: int, bit: str | None) -> Symbol | None:
    """DATA from 80h on is SFRs, bits `BYTE.BIT` are numbered by their own addresses; None for numbers (`N:`)."""
    if bit is not None:
        base = address if address >= _LEAST_SFR else (address - _BIT_BYTES) * 8
        return Symbol(base + int(bit), "bit") if base >= 0 else None
    if memory in ("B", "BIT"):
        return Symbol(address, "bit")
    if memory in ("D", "DATA"):
        return Symbol(address, "sfr" if address >= _LEAST_SFR else "iram")
    space = _SPACES.get(memory)
    return None if space is None else Symbol(address, space)


@lru_cache(_KEPT)
def parse_keil_map(text: str) -> KeilMap:
    """A map's text; lines that are damaged are left out."""
    reader = _Reader()
    for number, row in enumerate(text.splitlines(), start=1):
        if len(row) < _MOST_COLUMNS:
            reader.read(number, row.rstrip())
    return reader.finish()
