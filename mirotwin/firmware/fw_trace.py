"""`mirotwin fw trace`: every step of the processor as a line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.trace import HEADING, InstructionTrace
from mirotwin.firmware.code_place import SYMBOL, functions_at
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.firmware.subject import WindowOptions, look, open_window
from mirotwin.shell.command import command_of
from mirotwin.shell.options import FORCE, OUT
from mirotwin.shell.outputs import check_new, check_not_input, whole_file
from mirotwin.shell.program import show_line


class TraceOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw trace"
    symbols: Annotated[tuple[str, ...], SYMBOL] = ()
    out: Annotated[Path | None, OUT.saying("Write to this file instead of stdout.", metavar="FILE")] = None
    force: Annotated[bool, FORCE] = False


@command_of(TraceOptions)
def trace(options: TraceOptions) -> int:
    """Writes what the processor did in SUBJECT: tick, address, symbol, instruction, changed registers and port pins.

    A line stands for one instruction, one call of an interrupt routine, or one stretch of sleep.
    """
    out = options.out
    if out is not None:
        check_not_input(out, "--out", *options.files)
        check_new(out, "--out", options.force)
    run = open_window(options)

    image = with_debug_files(run.image)
    names = SymbolNames(image)
    only = {first for first, _ in functions_at(options.symbols, image, names, options.subject)} or None
    if out is None:
        return look(run, options, InstructionTrace(names, show_line, only, HEADING))
    with whole_file(out, "--out") as staging, staging.open("w", encoding="utf-8") as stream:
        return look(
            run, options, InstructionTrace(names, lambda line: stream.write(line + "\n"), only, HEADING)
        )
