"""The `mirotwin` command.

What belongs here: the entry point and the list of commands. What does not: what a command does (one file
each), and anything that could be done without a command line (`miro_sim`). Simulation code is imported
inside the commands, because the engine has to be chosen first.
"""

import click

from mirotwin.cli.decode import decode
from mirotwin.cli.export import export
from mirotwin.cli.fw import fw
from mirotwin.cli.info import info, version_of
from mirotwin.cli.program import Program
from mirotwin.cli.replay import replay
from mirotwin.cli.run import run
from mirotwin.cli.scenarios import scenarios
from mirotwin.cli.vectors import vectors


@click.group(cls=Program, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version_of("mirotwin"), prog_name="mirotwin")
def main() -> None:
    """A bit-exact twin of a vision-guided soccer robot.

    Exit codes: 0 done, 1 expectation failed, 2 bad input, 3 firmware fault, 4 divergence,
    42 cycle limit reached; 70 internal error, 130 and 143 ended by Ctrl-C and SIGTERM.
    """


for command in (run, replay, decode, export, scenarios, info, fw, vectors):
    main.add_command(command)
