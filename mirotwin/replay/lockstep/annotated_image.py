"""A firmware with its names: symbol, C line and text of an address."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.opcodes import LENGTH, disassemble
from mirotwin.recording.difference import moment
from mirotwin.replay.lockstep.fields import Record
from mirotwin.shell.debug_files import debugged_image, is_robots_own


class CodeLocation(Record, frozen=True):
    """An instruction that was executed at `tick`. `line`: `failsafe.c:41`, None if no debug file contains it. `symbol`
    with offset; `source`: the text of that line, None without the file; `text`: disassembly.
    """

    tick: int
    pc: int
    symbol: str
    line: str | None
    source: str | None
    text: str
    clock: int = TICKS_PER_SECOND

    def __str__(self) -> str:
        line = f", {self.line}" if self.line else ""
        source = f" `{self.source}`" if self.source else ""
        where = f"{self.pc:#06x} in {self.symbol}{line}{source}"
        return f"{moment(self.tick, self.clock)}: {where}: {self.text}"


NOWHERE = Path("no-such-folder") / "image.ihx"
"""Path of an image whose debug files must not be read."""


class AnnotatedImage:
    """One image with its debug files, if they exist. `sources`: folders of C files. `clock`: ticks per second of its
    runs. `problem`: the reason why debug files are not used, if they belong to another image.
    """

    def __init__(self, image: Image, sources: Sources) -> None:
        self.problem: BadInput | None = None
        self.clock = TICKS_PER_SECOND
        self.sources = sources
        try:
            self.debug = DebugInfo.of(image)
        except BadInput as error:
            self.problem = error
            self.debug = DebugInfo()
            image = msgspec.structs.replace(image, path=NOWHERE)
        self.image = image
        self.names = SymbolNames(image)

    def place(self, pc: int, tick: int) -> CodeLocation:
        line = self.debug.line_at(pc)
        text = " ".join(disassemble(self.image.code, pc, self.names).split())
        source = None if line is None else self.sources.text(line) or None
        where = None if line is None else str(line)
        return CodeLocation(tick, pc, self.names.place(pc), where, source, text, self.clock)


def annotated_of(image: Image, images: Sequence[Image], sources: Sequence[str]) -> AnnotatedImage:
    """The image with its debug files: those beside one of `images`, or the robot's own; C files also in `sources`."""
    if is_robots_own(image):
        sources = ()  # they are for the firmware beside it, whose files may have the same names
    return AnnotatedImage(*debugged_image(image, images, sources))


def same_layout(image: Image, other: Image) -> bool:
    """True if all code and all named variables have the same addresses in both, so PCs can be compared.

    If one image has no symbols, the extent of the code decides.
    """
    if image.used != other.used:
        return False
    names, others = image.symbols.names, other.symbols.names
    return not names or not others or names == others


def changed_instructions(image: Image, other: Image) -> list[int]:
    """Start addresses of instructions that may differ between two images of the same layout."""
    addresses = set()
    for address, (here, there) in enumerate(zip(image.code, other.code, strict=False)):
        if here != there:
            for before in range(min(3, address + 1)):
                first = address - before
                if max(LENGTH[image.code[first]], LENGTH[other.code[first]]) > before:
                    addresses.add(first)
    return sorted(addresses)
