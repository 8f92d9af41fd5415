"""Checks that the `.map` and `.cdb` beside an image belong to it and not to another one.

A file that is only unusual must pass: images are filled up, merged with a boot loader, cut apart; symbols are
absolute, mark the end of an area, or name data that has no bytes. So a file is refused on contradictions alone:
* SDCC's start-up code jumps to `_main`, and the file has `_main` elsewhere (one displaced byte is enough for that);
* the image has no byte at more than half of the places that the file names;
* more than a sixth of the functions that it names begin nowhere: no call leads there, the bytes in front are no
  instruction that goes elsewhere, and going by those behind the name before, they lie inside an instruction. Where both
  belong together that happens to tables among hand-written code: to none in the robot's;
* it lists instructions (`A$`, both files have that after `--debug`), and the image lacks more than a quarter of them,
  or more than one in 64 runs on into something else than the next. Where both belong together that happens to an image
  that was patched: to none of 1165 in the robot's, to none in six other programs.
What moved nothing but a last function or two shows in the listing only (`debug_info.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import msgspec

from miro_robot.image.symbol_files import CdbFile, CodePlace, MapFile
from miro_robot.mcs51.opcodes import LENGTH, goes_on, target

_FEW_RECORDS, _FEW_NAMES, _FEW_STRAYS = 20, 4, 3  # fewer prove nothing
_NO_FUNCTIONS = ("HOME", "GSINIT", "GSFINAL", "XINIT", "CONST")  # areas: start-up code in pieces, and data
_JUMPS = (0x02, 0x12)  # LJMP, LCALL
_SPACE = 0x10000
_KEPT = 32  # verdicts, by image and content of the file


class Contradiction(msgspec.Struct, frozen=True):
    """Line of the symbol file (from 1), and what is wrong with it."""

    line: int
    reason: str


@lru_cache(_KEPT)
def check_map(file: MapFile, code: bytes, loaded: bytes) -> Contradiction | None:
    """A map against an image. `code`: 64 KB; `loaded`: 1 for each address that the image has a byte for."""
    return (
        _check_start_up(file.places, code, loaded)
        or _check_places(file.places, loaded)
        or _check_instructions(file.instructions, code, loaded)
        or _check_functions(file.places, code, loaded)
    )


@lru_cache(_KEPT)
def check_cdb(file: CdbFile, code: bytes, loaded: bytes) -> Contradiction | None:
    """A debug file (`.cdb`) against an image; arguments as for `check_map`."""
    return _check_instructions(file.instructions, code, loaded)


def _check_start_up(places: Sequence[CodePlace], code: bytes, loaded: bytes) -> Contradiction | None:
    by_name = {symbol.name: symbol for symbol in places}
    start_up, main = by_name.get("__sdcc_program_startup"), by_name.get("_main")
    if start_up is None or main is None or not all(loaded[start_up.address : start_up.address + 3]):
        return None
    opcode, high, low = (code[(start_up.address + offset) % _SPACE] for offset in range(3))
    target = high << 8 | low
    if opcode not in _JUMPS or target == main.address:
        return None
    reason = f"_main is at {main.address:#06x} here, and the image's start-up code jumps to {target:#06x}"
    return Contradiction(main.line, reason)


def _check_places(places: Sequence[CodePlace], loaded: bytes) -> Contradiction | None:
    missing = [symbol for symbol in places if not loaded[symbol.address]]
    if len(places) < _FEW_NAMES or 2 * len(missing) <= len(places):
        return None
    first = missing[0]
    where = f"{first.name} ({first.address:#06x})"
    count = f"{len(missing)} of {len(places)} code symbols"
    return Contradiction(first.line, f"the image has no bytes for {count}, the first is {where}")


def _check_functions(places: Sequence[CodePlace], code: bytes, loaded: bytes) -> Contradiction | None:
    functions = [
        symbol
        for symbol in places
        if not symbol.area.startswith(_NO_FUNCTIONS)
        and all(loaded[max(0, symbol.address - 3) : symbol.address + 1])
    ]
    before = [functions[0], *functions[:-1]] if functions else []
    strays = [
        symbol
        for symbol, label in zip(functions, before, strict=True)
        if _runs_into(code, symbol.address) and not _is_reached(code, label.address, symbol.address)
    ]
    if len(strays) >= _FEW_STRAYS:
        called = {target(code, address) for address in range(_SPACE) if loaded[address]}
        strays = [symbol for symbol in strays if symbol.address not in called]
    if len(strays) < _FEW_STRAYS or 6 * len(strays) <= len(functions):
        return None
    first = strays[0]
    count = f"{len(strays)} of {len(functions)} functions"
    where = f"{first.name} ({first.address:#06x})"
    return Contradiction(
        first.line, f"no function of the image begins where {count} do, the first is {where}"
    )


def _runs_into(code: bytes, address: int) -> bool:
    """True if none of the possible instructions before `address` jumps elsewhere."""
    return all(
        LENGTH[code[address - size]] != size or goes_on(code[address - size])
        for size in (1, 2, 3)
        if address >= size
    )


def _is_reached(code: bytes, first: int, address: int) -> bool:
    """True if an instruction begins at `address`, going by those from `first` on."""
    while first < address:
        first += LENGTH[code[first]]
    return first == address


def _check_instructions(
    records: Sequence[tuple[int, int]], code: bytes, loaded: bytes
) -> Contradiction | None:
    if len(records) < _FEW_RECORDS:
        return None
    ends = [address + LENGTH[code[address]] for address, _ in records]
    followers = [*(address for address, _ in records[1:]), ends[-1]]
    missing = {index for index, (address, _) in enumerate(records) if not loaded[address]}
    strays = {
        index
        for index, (address, _) in enumerate(records)
        if ends[index] > followers[index] or (ends[index] < followers[index] and goes_on(code[address]))
    } - missing
    misfits = sorted(missing | strays)
    few_strays = len(strays) < _FEW_STRAYS or 64 * len(strays) <= len(records) - len(missing)
    if few_strays and 4 * len(misfits) <= len(records):
        return None
    address, line = records[misfits[0]]
    count = f"{len(misfits)} of its {len(records)} instructions"
    return Contradiction(line, f"{count} are not in the image, the first at {address:#06x}")
