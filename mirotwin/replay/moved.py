"""How the code of one build lies in another: by symbols, and within a function instruction by instruction.

A piece of code reaches from one symbol to the next. Two pieces of one name are compared as text, in which addresses
have their names, so that a call to a function that moved is the same call. An address that is loaded in two halves has
no name there, and counts as changed where it moved.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterator
from difflib import SequenceMatcher

import msgspec

from miro_robot.mcs51.opcodes import LENGTH, disassemble
from mirotwin.replay.annotated_image import AnnotatedImage

_OFFSET = re.compile(r"\+(0x[0-9a-f]+|\d+|[0-9A-F]+h)")
_ADDRESS = re.compile(r"\b([0-9A-F]{4,5})h")
Instruction = tuple[int, bytes, str]
"""Address, bytes, and text without what depends on where the code lies."""
NAMED = 5


class Moved(msgspec.Struct, frozen=True):
    """`same`: pieces of code with equal instructions; `changed`: the others of equal names; `only`: those of one image.

    `places`: an instruction of the first image that changed, and the one in its place in the second.
    """

    same: tuple[str, ...]
    changed: tuple[str, ...]
    only: tuple[tuple[str, ...], tuple[str, ...]]
    places: dict[int, int]

    def __str__(self) -> str:
        parts = [
            f"{len(self.same)} of {len(self.same) + len(self.changed)} functions and labels hold the same"
        ]
        parts += [f"changed: {_listed(self.changed)}"] if self.changed else []
        sides = zip(("first", "second"), self.only, strict=True)
        parts += [f"only in the {side}: {_listed(names)}" for side, names in sides if names]
        return "; ".join(parts)


def moved(one: AnnotatedImage, other: AnnotatedImage) -> Moved:
    """The map of the two, empty where one of them has no symbols."""
    here, there = _pieces(one), _pieces(other)
    same: list[str] = []
    changed: list[str] = []
    places: dict[int, int] = {}
    for name in here:
        if name not in there:
            continue
        first, second = list(_instructions(one, *here[name])), list(_instructions(other, *there[name]))
        differing = list(_differing(first, second))
        (changed if differing else same).append(name)
        places.update(differing)
    only = (
        tuple(name for name in here if name not in there),
        tuple(name for name in there if name not in here),
    )
    return Moved(tuple(same), tuple(changed), only, places)


def _pieces(annotated: AnnotatedImage) -> dict[str, tuple[int, int]]:
    """Name -> where the code begins and ends, in the order of addresses."""
    symbols = annotated.image.symbols
    if symbols.problem is not None:
        return {}
    found: dict[int, str] = {}
    for name, symbol in sorted(symbols.names.items()):
        if symbol.space == "code" and any(
            first <= symbol.address < end for first, end in annotated.image.used
        ):
            found.setdefault(symbol.address, name)
    starts = sorted(found)
    pieces = {}
    for start in starts:
        end = next(end for first, end in annotated.image.used if first <= start < end)
        after = bisect.bisect_right(starts, start)
        pieces[found[start]] = (start, min([end, *starts[after : after + 1]]))
    return pieces


def _instructions(annotated: AnnotatedImage, address: int, end: int) -> Iterator[Instruction]:
    code, names = annotated.image.code, annotated.names
    while address < end:
        text = " ".join(disassemble(code, address, names).split())
        text = _ADDRESS.sub(lambda found: names.place(int(found[1], 16)), text)
        length = LENGTH[code[address]]
        yield address, bytes(code[address : address + length]), _OFFSET.sub("", text)
        address += length


def _differing(one: list[Instruction], other: list[Instruction]) -> Iterator[tuple[int, int]]:
    """Addresses in both at which the instructions begin to differ; at the end of a piece those of its last one."""
    if [len(code) for _, code, _ in one] == [len(code) for _, code, _ in other]:
        for (here, code, text), (there, code_there, text_there) in zip(one, other, strict=True):
            if code != code_there and text != text_there:
                yield here, there
        return
    texts = [text for _, _, text in one], [text for _, _, text in other]
    for kind, first, _, second, _ in SequenceMatcher(None, *texts, autojunk=False).get_opcodes():
        if kind != "equal":
            yield one[min(first, len(one) - 1)][0], other[min(second, len(other) - 1)][0]


def _listed(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
