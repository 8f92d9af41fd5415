"""`mirotwin fw trace`: every step of the processor as a line."""

from __future__ import annotations

from pathlib import Path

import click

from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.trace import HEADING, Trace
from mirotwin.firmware.code_place import functions_at
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.firmware.subject import Request, look, open_run, subject_options
from mirotwin.shell.options import Place
from mirotwin.shell.outputs import check_new, check_not_input, whole_file
from mirotwin.shell.program import show_line


@click.command(short_help="Writes each instruction with the registers it changed.")
@subject_options
@click.option(
    "--symbol",
    "symbols",
    multiple=True,
    metavar="SYMBOL|ADDRESS",
    help="Only the function at this symbol or address; may be repeated.",
)
@click.option(
    "--out", type=Place(path_type=Path), metavar="FILE", help="Write to this file instead of stdout."
)
@click.option("--force", is_flag=True, help="Replace the file at --out.")
def trace(request: Request, symbols: tuple[str, ...], out: Path | None, force: bool) -> int:
    """Writes what the processor did in SUBJECT: tick, address, symbol, instruction, changed registers and port pins.

    A line stands for one instruction, one call of an interrupt routine, or one stretch of sleep.
    """
    if out is not None:
        check_not_input(out, "--out", *request.files)
        check_new(out, "--out", force)
    run = open_run(request)

    image = with_debug_files(run.image)
    names = SymbolNames(image)
    only = {first for first, _ in functions_at(symbols, image, names, request.subject)} or None
    if out is None:
        return look(run, request, Trace(names, show_line, only, HEADING))
    with whole_file(out, "--out") as staging, staging.open("w", encoding="utf-8") as stream:
        return look(run, request, Trace(names, lambda line: stream.write(line + "\n"), only, HEADING))
