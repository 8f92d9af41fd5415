"""The firmware image: an Intel HEX file and, beside it, what the linker said about its symbols.

What belongs here: reading both, with errors a firmware author can act on. Whether an image runs is the
CPU's matter; which symbols are looked for is the board's.
"""

from __future__ import annotations

import bisect
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec

from miro_robot.symbol_files import check_cdb, check_map

FLASH_BYTES = 8192  # of an AT89C52
SPACE_BYTES = 0x10000
_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)  # record types
_REBUILD = "rebuild the image, or copy it again in full"


class ImageError(ValueError):
    """An image that cannot be used: which file, which line (0: the whole file), why, and what to do."""

    def __init__(self, path: Path, line: int, reason: str, remedy: str) -> None:
        self.path = path
        self.line = line
        self.reason = reason
        self.remedy = remedy
        place = f"{path}:{line}" if line else str(path)
        super().__init__(f"{place}: {reason}; {remedy}")


class Symbol(msgspec.Struct, frozen=True):
    """Where the linker put a name; `space` is code, iram, xram, sfr or bit."""

    address: int
    space: str


class Symbols:
    """Names of an image. C names carry the compiler's underscore; lookups take them with or without."""

    def __init__(self, names: dict[str, Symbol]) -> None:
        self.names = names
        code = sorted((symbol.address, name) for name, symbol in names.items() if symbol.space == "code")
        self._code_addresses = [address for address, _ in code]
        self._code_names = [name for _, name in code]

    @classmethod
    def from_beside(cls, path: Path) -> Symbols:
        """From the `.map` and `.cdb` beside an image; what is missing contributes nothing."""
        names: dict[str, Symbol] = {}
        for suffix, read in ((".map", _read_map), (".cdb", _read_cdb)):
            beside = path.with_suffix(suffix)
            if beside.is_file():
                names.update(read(beside.read_text(encoding="utf-8", errors="replace")))
        return cls(names)

    def find(self, name: str) -> Symbol | None:
        return self.names.get(name) or self.names.get("_" + name)

    def name_at(self, address: int) -> str:
        """The last code symbol at or before `address`, "" if there is none."""
        index = bisect.bisect_right(self._code_addresses, address)
        return self._code_names[index - 1] if index else ""

    def __repr__(self) -> str:
        return f"Symbols({len(self.names)} names, {len(self._code_names)} in code)"


class Image(msgspec.Struct, frozen=True):
    """A loaded image.

    `code`: 64 KB, FF where nothing was loaded; `used`: (first, end) ranges of loaded addresses, ascending;
    `size`: bytes loaded; `sha256`: hex digest of the file.
    """

    path: Path
    code: bytes
    used: tuple[tuple[int, int], ...]
    size: int
    sha256: str
    symbols: Symbols

    def __repr__(self) -> str:
        return f"Image({self.path.name!r}, {self.size} bytes, sha256={self.sha256[:12]})"


def load_hex(path: str | Path, limit: int = FLASH_BYTES) -> Image:
    """Reads an Intel HEX file whose bytes all lie below `limit`. Raises ImageError."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise ImageError(path, 0, "there is no such file", "build the firmware first") from None
    except OSError as error:
        raise ImageError(path, 0, f"cannot be read ({error.strerror})", "name a readable file") from None
    return parse_hex(content, path, limit)


def parse_hex(content: bytes, path: Path, limit: int = FLASH_BYTES) -> Image:
    """The same from the file's content; `path` is for messages and symbols."""
    if not content.strip():
        raise ImageError(path, 0, "is empty", _REBUILD)
    code = bytearray(b"\xff" * SPACE_BYTES)
    loaded = bytearray(SPACE_BYTES)
    for line, address, data in _data_records(content, path):
        end = address + len(data)
        if end > limit:
            first = max(address, limit)
            raise ImageError(path, line, f"byte at {first:#06x} does not fit {limit} bytes", _too_big(limit))
        if any(loaded[address:end]):
            first = address + loaded[address:end].index(1)
            raise ImageError(path, line, f"{first:#06x} is loaded a second time", "link without overlaps")
        code[address:end] = data
        loaded[address:end] = b"\x01" * len(data)
    if not any(loaded):
        raise ImageError(path, 0, "holds no bytes", _REBUILD)
    _check_beside(path, bytes(code), bytes(loaded))
    return Image(
        path=path,
        code=bytes(code),
        used=_ranges(loaded),
        size=loaded.count(1),
        sha256=hashlib.sha256(content).hexdigest(),
        symbols=Symbols.from_beside(path),
    )


def _check_beside(path: Path, code: bytes, loaded: bytes) -> None:
    """Raises ImageError when a symbol file beside the image contradicts it."""
    for suffix, check in ((".map", check_map), (".cdb", check_cdb)):
        beside = path.with_suffix(suffix)
        if beside.is_file():
            found = check(beside.read_text(encoding="utf-8", errors="replace"), code, loaded)
            if found is not None:
                remedy = "it belongs to another image: rebuild both together, or take it away"
                raise ImageError(beside, found.line, found.reason, remedy)


def _too_big(limit: int) -> str:
    if limit == FLASH_BYTES:
        return "the AT89C52 has 8 KB of flash (0x0000-0x1fff): shrink the code or link it lower"
    return "link it lower"


def _ranges(loaded: bytearray) -> tuple[tuple[int, int], ...]:
    return tuple((match.start(), match.end()) for match in re.finditer(b"\x01+", bytes(loaded)))


def _data_records(content: bytes, path: Path) -> Iterator[tuple[int, int, bytes]]:
    """(line number, address, bytes) of each data record; checks everything that is not about the address."""
    base = 0
    ended = False
    for number, raw in enumerate(content.splitlines(), start=1):
        text = raw.strip()
        if not text:
            continue
        if ended:
            raise ImageError(path, number, "goes on after its end record", _REBUILD)
        address, kind, data = _record(text, path, number)
        if kind == _DATA:
            yield number, base + address, data
        elif kind == _END:
            ended = True
        elif kind in (_SEGMENT, _LINEAR):
            if len(data) != 2:
                raise ImageError(path, number, "extended address record needs 2 bytes", _REBUILD)
            base = int.from_bytes(data, "big") << (4 if kind == _SEGMENT else 16)
        elif kind not in (_START_SEGMENT, _START_LINEAR):  # start addresses mean nothing to an 8051
            raise ImageError(path, number, f"unknown record type {kind:02X}", _REBUILD)
    if not ended:
        raise ImageError(path, 0, "is truncated: it has no end record (:00000001FF)", _REBUILD)


def _record(text: bytes, path: Path, number: int) -> tuple[int, int, bytes]:
    """One line, taken apart and checked: address, type, data."""
    if text[:1] != b":":
        raise ImageError(
            path, number, "is not Intel HEX: a record begins with ':'", "give an .ihx or .hex file"
        )
    try:
        record = bytes.fromhex(text[1:].decode("ascii"))
    except ValueError:
        raise ImageError(path, number, "bad record: not pairs of hex digits", _REBUILD) from None
    if len(record) < 5 or len(record) != record[0] + 5:
        declared = record[0] if record else 0
        reason = f"bad record: {max(len(record) - 5, 0)} data bytes where {declared} are declared"
        raise ImageError(path, number, reason, _REBUILD)
    if sum(record) & 0xFF:
        expected = -sum(record[:-1]) & 0xFF
        raise ImageError(path, number, f"bad checksum {record[-1]:02X}, expected {expected:02X}", _REBUILD)
    return int.from_bytes(record[1:3], "big"), record[3], record[4:-1]


_MAP_AREA = re.compile(r"^(\S[\S .]*?)\s+[0-9A-F]{8}\s+[0-9A-F]{8} = .*bytes \(([A-Z,]+)\)")
_MAP_NAME = re.compile(r"^(?:[CDB]:)?\s+([0-9A-F]{8})\s+(_\w+)\s")


def _read_map(text: str) -> dict[str, Symbol]:
    """Globals of an SDCC (ASxxxx) map file; the area a page is headed with tells the space."""
    names = {}
    space = ""
    for line in text.splitlines():
        area = _MAP_AREA.match(line)
        if area:
            space = _map_space(area[1], area[2].split(","))
        name = _MAP_NAME.match(line)
        if name and space:
            names[name[2]] = Symbol(int(name[1], 16), space)
    return names


def _map_space(area: str, attributes: list[str]) -> str:
    for attribute, space in (("CODE", "code"), ("XDATA", "xram"), ("BIT", "bit")):
        if attribute in attributes:
            return space
    return "sfr" if "ABS" in area else "iram"


_CDB_SPACES = {
    "C": "code",
    "D": "code",
    "E": "iram",
    "G": "iram",
    "F": "xram",
    "H": "bit",
    "I": "sfr",
    "J": "bit",
}
_CDB_SYMBOL = re.compile(r"^S:((?:G|F\w+)\$(\w+)\$\w+\$\w+)\(.*\),([A-Z]),")
_CDB_ADDRESS = re.compile(r"^L:((?:G|F\w+)\$\w+\$\w+\$\w+):([0-9A-F]{1,8})$")


def _read_cdb(text: str) -> dict[str, Symbol]:
    """Globals and file statics of an SDCC debug file, which also tells SFRs from SFR bits."""
    spaces = {}
    names = {}
    for line in text.splitlines():
        symbol = _CDB_SYMBOL.match(line)
        if symbol and symbol[3] in _CDB_SPACES:
            spaces[_scope(symbol[1])] = _CDB_SPACES[symbol[3]]
        address = _CDB_ADDRESS.match(line)
        if address and _scope(address[1]) in spaces:
            scope, name = _scope(address[1])
            names["_" + name] = Symbol(int(address[2], 16), spaces[scope, name])
    return names


def _scope(qualified: str) -> tuple[str, str]:
    """`G$main$0_0$0` and its link record `G$main$0$0` alike: (scope, name)."""
    scope, name = qualified.split("$")[:2]
    return scope, name
