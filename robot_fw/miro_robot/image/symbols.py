"""Names of an image: what the linker wrote into the `.map` and `.cdb` beside it.

What belongs here: reading both files into names with addresses. What does not: whether they belong to the image
(`evidence.py`), and C lines and functions (`debug_info.py`).
"""

from __future__ import annotations

import bisect
import re
from pathlib import Path

import msgspec


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
