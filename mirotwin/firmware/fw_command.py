"""`mirotwin fw`: the list of commands for firmware; each is in a module of its own, loaded when it is used."""

import click

from mirotwin.shell.program import Lazy, LazyGroup

COMMANDS = {
    "run": Lazy("mirotwin.firmware.fw_run", "Runs IMAGE.ihx on a bare AT89C52."),
    "disasm": Lazy("mirotwin.firmware.fw_disasm", "Lists an image's instructions."),
    "trace": Lazy("mirotwin.firmware.fw_trace", "Writes each instruction with the registers it changed."),
    "profile": Lazy("mirotwin.firmware.fw_profile", "Shows where the processor spends its time."),
    "coverage": Lazy("mirotwin.firmware.fw_coverage", "Shows which lines of the firmware ran."),
    "vcd": Lazy("mirotwin.firmware.fw_vcd", "Writes the wires as a VCD file."),
    "header": Lazy("mirotwin.firmware.fw_header", "Writes protocol.h: the numbers of the wire for C."),
    "vectors": Lazy("mirotwin.firmware.vectors_command", "Writes single-step test vectors of the processor."),
}


@click.group(
    cls=LazyGroup,
    sections={"Commands": COMMANDS},
    short_help="Firmware: run on the bare processor, disassemble, trace, profile.",
)
def fw() -> None:
    """Firmware: run on the bare processor, disassemble, trace, profile.

    SUBJECT is what runs: an IMAGE.ihx on the bare processor, or the robot in a scenario (a built-in name or a .toml),
    in a recording (run.mcap) or on a stream file.
    """
