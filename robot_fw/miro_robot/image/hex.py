"""The firmware image: an Intel HEX file.

What belongs here: reading one, with errors a firmware author can act on. What does not: the names beside it
(`symbols.py`), and whether the image runs, which is the CPU's matter.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_robot.image.evidence import check_cdb, check_map
from miro_robot.image.symbols import Symbols

FLASH_BYTES = 8192  # of an AT89C52
SPACE_BYTES = 0x10000
_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)  # record types
_REBUILD = "rebuild the image, or copy it again in full"


class ImageError(BadInput):
    """An image that cannot be used: file, line (0: the whole file), what, remedy."""


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
