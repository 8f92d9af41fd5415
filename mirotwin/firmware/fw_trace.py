"""`mirotwin fw trace` and `fw vcd`: every step of the processor as a line, and every wire for GTKWave and sigrok."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput, one_line
from miro_exact.clock import PWM_PERIOD_TICKS
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.trace import HEADING, InstructionTrace
from miro_robot.inspect.waveform import SETTLING_TICKS, Waveform, write_save_file
from mirotwin.firmware.code_place import SYMBOL, functions_at
from mirotwin.firmware.subject import WindowOptions, look, open_window
from mirotwin.shell.command import command_of
from mirotwin.shell.console import show
from mirotwin.shell.debug_files import with_debug_files
from mirotwin.shell.options import FORCE, OUT
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.program import show_line


class TraceOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw trace"
    symbols: Annotated[tuple[str, ...], SYMBOL] = ()
    out: Annotated[Path | None, OUT.saying("Write to this file instead of stdout.", metavar="FILE")] = None
    force: Annotated[bool, FORCE] = False


@command_of(TraceOptions)
def trace(options: TraceOptions) -> int:
    """Writes each instruction executed in SUBJECT: tick, address, symbol, instruction, changed registers and port pins.

    A line stands for one instruction, one call of an interrupt routine, or one stretch of sleep.
    """
    out = options.out
    if out is not None:
        check_new(out, "--out", options.force, *options.files)
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


SAVE_SUFFIX = ".gtkw"
LATE_TICKS = 2 * PWM_PERIOD_TICKS
"""Encoder edges become known up to one step of the drive late."""


class VcdOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw vcd"
    out: Annotated[Path, OUT.saying("FILE.gtkw is written beside it.", metavar="FILE.vcd")]
    force: Annotated[bool, FORCE.saying("Replace both files if they are there.")] = False


@command_of(VcdOptions)
def vcd(options: VcdOptions) -> int:
    """Writes the levels of the wires in SUBJECT as a VCD file, with a save file for GTKWave beside it.

    The wires: RXD and TXD; on the robot, the bus and the pins of both LM629 and the encoders; on a board of parts, all
    nets; interrupt routines in service, sleep, port pins. Every one is a 1-bit wire; the save file puts buses together.
    A last stretch of less than 0.1 ms may be missing at the end of a robot's run, where its encoder edges are not known
    yet.
    """
    out = options.out
    save = out.with_suffix(SAVE_SUFFIX)
    for path in (out, save):
        check_new(path, "--out", options.force, *options.files)
    if save == out:
        raise BadInput(
            "",
            f"--out {out}",
            "this is the name of the GTKWave save file",
            "give the VCD file another ending, .vcd",
        )
    run = open_window(options)

    with whole_file(save, "--out") as save_staging, whole_file(out, "--out") as staging:
        with staging.open("w", encoding="ascii", newline="\n") as stream:
            from_tick, to_tick = options.ticks(run.tick_hz)
            waveform = Waveform(stream, run.device.board, from_tick, to_tick, run.tick_hz)
            run.tell_pins(waveform.pin_moved)
            early_ticks = 2 * SETTLING_TICKS
            code = look(run, options, waveform.tap, early_ticks=early_ticks, late_ticks=LATE_TICKS)
            try:
                waveform.close()
            except ValueError as error:
                raise BadInput(options.subject, f"--from {from_tick}t", f"{error}", "look earlier") from None
        with save_staging.open("w", encoding="utf-8", newline="\n") as stream:
            write_save_file(stream, one_line(out.name), waveform.signals)
    first_s, last_s = waveform.first_tick / run.tick_hz, waveform.written_tick / run.tick_hz
    show(f"{first_s:.6f} s to {last_s:.6f} s; gtkwave {out} {save}")
    return code
