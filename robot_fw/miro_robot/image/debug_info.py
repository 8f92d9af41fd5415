"""The debug information of an image: the C line of each instruction, and the functions.

An image without these files has an empty DebugInfo: everything works by address then.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from miro_robot.image.hex import Image, ImageError
from miro_robot.image.keil_map import keil_map, keil_map_path
from miro_robot.image.symbol_files import (
    CdbFile,
    SourceLine,
    map_constants,
    map_modules,
    parse_cdb,
    parse_listing,
    read_text,
)
from miro_robot.mcs51.opcodes import LENGTH


class Function(msgspec.Struct, frozen=True):
    """A C function: its symbol, `first` to before `end`, and its first line (None if it has none)."""

    name: str
    first: int
    end: int
    line: SourceLine | None


class DebugInfo:
    """Lines and functions of one image. `lines`: (address, line) of each place where a line's code begins, by address.
    `constants`: (first, end) of code memory that holds tables instead of instructions. `symbols`: places where
    something with a name begins, and so the line before it ends.
    """

    def __init__(
        self,
        lines: Iterable[tuple[int, SourceLine]] = (),
        functions: Iterable[Function] = (),
        constants: Iterable[tuple[int, int]] = (),
        symbols: Iterable[int] = (),
    ) -> None:
        last_of_place = dict(lines)  # two lines at one place: the later one owns the code
        self.lines = sorted(last_of_place.items())
        self.functions = sorted(functions, key=lambda function: function.first)
        self.constants = tuple(constants)
        self._symbols = sorted(symbols)
        self._starts = [address for address, _ in self.lines]
        self._function_starts = [function.first for function in self.functions]

    @classmethod
    def of(cls, image: Image) -> DebugInfo:
        """From the files beside the image; what is missing contributes nothing.

        Raises ImageError for a listing whose bytes are not the image's.
        """
        cdb = parse_cdb(read_text(image.path.with_suffix(".cdb")))
        link_map = read_text(image.path.with_suffix(".map"))
        listed = [row for path in listings(image.path, link_map) for row in _read_listing(path, image)]
        lines = [(address, line) for address, _, line in listed if line is not None]
        tables = [(address, end) for address, end, line in listed if line is None]
        known = {_name(line.file) for _, line in lines}
        lines += [(address, line) for address, line in cdb.lines if _name(line.file) not in known]
        paths = {_name(line.file): line.file for _, line in lines}
        symbols = [symbol.address for symbol in image.symbols.names.values() if symbol.space == "code"]
        functions = [*_cdb_functions(cdb, image.code, paths)]
        keil = None if lines or functions else keil_map(image.path)
        if keil is not None:
            lines = [*keil.lines]
            first = dict(reversed(lines))
            functions = [Function(name, at, end, first.get(at)) for name, at, end in keil.functions]
            tables += [*keil.extents("?CO?"), *keil.extents("?C_INITSEG")]
        return cls(lines, functions, [*map_constants(link_map), *tables], symbols)

    def line_at(self, address: int) -> SourceLine | None:
        """The source line of the instruction there; None outside C functions."""
        index = bisect.bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        start, line = self.lines[index]
        if bisect.bisect_right(self._symbols, address) > bisect.bisect_right(self._symbols, start):
            return None
        if self.functions:
            function = self.function_at(address)
            if function is None or start < function.first:
                return None
        return line

    def function_at(self, address: int) -> Function | None:
        index = bisect.bisect_right(self._function_starts, address) - 1
        if index < 0 or address >= self.functions[index].end:
            return None
        return self.functions[index]

    def is_constant(self, address: int) -> bool:
        return any(first <= address < end for first, end in self.constants)

    def __repr__(self) -> str:
        return f"DebugInfo({len(self.lines)} places of lines, {len(self.functions)} functions)"


class Sources:
    """Finds the compiler's source files in `folders`, in this order, and nowhere else.

    A debug file may come from an untrusted source, and the files it names may appear in a page that is sent on. So only
    regular files inside these folders, with links resolved, are found. For an absolute path outside only the name is
    searched.
    """

    def __init__(self, folders: Iterable[Path]) -> None:
        self.folders = tuple(folders)
        self._found: dict[str, Path | None] = {}

    def path(self, file: str) -> Path | None:
        """The file, or None where no folder has it."""
        if file not in self._found:
            names = dict.fromkeys((file, _name(file)))
            places = (_inside(folder, name) for name in names for folder in self.folders)
            self._found[file] = next((path for path in places if path is not None), None)
        return self._found[file]

    def text(self, line: SourceLine) -> str:
        """The text of that line; "" if the file is missing or shorter."""
        path = self.path(line.file)
        lines = [] if path is None else read_text(path).splitlines()
        return lines[line.line - 1].strip() if 0 < line.line <= len(lines) else ""


def _cdb_functions(cdb: CdbFile, code: bytes, paths: dict[str, str]) -> Iterator[Function]:
    """From begin and end records; the end record stands at the returning instruction. `paths`: files as lines have
    them, by the names alone that the .cdb has.
    """
    declared: dict[int, SourceLine] = {}
    for address, line in cdb.lines:  # the first line at a function's first place is its head
        declared.setdefault(address, SourceLine(paths.get(line.file, line.file), line.line))
    for scope, last in cdb.ends:
        first = cdb.begins.get(scope)
        if first is not None and first <= last < len(code):
            end = last + LENGTH[code[last]]
            yield Function("_" + scope[1], first, end, declared.get(first))


def _inside(folder: Path, file: str) -> Path | None:
    """The regular file of that name in the folder; None where there is none, or it lies elsewhere."""
    try:
        path = (folder / file).resolve()
        if not path.exists() and "/" not in file:  # Windows' linkers write names in another case
            path = next(
                (entry.resolve() for entry in folder.iterdir() if entry.name.lower() == file.lower()), path
            )
        there = path.is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError, RuntimeError):  # a name that is too long, or has a NUL; a circle of links
        return None
    return folder / path.relative_to(folder.resolve()) if there else None


def _name(path: str) -> str:
    return path.replace("\\", "/").rpartition("/")[2]


def listings(image: Path, link_map: str) -> Iterator[Path]:
    """The relinked listings of the image's modules: beside the image, or where the linker found the modules."""
    for module in dict.fromkeys([*map_modules(link_map), image.stem]):
        ways = ((image.parent, _name(module)), (image.parent, module), (Path(), module))
        places = (_inside(folder, f"{name}.rst") for folder, name in ways)
        listing = next((path for path in places if path is not None), None)
        if listing is not None:
            yield listing


NAMES = (".map", ".cdb")
"""Files beside an image that the linker writes for it; the listings are the compiler's, one a module."""


def debug_files(image: Path, stem: str) -> dict[str, Path]:
    """All files that name things in an image, by the names under which they belong to a copy of it, `stem`.ihx."""
    files = {f"{stem}{suffix}": image.with_suffix(suffix) for suffix in NAMES}
    link_map = read_text(image.with_suffix(".map"))
    modules = set(map(_name, map_modules(link_map)))
    for path in listings(image, link_map):
        files[path.name if path.stem in modules else f"{stem}.rst"] = path
    files = {name: path for name, path in files.items() if path.is_file()}
    keil = None if files else keil_map_path(image)
    return files if keil is None else {f"{stem}.m51": keil}


def _read_listing(path: Path, image: Image) -> Iterator[tuple[int, int, SourceLine | None]]:
    """(address, end, line) of the first code of each line, a comment above it names that; line None for tables.

    Only instructions have a number of clocks. Raises ImageError where a byte is not the image's.
    """
    last = None
    for code in parse_listing(read_text(path)):
        end = code.address + len(code.data)
        if image.code[code.address : end] != code.data:
            reason = f"is the listing of another image: {code.address:#06x} holds something else"
            raise ImageError(path, code.number, reason, "build both again, or remove the listing")
        if not code.timed:
            yield code.address, end, None
        elif code.line is not None and code.line is not last:
            yield code.address, end, code.line
            last = code.line
