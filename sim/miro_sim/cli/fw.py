"""`mirotwin fw` and `fw run`: an image on the bare processor, with nothing but its serial port connected."""

from __future__ import annotations

import sys
from pathlib import Path

import click
import msgspec

from miro_sim.cli.code_place import FLASH_BYTES, SPACE_BYTES, address_of, place_of
from miro_sim.cli.fw_coverage import coverage
from miro_sim.cli.fw_disasm import disasm
from miro_sim.cli.fw_profile import profile
from miro_sim.cli.fw_trace import trace
from miro_sim.cli.fw_vcd import vcd
from miro_sim.cli.options import Place, Whole, choose_engine, engine_option, load_image
from miro_sim.cli.program import DONE, EXPECTATION_FAILED, FIRMWARE_FAULT, LIMIT_REACHED, complain
from miro_sim.cli.progress import ProgressBar
from miro_sim.inputs import read_input
from miro_sim.outdir import check_file, check_not_input, whole_file


@click.group()
def fw() -> None:
    """Firmware: run it on the bare processor, or look into it at work.

    SUBJECT is what runs: an IMAGE.ihx on the bare processor, or the robot in a scenario (a built-in name or a .toml),
    in a recording (run.mcap) or on a stream file.
    """


for command in (disasm, trace, profile, coverage, vcd):
    fw.add_command(command)


@fw.command("run")
@click.argument("image", metavar="IMAGE.ihx", type=Place())
@click.option(
    "--until", metavar="SYMBOL|ADDRESS", help="Stop before the instruction there (0x.. or a symbol's name)."
)
@click.option(
    "--max-cycles", type=Whole(1), metavar="N", help="Give up after N machine cycles, exit code 42."
)
@click.option("--stdin", "stdin", type=Place(), metavar="FILE", help="Bytes for the serial port.")
@click.option("--baud", type=Whole(50, 750_000), help="Bit rate of --stdin. Default: what the firmware sets.")
@click.option(
    "--code-in-xram", is_flag=True, help="EA low: program and data share 64 KB; lifts the 8 KB limit."
)
@click.option(
    "--dump", type=Place(), metavar="FILE.json", help="Write registers and memories there at the end."
)
@engine_option
def run_bare(
    image: str,
    until: str | None,
    max_cycles: int | None,
    stdin: str | None,
    baud: int | None,
    code_in_xram: bool,
    dump: str | None,
    engine: str | None,
) -> int:
    """Runs IMAGE.ihx on a bare AT89C52; what it sends goes to stdout as it is.

    Exit codes: 0 --until was reached (or, without it, the firmware ended), 1 the firmware ended before it,
    3 firmware fault, 42 --max-cycles was reached. Ctrl-C (130) leaves on stdout what was sent until then, and
    writes no dump.
    """
    if dump is not None:
        check_file(Path(dump), "--dump")
        check_not_input(Path(dump), "--dump", image, stdin)
    choose_engine(engine)
    loaded = load_image(image, SPACE_BYTES if code_in_xram else FLASH_BYTES)
    target = None if until is None else address_of(until, loaded, image, "--until")
    given = b"" if stdin is None else read_input(stdin)
    from miro_robot.bare import BareMachine, Ended

    out = sys.stdout.buffer
    machine = BareMachine(loaded, code_in_xram=code_in_xram, stdin=given, baud=baud, output=out.write)
    with ProgressBar("running", max_cycles) as bar:
        ended = machine.run(until=target, max_cycles=max_cycles, progress=bar.to)
    out.flush()
    if dump is not None:
        with whole_file(Path(dump), "--dump") as staging:
            staging.write_bytes(msgspec.json.format(msgspec.json.encode(machine.dump()), indent=2) + b"\n")
    place = f"{place_of(machine.cpu.pc, loaded)} after {machine.cpu.cycles} machine cycles"
    if ended is Ended.FAULT:
        complain(f"firmware fault: {machine.faults[0]}")
        return FIRMWARE_FAULT
    if ended is Ended.CYCLES:
        complain(f"gave up at {place}")
        return LIMIT_REACHED
    if ended is Ended.HALTED:
        complain(f"the firmware ended at {place}; no interrupt can wake it")
        return DONE if target is None else EXPECTATION_FAILED
    return DONE
