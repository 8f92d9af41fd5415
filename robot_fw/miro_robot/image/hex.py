"""The firmware image: an Intel HEX file."""

from __future__ import annotations

import hashlib
import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from functools import lru_cache, partial
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.inputs import IMAGE_BYTES, decode, read_input
from miro_robot.image.evidence import Contradiction, check_cdb, check_map
from miro_robot.image.keil_map import keil_map, keil_map_path
from miro_robot.image.start_up import stack_set_up
from miro_robot.image.symbol_files import Symbol, Symbols, parse_cdb, parse_map, read_text

FLASH_BYTES = 8192  # of an AT89C52
_WITH_FLASH = {4096: "AT89C51", FLASH_BYTES: "AT89C52"}
SPACE_BYTES = 0x10000
_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)  # record types
_BLANK = b" \t\r\n\v\f\0\x1a"
_DIGITS = re.compile(rb".{0,2}[0-9A-Fa-f]{8,}")
"""A record whose first character is another, or is missing."""
_GIVE = "build it, or give the path of an .ihx or .hex file"
_REBUILD = "rebuild the image, or copy it again in full"


class ImageError(BadInput):
    """An image that cannot be used: file, line (0: the whole file), what, remedy."""


class Image(msgspec.Struct, frozen=True):
    """A loaded image.

    `code`: 64 KB, FF where nothing was loaded; `used`: (first, end) ranges of loaded addresses, ascending;
    `size`: bytes loaded; `sha256`: hex digest of the file; `symbols`: read from the files beside it when the first
    one is asked for; `content`: of the file, or of all files that were merged.
    """

    path: Path
    code: bytes
    used: tuple[tuple[int, int], ...]
    size: int
    sha256: str
    symbols: Symbols
    content: bytes = b""

    def merged(self, other: Image) -> Image:
        """Both as one program, called as this one. Raises ImageError where both have a byte at the same address."""
        mine, theirs = ({at for span in image.used for at in range(*span)} for image in (self, other))
        both = mine & theirs
        if both:
            problem = f"has a byte at {min(both):#06x}, as {self.path.name} has"
            raise ImageError(other.path, 0, problem, "link one of them elsewhere")
        code, loaded = bytearray(self.code), bytearray(SPACE_BYTES)
        for first, end in other.used:
            code[first:end] = other.code[first:end]
        for address in mine | theirs:
            loaded[address] = 1
        used = _ranges(loaded)
        names = Symbols(lambda: {**other.symbols.names, **self.symbols.names}, used)
        sha256 = hashlib.sha256(f"{self.sha256} {other.sha256}".encode()).hexdigest()
        content = self.content + other.content
        return Image(self.path, bytes(code), used, self.size + other.size, sha256, names, content)

    def code_address(self, name: str, path: str | Path = "", place: str = "") -> int:
        """Address of a code symbol, with or without the underscore that C puts before it.

        Raises BadInput with similar names. `path`, `place`: source of the name, for errors; default: the image.
        """
        for known in (name, name.removeprefix("_")):
            symbol = self.symbols.find(known)
            if symbol is not None and symbol.space == "code":
                return symbol.address
        code = [label for label, symbol in self.symbols.names.items() if symbol.space == "code"]
        names = code if name.startswith("_") else [label.removeprefix("_") for label in code]
        otherwise = (
            "see the map beside the image"
            if names
            else "put its .map or .cdb beside it, or give an address as 0x.."
        )
        remedy = did_you_mean(name, names) or otherwise
        raise BadInput(path or self.path, place, f"no symbol {name} in the code", remedy)

    def __repr__(self) -> str:
        return f"Image({self.path.name!r}, {self.size} bytes, sha256={self.sha256[:12]})"


def load_hex(path: str | Path, limit: int = FLASH_BYTES) -> Image:
    """Reads an Intel HEX file whose bytes all lie below `limit`. Raises ImageError."""
    path = Path(path)
    with ImageError.at(path):
        try:
            content = read_input(path, IMAGE_BYTES)
        except FileNotFoundError:
            raise ImageError(path, 0, "there is no such file", _GIVE) from None
        except OSError as error:
            raise ImageError(path, 0, f"cannot be read ({error.strerror})", "name a readable file") from None
    return parse_hex(content, path, limit)


def parse_hex(
    content: bytes, path: Path, limit: int = FLASH_BYTES, names: dict[str, tuple[int, str]] | None = None
) -> Image:
    """Parses the content of an Intel HEX file; `path` is for messages and symbols. Raises ImageError.

    `names`: address and space of each name, instead of the files beside `path`.
    """
    with ImageError.at(path):
        known, _ = _parsed(content, limit)
    if names is None:
        beside = partial(_names_beside, path, content, limit)
        symbols = Symbols(beside, known.used, partial(stack_set_up, known.code, known.used))
    else:
        given = {name: Symbol(*place) for name, place in names.items()}
        symbols = Symbols(given, known.used, partial(stack_set_up, known.code, known.used))
    return msgspec.structs.replace(known, path=path, symbols=symbols)


@lru_cache(32)  # by content: a test loads the robot's image hundreds of times
def _parsed(content: bytes, limit: int) -> tuple[Image, bytes]:
    """The image from a file's content alone, and 1 for each address with a byte in it."""
    records = _as_bytes(content)
    if not records.strip(_BLANK):
        raise ImageError("", 0, "is empty", _REBUILD)
    code = bytearray(b"\xff" * SPACE_BYTES)
    loaded = bytearray(SPACE_BYTES)
    for line, address, data in _data_records(records):
        end = address + len(data)
        if end > limit:
            first = max(address, limit)
            raise ImageError("", line, f"byte at {first:#06x} does not fit {limit} bytes", _too_big(limit))
        if any(loaded[address:end]):
            first = address + loaded[address:end].index(1)
            raise ImageError("", line, f"{first:#06x} is loaded a second time", "link without overlaps")
        code[address:end] = data
        loaded[address:end] = b"\x01" * len(data)
    if not any(loaded):
        raise ImageError("", 0, "holds no bytes", _REBUILD)
    used, sha256 = _ranges(loaded), hashlib.sha256(content).hexdigest()
    image = Image(Path(), bytes(code), used, loaded.count(1), sha256, Symbols({}), content)
    return image, bytes(loaded)


def _as_bytes(content: bytes) -> bytes:
    """The records without a byte-order mark, a byte a character where an editor saved them as UTF-16."""
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return decode(content).encode("latin-1", "replace")
    return content.removeprefix(BOM_UTF8)


def _names_beside(path: Path, content: bytes, limit: int) -> dict[str, Symbol]:
    """The names in the `.map` and `.cdb` beside an image; what is missing contributes nothing.

    Raises ImageError when one of them contradicts the image.
    """
    known, loaded = _parsed(content, limit)
    map_path, cdb_path = path.with_suffix(".map"), path.with_suffix(".cdb")
    found_map, found_cdb = parse_map(read_text(map_path)), parse_cdb(read_text(cdb_path))
    _refuse(map_path, check_map(found_map, known.code, loaded))
    _refuse(cdb_path, check_cdb(found_cdb, known.code, loaded))
    keil = None if found_map.names or found_cdb.names else keil_map(path)
    if keil is None:
        return found_map.names | found_cdb.names
    keil_path = keil_map_path(path) or map_path
    reason = keil.misses_start_up(known.code)
    _refuse(keil_path, Contradiction(0, reason) if reason else None)
    _refuse(keil_path, check_map(keil.map_file, known.code, loaded))
    return keil.map_file.names


def _refuse(beside: Path, contradiction: Contradiction | None) -> None:
    if contradiction is not None:
        remedy = "it belongs to another image: rebuild both together, or take it away"
        raise ImageError(beside, contradiction.line, contradiction.reason, remedy)


def _too_big(limit: int) -> str:
    if limit in _WITH_FLASH:
        flash = f"{limit >> 10} KB of flash (0x0000-{limit - 1:#06x})"
        return f"the {_WITH_FLASH[limit]} has {flash}: shrink the code or link it lower"
    return "link it lower"


def _ranges(loaded: bytearray) -> tuple[tuple[int, int], ...]:
    return tuple((match.start(), match.end()) for match in re.finditer(b"\x01+", bytes(loaded)))


def _data_records(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    """(line number, address, bytes) of each data record; checks everything that is not about the address.

    What other programs read is read: a byte-order mark, the 1Ah with which old ones end a text, comments, and text
    after the end record. A record that lost its colon is no comment, and data after the end record are lost data.
    """
    base = 0
    begun = ended = False
    for number, raw in enumerate(content.splitlines(), start=1):
        text = raw.strip(_BLANK)
        if ended:
            _refuse_data(text, number)
            continue
        if not text or not (text.startswith(b":") or _DIGITS.fullmatch(text)):  # a comment
            continue
        begun = True
        address, kind, data = _record(text, number)
        if kind == _DATA:
            yield number, base + address, data
        elif kind == _END:
            ended = True
        elif kind in (_SEGMENT, _LINEAR):
            if len(data) != 2:
                raise ImageError("", number, "extended address record needs 2 bytes", _REBUILD)
            base = int.from_bytes(data, "big") << (4 if kind == _SEGMENT else 16)
        elif kind not in (_START_SEGMENT, _START_LINEAR):  # start addresses mean nothing to an 8051
            raise ImageError("", number, f"unknown record type {kind:02X}", _REBUILD)
    if not begun:
        reason = "is not Intel HEX: no line begins with ':'"
        raise ImageError("", 1, reason, "give an .ihx or .hex file")
    if not ended:
        raise ImageError("", 0, "is truncated: it has no end record (:00000001FF)", _REBUILD)


def _refuse_data(text: bytes, number: int) -> None:
    """Raises ImageError for a record with data behind the end record; all else there is text."""
    try:
        _, kind, data = _record(text, number)
    except ImageError:
        return
    if kind == _DATA and data:
        raise ImageError("", number, "has more records after its end record", _REBUILD)


def _record(text: bytes, number: int) -> tuple[int, int, bytes]:
    """One line, taken apart and checked: address, type, data."""
    if text[:1] != b":":
        reason = "is not Intel HEX: a record begins with ':'"
        raise ImageError("", number, reason, "give an .ihx or .hex file, copied in full")
    try:
        record = bytes.fromhex(text[1:].decode("ascii"))
    except ValueError:
        raise ImageError("", number, "bad record: not pairs of hex digits", _REBUILD) from None
    if len(record) < 5 or len(record) != record[0] + 5:
        declared = record[0] if record else 0
        reason = f"bad record: {max(len(record) - 5, 0)} data bytes where {declared} are declared"
        raise ImageError("", number, reason, _REBUILD)
    if sum(record) & 0xFF:
        expected = -sum(record[:-1]) & 0xFF
        raise ImageError("", number, f"bad checksum {record[-1]:02X}, expected {expected:02X}", _REBUILD)
    return int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
