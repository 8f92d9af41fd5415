"""`mirotwin fw run`: an image on the bare processor, with nothing but its serial port and pins connected."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click
import msgspec

from mirotwin.firmware.bare_options import (
    bare_options,
    load_bare_image,
    make_machine,
    report,
    take_bare,
    target_of,
)
from mirotwin.firmware.terminal import check_terminal, run_terminal
from mirotwin.shell.options import Place, choose_engine, engine_option
from mirotwin.shell.outputs import check_file, check_not_input, whole_file
from mirotwin.shell.progress import ProgressBar


@click.command(short_help="Runs IMAGE.ihx on a bare AT89C52.")
@click.argument("image", metavar="IMAGE.ihx", type=Place())
@click.argument("more", metavar="[MORE.ihx]...", type=Place(), nargs=-1)
@bare_options()
@click.option(
    "--terminal",
    is_flag=True,
    help="Connect the terminal to the serial port, in real time; Ctrl-] ends the run.",
)
@click.option(
    "--dump", type=Place(), metavar="FILE.json", help="Write registers and memories to this file at the end."
)
@engine_option
def run(
    image: str, more: tuple[str, ...], terminal: bool, dump: str | None, engine: str | None, **options: Any
) -> int:
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
    request = take_bare(options)
    if dump is not None:
        check_file(Path(dump), "--dump")
        check_not_input(Path(dump), "--dump", image, *more, *request.files)
    if terminal:
        check_terminal(request)
    choose_engine(engine)
    loaded = load_bare_image(image, request, named=False)
    for one in more:
        loaded = loaded.merged(load_bare_image(one, request, named=False))
    target = target_of(image, loaded, request)
    out = sys.stdout.buffer
    machine = make_machine(loaded, request, out.write, live=terminal)
    if terminal:
        ended = run_terminal(machine, target, request)
    else:
        with ProgressBar("running", request.max_cycles) as bar:
            ended = machine.run(until=target, max_cycles=request.max_cycles, progress=bar.to)
    out.flush()
    if dump is not None:
        with whole_file(Path(dump), "--dump") as staging:
            staging.write_bytes(msgspec.json.format(msgspec.json.encode(machine.dump()), indent=2) + b"\n")
    return report(machine, ended, request)
