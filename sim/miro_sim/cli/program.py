"""How the command line fails: one line on stderr and an exit code, never a traceback for what a user can
mend.

What belongs here: exit codes, the translation of errors, and the two consoles. What does not: any command.
"""

import errno
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

import click
from miro_protocol.engine import EngineError
from miro_protocol.stream import StreamError
from rich.console import Console

from miro_sim.outdir import OutputError
from miro_sim.recording_reader import RecordingError
from miro_sim.replay import StreamContentError
from miro_sim.scenario_errors import ScenarioError, one_line

DONE = 0
EXPECTATION_FAILED = 1
BAD_INPUT = 2
FIRMWARE_FAULT = 3
DIVERGENCE = 4
LIMIT_REACHED = 42
INTERRUPTED = 130

PIPE_COLUMNS = 200

MAX_SEED = (1 << 63) - 1


class UserError(Exception):
    """What a command found wrong with its input, ready to print: `FILE: PLACE: what; remedy`."""


BAD_INPUTS = (
    UserError,
    ScenarioError,
    OutputError,
    RecordingError,
    StreamError,
    StreamContentError,
    EngineError,
)


def complain(message: str) -> None:
    """One line on stderr, whatever the message holds."""
    click.echo(f"mirotwin: {one_line(message)}", err=True)


def output() -> Console:
    """The console for results, on stdout; what goes to a file or a pipe is not folded at 80 columns."""
    return Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else PIPE_COLUMNS)


class Program(click.Group):
    """The group behind `mirotwin`: runs a command and turns what went wrong into a line and an exit code."""

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        extra["standalone_mode"] = False
        sys.exit(self._run(args, prog_name or "mirotwin", extra))

    def _run(self, args: Sequence[str] | None, prog_name: str, extra: dict[str, Any]) -> int:
        try:
            code = super().main(args, prog_name, **extra)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            return BAD_INPUT
        except click.UsageError as error:
            path = error.ctx.command_path if error.ctx else prog_name
            complain(f"error: {error.format_message()} See `{path} --help`.")
            return BAD_INPUT
        except click.ClickException as error:
            complain(f"error: {error.format_message()}")
            return BAD_INPUT
        except BAD_INPUTS as error:
            complain(f"error: {error}")
            return BAD_INPUT
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader of our output has gone
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                return 1
            if error.filename is None:
                raise
            complain(f"error: {os.fsdecode(error.filename)}: {error.strerror}")
            return BAD_INPUT
        except (click.Abort, KeyboardInterrupt):
            complain("interrupted")
            return INTERRUPTED
        return code if isinstance(code, int) else DONE
