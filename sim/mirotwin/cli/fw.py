"""`mirotwin fw`: the list of commands for firmware; each is in a module of its own, loaded when it is used."""

import click

from mirotwin.cli.program import LazyGroup

COMMANDS = {
    "run": "Runs IMAGE.ihx on a bare AT89C52.",
    "disasm": "Lists an image's instructions.",
    "trace": "Writes each instruction with the registers it changed.",
    "profile": "Shows where the processor spends its time.",
    "coverage": "Shows which lines of the firmware ran.",
    "vcd": "Writes the wires as a VCD file.",
    "header": "Writes protocol.h: the numbers of the wire for C.",
}
"""Name, which is the function's too and ends that of the module, and what `fw --help` says of it."""


@click.group(
    cls=LazyGroup,
    modules="mirotwin.cli.fw_",
    commands_about=COMMANDS,
    short_help="Firmware: run on the bare processor, disassemble, trace, profile.",
)
def fw() -> None:
    """Firmware: run on the bare processor, disassemble, trace, profile.

    SUBJECT is what runs: an IMAGE.ihx on the bare processor, or the robot in a scenario (a built-in name or a .toml),
    in a recording (run.mcap) or on a stream file.
    """
