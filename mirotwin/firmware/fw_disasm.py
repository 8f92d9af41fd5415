"""`mirotwin fw disasm`: an image as a listing with symbols and C lines."""

from __future__ import annotations

import click

from miro_robot.image.debug_info import DebugInfo
from miro_robot.inspect.listing import text_lines
from miro_robot.inspect.symbol_names import SymbolNames
from mirotwin.firmware.code_place import SPACE_BYTES, functions_at
from mirotwin.firmware.sources_option import sources_of, sources_option
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import Place, choose_engine
from mirotwin.shell.program import show_line


@click.command(short_help="Lists an image's instructions.")
@click.argument("image", metavar="[IMAGE.ihx]", required=False, type=Place())
@click.option(
    "--symbol",
    "symbols",
    multiple=True,
    metavar="SYMBOL|ADDRESS",
    help="Only the function at this symbol or address; may be repeated.",
)
@sources_option
def disasm(image: str | None, symbols: tuple[str, ...], sources: tuple[str, ...]) -> None:
    """Lists IMAGE.ihx, or the robot's own firmware: address, bytes, machine cycles, instruction.

    Symbols come from the .map and .cdb beside the image, C lines from its .rst or .cdb; without them addresses stand
    for both.
    """
    choose_engine(None)
    loaded = load_firmware(image, SPACE_BYTES)

    names = SymbolNames(loaded)
    path = image or str(loaded.path)
    wanted = functions_at(symbols, loaded, names, path)
    shown = not wanted
    headings = {f"{name}:" for _, name in wanted}
    for line in text_lines(loaded, DebugInfo.of(loaded), names, sources_of(loaded, sources)):
        if wanted and line.endswith(":") and not line.startswith(";"):
            shown = line in headings
        if shown:
            show_line(line)
