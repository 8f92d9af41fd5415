"""Error handling of the command line: one line on stderr and an exit code, never a traceback for bad input. An
unexpected error is one line too, which requests a report; with MIROTWIN_TRACEBACK=1 in the environment the traceback
comes before it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from io import TextIOWrapper
from itertools import pairwise
from types import FrameType
from typing import Any, NamedTuple, NoReturn, TextIO

import click

from miro_exact.bad_input import BadInput, did_you_mean, one_line, shortened
from miro_exact.engine import EngineError, select
from mirotwin.shell.verdicts import (
    BAD_INPUT,
    DONE,
    INTERNAL_ERROR,
    INTERRUPTED,
    SIGNALLED,
    SIGPIPE,
    exit_code,
)


def traceback_text(error: BaseException) -> str:
    """The traceback if it is requested, else "". For plug-ins. An error without a cause has no traceback."""
    wanted = error.__cause__ is not None and os.environ.get("MIROTWIN_TRACEBACK")
    return "".join(traceback.format_exception(error)) if wanted else ""


def show_traceback(error: BaseException) -> None:
    """Writes it to stderr, if it is wanted."""
    if text := traceback_text(error):  # not nothing: stderr may be full
        sys.stderr.write(text)


class Terminated(BaseException):
    """SIGTERM or SIGHUP: raised in the running code, so that it cleans up as after Ctrl-C."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


class ReaderGone(Exception):
    """The reader of our output has closed it (`| head`)."""


def complain(*messages: str) -> None:
    """Prints one line each on stderr; control characters in messages are escaped."""
    for message in messages:
        click.echo(f"mirotwin: {one_line(message)}", err=True)


def tell_notes(notes: Iterable[str]) -> None:
    """Prints the notes about left-out settings of a scenario on stderr."""
    complain(*(f"note: {note}" for note in notes))


def report_lines(reported: Iterable[tuple[str, str]]) -> int:
    """Prints (verdict, text) lines on stderr; returns the exit code of all together."""
    lines = list(reported)
    complain(*(text for _, text in lines))
    return exit_code(*(verdict for verdict, _ in lines))


def show_line(text: str) -> None:
    """Prints one line on stdout; control codes in the text, for example from names in others' files, are escaped."""
    click.echo(one_line(text.expandtabs()))


def _report(error: Exception) -> str:
    """A line that requests a report; the traceback comes before it if MIROTWIN_TRACEBACK is set."""
    if os.environ.get("MIROTWIN_TRACEBACK"):
        click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
    text = f"{type(error).__name__}: {error}".rstrip(": ")
    ask = "please report this line with the command (MIROTWIN_TRACEBACK=1 shows the place)"
    return f"internal error: {text}; {ask}"


def _in_words(error: click.UsageError) -> str:
    """The error message in our words, if it is about an option's name."""
    if not isinstance(error, click.NoSuchOption) or error.ctx is None:
        return error.format_message()
    names = [name for parameter in error.ctx.command.get_params(error.ctx) for name in parameter.opts]
    hint = did_you_mean(error.option_name, [name for name in names if name.startswith("--")])
    reason = f"No such option {shortened(repr(error.option_name))}"
    return f"{reason}; {hint}" if hint else f"{reason}."


Handler = Callable[[int, FrameType | None], Any]


@contextmanager
def handled_signals(
    names: Sequence[str], take: Handler, replaces: Callable[[Any], bool]
) -> Iterator[dict[int, Any]]:
    """Within it, and in the main thread, `take` gets the signals with a handler that it `replaces`; yields these."""
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in names:
            number = getattr(signal, name, None)  # not every system has all
            if number is not None and replaces(signal.getsignal(number)):
                before[number] = signal.signal(number, take)
    try:
        yield before
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    raise Terminated(number)


def _give_up(stream: TextIO) -> None:
    """Discards buffered output that cannot be written; otherwise the interpreter tries again at its end."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    except (OSError, ValueError):  # not a real file: nothing will be tried
        return


def _ended(code: int, message: str) -> int:
    """Prints the line with the reason and returns the exit code; only the code if stderr is full or closed."""
    try:
        complain(message)
    except OSError:
        _give_up(sys.stderr)
    return code


class Lazy(NamedTuple):
    """A command that is loaded when it is used, from this module of ours."""

    module: str
    about: str


Sections = Mapping[str, Mapping[str, "Lazy | click.Group"]]


class LazyGroup(click.Group):
    """Commands whose modules are loaded when they are used.

    `sections`: heading -> name of a command -> its module and its `--help` line, or a group. The command is the
    function of that name in the module. `settle_engine` runs before the module is loaded, because modules import hot
    modules at their heads.
    """

    def __init__(self, *args: Any, sections: Sections | None = None, **named: Any) -> None:
        super().__init__(*args, **named)
        self.sections = sections or {}
        self.listed = {name: place for section in self.sections.values() for name, place in section.items()}

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*self.listed, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        listed = self.listed.get(cmd_name)
        if not isinstance(listed, Lazy):
            return listed or super().get_command(ctx, cmd_name)
        command = getattr(import_module(f"mirotwin.{listed.module}"), cmd_name)
        assert isinstance(command, click.Command)
        command.short_help = listed.about
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-"):
            names = self.list_commands(ctx)
            hint = did_you_mean(name, names) or f"there are {', '.join(names)}."
            ctx.fail(f"No such command {shortened(repr(name))}; {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if not self.sections:
            super().format_commands(ctx, formatter)
        width = max(map(len, self.listed), default=0)
        formatter.write_paragraph()
        for heading, section in self.sections.items():  # without blank lines between: one screen
            formatter.write_heading(heading)
            with formatter.indentation():
                formatter.write_dl([(name.ljust(width), _about(place)) for name, place in section.items()])


def _about(command: Lazy | click.Group) -> str:
    return command.about if isinstance(command, Lazy) else f"{command.short_help}"


def settle_engine(arguments: Sequence[str]) -> None:
    """Fixes the engine named by the arguments, before the command's module imports hot modules.

    An invalid or unavailable engine is left to the command, which refuses it.
    """
    words = list(arguments)
    named = [word.partition("=")[2] for word in words if word.startswith("--engine=")]
    named += [after for word, after in pairwise(words) if word == "--engine"]
    if named:
        with suppress(EngineError):
            select(named[-1])


class MainGroup(LazyGroup):
    """The group behind `mirotwin`: runs a command and converts errors to a line and an exit code."""

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        extra["standalone_mode"] = False
        sys.exit(self._run(args, prog_name or "mirotwin", extra))

    def invoke(self, ctx: click.Context) -> Any:
        """Replaces click's handling, which exits with 1 if a reader has gone (1 means a failed expectation here), and
        takes a file that ends too early (a truncated bytecode file) for the user's Ctrl-D.
        """
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise ReaderGone from None
        except EOFError as error:
            raise RuntimeError(f"a file ends too soon: {error}") from error

    def _run(self, args: Sequence[str] | None, prog_name: str, extra: dict[str, Any]) -> int:
        if vars(sys)["stderr"] is None:  # `2>&-`: the next file to be opened would take its place
            sys.stderr = open(os.devnull, "w")  # noqa: SIM115
        if vars(sys)["stdout"] is None:  # `>&-`: the next file to be opened would take its place
            return _ended(BAD_INPUT, "error: standard output is closed; send it to a file or a pipe")
        if isinstance(sys.stdout, TextIOWrapper):  # a file's name may hold what stdout cannot
            sys.stdout.reconfigure(errors="backslashreplace")
        settle_engine(sys.argv[1:] if args is None else args)
        try:
            with handled_signals(
                ("SIGTERM", "SIGHUP"), _terminate, lambda handler: handler is signal.SIG_DFL
            ):
                code = super().main(args, prog_name, **extra)
                sys.stdout.flush()
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            return BAD_INPUT
        except click.UsageError as error:
            path = error.ctx.command_path if error.ctx else prog_name
            return _ended(BAD_INPUT, f"error: {_in_words(error)} See `{path} --help`.")
        except click.ClickException as error:
            return _ended(BAD_INPUT, f"error: {error.format_message()}")
        except BadInput as error:
            show_traceback(error)
            return _ended(BAD_INPUT, f"error: {error}")
        except (ReaderGone, BrokenPipeError):
            _give_up(sys.stdout)
            return SIGNALLED + SIGPIPE
        except OSError as error:
            reason = error.strerror or str(error) or type(error).__name__
            if error.filename is None:  # no file was being opened: stdout is full, or a disk
                _give_up(sys.stdout)
                return _ended(BAD_INPUT, f"error: reading or writing failed: {reason}")
            return _ended(BAD_INPUT, f"error: {os.fsdecode(error.filename)}: {reason}")
        except MemoryError:
            return _ended(BAD_INPUT, "error: memory ran out; end other programs, or use a machine with more")
        except (click.Abort, KeyboardInterrupt):
            return _ended(INTERRUPTED, "interrupted")
        except Terminated as error:
            return _ended(SIGNALLED + error.number, f"ended by {error}")
        except Exception as error:
            return _ended(INTERNAL_ERROR, _report(error))
        return code if isinstance(code, int) else DONE
