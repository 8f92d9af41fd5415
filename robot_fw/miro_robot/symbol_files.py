"""Whether the `.map` and `.cdb` beside an image were written with it, or belong to another one.

What belongs here: evidence, and how much of it is enough. Reading names out of these files is `image.py`'s.

A file that is only unusual must pass: images are filled up, merged with a boot loader, cut apart; symbols are
absolute, mark the end of an area, or name data that has no bytes. So a file is refused on contradictions alone:
* SDCC's start-up code jumps to `_main`, and the file has `_main` elsewhere (one displaced byte is enough for that);
* the image has no byte at more than half of the places that the file names;
* after more than a quarter of the instructions that the file lists (`L:A$` records) the next one does not follow in the
  image. Where both belong together that happens in front of data and at the end of an area: 5 of 1165 in the robot's.
"""

from __future__ import annotations

import re

import msgspec

from miro_robot.mcs51.opcodes import LENGTH

_AREA = re.compile(r"^(\S[\S .]*?)\s+([0-9A-F]{8})\s+([0-9A-F]{8}) = .*bytes \(([A-Z,]+)\)")
_NAME = re.compile(r"^(?:C:)?\s+([0-9A-F]{8})\s+(_\w+)\s")
_LINE_RECORD = re.compile(r"^L:A\$[^:]*:([0-9A-F]+)\s*$")
_FEW_RECORDS, _FEW_NAMES = 20, 4  # fewer prove nothing
_JUMPS = (0x02, 0x12)  # LJMP, LCALL
_SPACE = 0x10000


class Contradiction(msgspec.Struct, frozen=True):
    """Line of the symbol file (from 1), and what is wrong with it."""

    line: int
    reason: str


class _Place(msgspec.Struct, frozen=True):
    name: str
    address: int
    line: int


def check_map(text: str, code: bytes, loaded: bytes) -> Contradiction | None:
    """A map against an image. `code`: 64 KB; `loaded`: 1 for each address that the image has a byte for."""
    places = _code_places(text)
    return _check_start_up(places, code, loaded) or _check_places(places, loaded)


def check_cdb(text: str, code: bytes, loaded: bytes) -> Contradiction | None:
    """The same for a debug file."""
    records = _instructions(text)
    if len(records) < _FEW_RECORDS:
        return None
    misfits = []
    for index, (address, line) in enumerate(records):
        end = address + LENGTH[code[address]]
        following = records[index + 1][0] if index + 1 < len(records) else end
        if not loaded[address] or end != following:
            misfits.append((address, line))
    if 4 * len(misfits) <= len(records):
        return None
    address, line = misfits[0]
    return Contradiction(
        line,
        f"{len(misfits)} of its {len(records)} instructions are not in the image, the first at {address:#06x}",
    )


def _code_places(text: str) -> list[_Place]:
    """Names inside relocatable code areas that have a size; a name at the end of its area marks the end."""
    places = []
    first = end = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if area := _AREA.match(line):
            attributes = area[4].split(",")
            first = int(area[2], 16)
            end = first + int(area[3], 16) if "CODE" in attributes and "REL" in attributes else 0
        elif (name := _NAME.match(line)) and first <= int(name[1], 16) < min(end, _SPACE):
            places.append(_Place(name[2], int(name[1], 16), number))
    return places


def _check_start_up(places: list[_Place], code: bytes, loaded: bytes) -> Contradiction | None:
    by_name = {place.name: place for place in places}
    start_up, main = by_name.get("__sdcc_program_startup"), by_name.get("_main")
    if start_up is None or main is None or not all(loaded[start_up.address : start_up.address + 3]):
        return None
    opcode, high, low = (code[(start_up.address + offset) % _SPACE] for offset in range(3))
    target = high << 8 | low
    if opcode not in _JUMPS or target == main.address:
        return None
    return Contradiction(
        main.line,
        f"_main is at {main.address:#06x} here, and the image's start-up code jumps to {target:#06x}",
    )


def _check_places(places: list[_Place], loaded: bytes) -> Contradiction | None:
    missing = [place for place in places if not loaded[place.address]]
    if len(places) < _FEW_NAMES or 2 * len(missing) <= len(places):
        return None
    first = missing[0]
    where = f"{first.name} ({first.address:#06x})"
    count = f"{len(missing)} of {len(places)} code symbols"
    return Contradiction(first.line, f"the image has no bytes for {count}, the first is {where}")


def _instructions(text: str) -> list[tuple[int, int]]:
    """(address, line of the file) of every assembler line in the 64 KB space, by address, each address once."""
    found: dict[int, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if (record := _LINE_RECORD.match(line)) and int(record[1], 16) < _SPACE:
            found.setdefault(int(record[1], 16), number)
    return sorted(found.items())
