"""`mirotwin fw run`: an image on the bare processor, with nothing but its serial port and pins connected."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import msgspec

from mirotwin.firmware.bare_options import (
    BareOptions,
    load_bare_image,
    make_machine,
    report,
    target_of,
)
from mirotwin.firmware.terminal import check_terminal, run_terminal
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import NAME, PATH, Engine
from mirotwin.shell.outputs import check_file, check_not_input, whole_file
from mirotwin.shell.progress import ProgressBar


class FwRunOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw run"
    image: Annotated[str, Argument("IMAGE.ihx", NAME)]
    more: Annotated[tuple[str, ...], Argument("[MORE.ihx]...", NAME, several=True)] = ()
    bare: BareOptions = BareOptions()
    terminal: Annotated[
        bool,
        Option(help="Connect the terminal to the serial port, in real time; Ctrl-] ends the run."),
    ] = False
    dump: Annotated[
        Path | None,
        Option(
            type=PATH,
            metavar="FILE.json",
            help="Write registers and memories to this file at the end.",
        ),
    ] = None
    engine: Engine = None


@command_of(FwRunOptions)
def run(options: FwRunOptions) -> int:
    """Runs IMAGE.ihx on a bare AT89C52; what it sends goes to stdout as it is.

    MORE.ihx are loaded beside it: a program and the monitor that starts it.

    Exit codes: 0 --until was reached (or, without it, the firmware ended), 1 the firmware ended before it,
    3 firmware fault, 42 --max-cycles was reached. Ctrl-C (130) leaves on stdout what was sent until then, and
    writes no dump.

    A program with prompts is driven by pairs of --stdin-when and --stdin, in order:

    \b
    mirotwin fw run monitor.ihx --baud 9600 --stdin space.bin \\
        --stdin-when '> ' --stdin commands.txt --stdin-by-line
    """
    image, bare, dump = options.image, options.bare, options.dump
    if dump is not None:
        check_file(dump, "--dump")
        check_not_input(dump, "--dump", image, *options.more, *bare.files)
    if options.terminal:
        check_terminal(bare)
    loaded = load_bare_image(image, bare, named=False)
    for one in options.more:
        loaded = loaded.merged(load_bare_image(one, bare, named=False))
    target = target_of(image, loaded, bare)
    out = sys.stdout.buffer
    machine = make_machine(loaded, bare, out.write, live=options.terminal)
    if options.terminal:
        ended = run_terminal(machine, target, bare)
    else:
        with ProgressBar("running", bare.max_cycles) as bar:
            ended = machine.run(until=target, max_cycles=bare.max_cycles, progress=bar.to)
    out.flush()
    if dump is not None:
        with whole_file(dump, "--dump") as staging:
            staging.write_bytes(msgspec.json.format(msgspec.json.encode(machine.dump()), indent=2) + b"\n")
    return report(machine, ended, bare)
