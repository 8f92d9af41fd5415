"""`mirotwin fw disasm`, an image as a listing with symbols and C lines; `mirotwin fw header`, the wire for C."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from miro_protocol.c_header import render
from miro_robot.image import SPACE_BYTES
from miro_robot.image.debug_info import DebugInfo
from miro_robot.inspect.listing import text_lines
from miro_robot.inspect.symbol_names import SymbolNames
from mirotwin.firmware.code_place import SYMBOL, functions_at
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.debug_files import SourceFolders, source_folders
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import FORCE, NAME, OUT
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.program import show_line


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
