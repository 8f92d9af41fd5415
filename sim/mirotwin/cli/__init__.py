"""The `mirotwin` command.

What belongs here: the entry point and the list of commands. What does not: what a command does (one file
each), and anything that could be done without a command line (`miro_sim`). A command's module is loaded when the
command is used, after `--engine` was read (`program.settle_engine`).
"""

import click

from mirotwin.cli.program import Program, print_version

COMMANDS = {
    "run": "Runs a scenario and writes its files.",
    "serve": "Offers the robot's radio as PTY, TCP and RFC 2217 ports.",
    "reproduce": "Runs the paper's figures again and writes one page about them.",
    "campaign": "Runs a scenario many times, varied, and compares.",
    "report": "Makes one page of a run, a case, a failed test or a campaign.",
    "look": "Draws what the camera sees and what the tracker makes of it.",
    "calibrate": "Finds a camera's parameters from control points.",
    "track": "Finds robots in pictures of your own, or in recorded ones.",
    "conform": "Tries the protocol's rules on a firmware image.",
    "fuzz": "Looks for inputs that make a firmware image fail.",
    "test": "Runs scenario files as tests: steps, checks, a verdict each.",
    "replay": "Sends recorded bytes again and compares.",
    "diff": "Compares two recordings.",
    "decode": "Decodes captured bytes to frames and damage.",
    "export": "Writes a run for Foxglove, Wireshark, or as a stream file.",
    "init": "Begins a project: firmware, tests, scenarios, a workflow for CI.",
    "examples": "Lists the examples, or writes one into a folder.",
    "scenarios": "Lists the built-in scenarios, or shows one.",
    "info": "Shows versions, engine and firmware.",
    "fw": "Firmware: run on the bare processor, disassemble, trace, profile.",
    "vectors": "Writes single-step test vectors of the processor.",
}
"""Name, which is the module's and the function's too, and what `--help` says of it."""


@click.group(
    cls=Program,
    modules="mirotwin.cli.",
    commands_about=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=print_version,
    help="Show the version.",
)
def main() -> None:
    """A bit-exact twin of a vision-guided soccer robot.

    Exit codes: 0 done, 1 expectation failed, 2 bad input, 3 firmware fault, 4 divergence,
    42 cycle limit reached; 70 internal error, 130 and 143 ended by Ctrl-C and SIGTERM.
    """
