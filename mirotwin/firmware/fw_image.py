"""`mirotwin fw disasm`: an image as a listing with symbols and C lines."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Annotated

import click

from miro_exact.rng import Stream
from miro_protocol.c_header import render
from miro_robot.image import SPACE_BYTES
from miro_robot.image.debug_info import DebugInfo
from miro_robot.inspect.listing import text_lines
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.vector_draw import draw_vectors
from miro_robot.mcs51.vectors import encode
from mirotwin.firmware.code_place import SYMBOL, functions_at
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.debug_files import SourceFolders, source_folders
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.held_signals import held_signals
from mirotwin.shell.options import FORCE, NAME, OUT, SEED, Engine, Whole
from mirotwin.shell.outputs import OutputFolder, check_new, whole_file
from mirotwin.shell.program import show_line
from mirotwin.shell.progress import ProgressBar


class DisasmOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw disasm"
    image: Annotated[str | None, Argument("[IMAGE.ihx]", NAME)] = None
    symbols: Annotated[tuple[str, ...], SYMBOL] = ()
    sources: SourceFolders = ()


@command_of(DisasmOptions)
def disasm(options: DisasmOptions) -> None:
    """Lists IMAGE.ihx, or the robot's own firmware: address, bytes, machine cycles, instruction.

    Symbols come from the .map and .cdb beside the image, C lines from its .rst or .cdb; without them addresses stand
    for both.
    """
    loaded = load_firmware(options.image, SPACE_BYTES)

    names = SymbolNames(loaded)
    path = options.image or str(loaded.path)
    wanted = functions_at(options.symbols, loaded, names, path)
    shown = not wanted
    headings = {f"{name}:" for _, name in wanted}
    for line in text_lines(loaded, DebugInfo.of(loaded), names, source_folders(loaded, options.sources)):
        if wanted and line.endswith(":") and not line.startswith(";"):
            shown = line in headings
        if shown:
            show_line(line)


class HeaderOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw header"
    out: Annotated[Path | None, OUT.saying("Write to this file instead of stdout.", metavar="FILE")] = None
    force: Annotated[bool, FORCE] = False


@command_of(HeaderOptions)
def header(options: HeaderOptions) -> None:
    """Writes a C header for firmware: frame sizes, offsets, flags, CRC, whitening, times in machine cycles.

    It holds #define lines only. One C file of a program says #define PROTOCOL_TABLES before it includes the header;
    that file gets the tables of whitening and CRC.
    """
    out = options.out
    if out is None:
        click.echo(render(), nl=False)
        return
    check_new(out, "--out", options.force)
    with whole_file(out, "--out") as staging:
        staging.write_bytes(render().encode())


OPCODES = 256
NAMES = tuple(f"{opcode:02x}.json" for opcode in range(OPCODES))
"""The files written, all that `--force` replaces."""


class VectorsOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw vectors"
    out: Annotated[Path, OUT.saying("Folder for the 256 files.")]
    per_opcode: Annotated[int, Option(type=Whole(1, 1_000_000), help="Vectors per opcode.")] = 8
    seed: Annotated[int, SEED.saying("Of the states.")] = 1
    force: Annotated[bool, FORCE.saying("Replace files of these names in the folder.")] = False
    engine: Engine = None


@command_of(VectorsOptions)
def vectors(options: VectorsOptions) -> None:
    """Writes one JSON file per opcode, in the form of the SingleStepTests: state before, state after, and the
    accesses of each machine cycle. The same seed writes the same bytes; more vectors per opcode only add to
    them. tests/vectors/README.md describes the format.
    """
    folder = OutputFolder(options.out, options.force, NAMES)

    with held_signals() as hold, folder, ProgressBar("drawing", OPCODES) as bar:
        for opcode, name in enumerate(NAMES):
            with hold.released():
                drawn = _vectors(opcode, options)
            folder.part(name).write_bytes(drawn)
            bar.to(opcode + 1)


def _vectors(opcode: int, options: VectorsOptions) -> bytes:
    """The file of one opcode."""
    word = map(Stream(options.seed, f"vectors/mcs51/{opcode:02x}").u32, count())
    return encode(draw_vectors(opcode, options.per_opcode, lambda n: next(word) * n >> 32))
