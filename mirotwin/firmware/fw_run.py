"""`mirotwin fw run`: an image on a board, or on the bare processor with nothing but its serial port and pins connected.

With --terminal the keyboard and the screen are a terminal on that port. This module is one of the few that use the wall
clock. The machine does not: the same keys at the same machine cycles give the same bits. The terminal's settings are
restored however the run ends: Ctrl-], the program's end, an exception, or a signal, which `shell.program` turns into an
exception.
"""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_sim.scenario.board import PERIOD_TICKS
from miro_sim.world.world import World
from mirotwin.firmware.bare_options import (
    STDIN,
    BareOptions,
    board_of,
    load_bare_image,
    make_world,
    report,
    stopped_at,
    target_of,
    terminal_of,
)
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import NAME, PATH, Engine
from mirotwin.shell.outputs import check_file, whole_file
from mirotwin.shell.plugin_files import Parts, PluginFiles
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar

LEAVE = b"\x1d"  # Ctrl-]
SLICE_S = 0.01  # of machine time between two looks at the keyboard
LATEST_S = 0.1  # a machine that is later than this is not sped up to catch up
READ_BYTES = 1024
LOOK_TICKS = 4 * PERIOD_TICKS  # between two looks at how far a run is


def check_terminal(options: BareOptions) -> None:
    """Raises BadInput where there is no terminal to be live on."""
    if vars(sys)["stdin"] is None or not sys.stdin.isatty():
        raise BadInput(
            "", "--terminal", "standard input is no terminal", "run it in one, or give input with --stdin"
        )
    if STDIN in options.stdin:
        raise BadInput("", "--stdin", "- is the keyboard, which --terminal uses already", "name a file")
    try:
        import termios  # noqa: F401
    except ImportError:
        raise BadInput(
            "", "--terminal", "this system has no POSIX terminals", "give input with --stdin"
        ) from None


def limit_tick(options: BareOptions) -> int:
    """The tick of --max-cycles."""
    return NEVER_TICK if options.max_cycles is None else options.max_cycles * CYCLE_TICKS


def run_world(world: World, options: BareOptions) -> None:
    """Runs to the end of the world or to the limit."""
    end_tick, cpu = limit_tick(options), board_of(world).cpu
    with ProgressBar("running", options.max_cycles) as bar:
        while not world.finished and world.tick < end_tick:
            world.run_to(min(end_tick, world.tick + LOOK_TICKS))
            bar.to(cpu.cycles)


def run_terminal(world: World, options: BareOptions) -> None:
    """Runs `world`, whose terminal must be live, in the time of its crystal until it ends or Ctrl-] is typed."""
    slice_ticks = max(1, int(world.clock / CYCLE_TICKS * SLICE_S)) * CYCLE_TICKS
    end_tick = limit_tick(options)
    keyboard = sys.stdin.fileno()
    with _raw(keyboard):
        due_s = time.monotonic()
        while True:
            world.run_to(min(end_tick, world.tick + slice_ticks))
            sys.stdout.buffer.flush()
            if world.finished or world.tick >= end_tick:
                return
            due_s = max(due_s + SLICE_S, time.monotonic() - LATEST_S)
            keys = _keys(keyboard, due_s)
            if keys is None or LEAVE in keys:
                break
            if keys:
                terminal_of(world).input.add(keys)
    complain(f"left at {stopped_at(world)}")


def _keys(keyboard: int, due_s: float) -> bytes | None:
    """Waits until `due_s`; returns the typed keys, or None if the terminal has gone."""
    keys = b""
    while True:
        remaining_s = due_s - time.monotonic()
        if not select.select([keyboard], [], [], max(0.0, remaining_s))[0]:
            return keys
        try:
            more = os.read(keyboard, READ_BYTES)
        except OSError:
            return None
        if not more:
            return None
        keys += more
        if remaining_s <= 0 or LEAVE in keys:
            return keys


@contextmanager
def _raw(keyboard: int) -> Iterator[None]:
    """Puts the keyboard into raw mode: every key, also Ctrl-C, is passed on, and none is echoed."""
    import termios
    import tty

    before = termios.tcgetattr(keyboard)
    try:
        tty.setraw(keyboard, termios.TCSANOW)
        yield
    finally:
        termios.tcsetattr(keyboard, termios.TCSANOW, before)


def dumped(world: World) -> dict[str, object]:
    """Registers and memories, SFRs by two hex digits, ports at their latches; of a board the values of its parts."""
    board = board_of(world)
    cpu, values = board.cpu, world.devices[0].values()
    return {
        "pc": cpu.pc,
        "cycles": cpu.cycles,
        "instructions": cpu.instructions,
        "iram_hex": bytes(cpu.peek_iram(address) for address in range(0x100)).hex(),
        "sfr": {f"{address:02x}": cpu.sfr(address) for address in range(0x80, 0x100)},
        "xram_hex": board.xram().hex(),
        **({"parts": values} if values else {}),
    }


class FwRunOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw run"
    image: Annotated[str, Argument("IMAGE.ihx", NAME)]
    more: Annotated[tuple[str, ...], Argument("[MORE.ihx]...", NAME, several=True)] = ()
    bare: BareOptions = BareOptions()
    terminal: Annotated[
        bool, Option(help="Connect the terminal to the serial port, in real time; Ctrl-] ends the run.")
    ] = False
    dump: Annotated[
        Path | None,
        Option(type=PATH, metavar="FILE.json", help="Write registers and memories to this file at the end."),
    ] = None
    parts: Parts = ()
    engine: Engine = None


@command_of(FwRunOptions)
def run(options: FwRunOptions) -> int:
    """Runs IMAGE.ihx on a bare AT89C52, or on a board (--board); its output goes to stdout unchanged.

    MORE.ihx are loaded beside it: a program and the monitor that starts it.

    Exit codes: 0 --until was reached (or, without it, the firmware ended), 1 the firmware ended before it, 3 firmware
    fault, 42 --max-cycles was reached. Ctrl-C (130): the output so far is on stdout, and no dump is written.

    To answer prompts, give pairs of --stdin-when and --stdin, in order:

    \b
    mirotwin fw run monitor.ihx --baud 9600 --stdin space.bin \\
        --stdin-when '> ' --stdin commands.txt --stdin-by-line
    """
    image, bare, dump = options.image, options.bare, options.dump
    PluginFiles(parts=options.parts).bring()
    if dump is not None:
        check_file(dump, "--dump", image, *options.more, *bare.files)
    if options.terminal:
        check_terminal(bare)
    loaded = load_bare_image(image, bare, named=False)
    for path in options.more:
        loaded = loaded.merged(load_bare_image(path, bare, named=False))
    target = target_of(image, loaded, bare)
    out = sys.stdout.buffer
    world = make_world(loaded, bare, target, out.write, live=options.terminal)
    (run_terminal if options.terminal else run_world)(world, bare)
    out.flush()
    if dump is not None:
        with whole_file(dump, "--dump") as staging:
            staging.write_bytes(msgspec.json.format(msgspec.json.encode(dumped(world)), indent=2) + b"\n")
    return report(world, bare)
