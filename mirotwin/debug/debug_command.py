"""`mirotwin debug`: a debugger that goes backwards, as a console or for an editor."""

from __future__ import annotations

import os
import socket
import sys
from contextlib import redirect_stdout
from functools import partial
from typing import Annotated, Any

import click

from miro_exact.bad_input import BadInput
from mirotwin.debug.adapter import Adapter
from mirotwin.debug.console import PROMPT, Console
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.subject import DebugSubject, launched, open_subject
from mirotwin.debug.wire import Wire
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.options import Whole
from mirotwin.shell.program import BAD_INPUT, DONE, complain, show_line


class DebugOptions(DebugSubject, frozen=True, kw_only=True):
    COMMAND = "debug"

    commands: Annotated[
        tuple[str, ...],
        Option("-x", metavar="COMMAND", help="Do this command of the console, then end; may be repeated."),
    ] = ()
    dap: Annotated[bool, Option(help="Speak the Debug Adapter Protocol on standard input and output.")] = (
        False
    )
    listen: Annotated[
        int | None,
        Option(
            type=Whole(0, 65535),
            metavar="PORT",
            help="Speak it to one client of 127.0.0.1:PORT; 0 takes a free port.",
        ),
    ] = None


@command_of(DebugOptions)
def debug(options: DebugOptions) -> int:
    """Steps through the firmware of SUBJECT, forwards and backwards.

    SUBJECT is a scenario, an image (on the bare processor), a recording, a stream file, or a case, which stands at its
    failed check. `help` lists the commands. With --dap or --listen an editor says what is debugged.
    """
    if options.dap or options.listen is not None:
        return _serve(options)
    if not options.subject:
        raise click.UsageError("Missing argument 'SUBJECT'.")
    session = open_subject(options)
    console = Console(Debugger(session.timeline, session.symbols))
    for line in session.said:
        show_line(line)
    console.say(session.why)
    if not options.commands:
        return _interact(console)
    for line in options.commands:
        show_line(f"{PROMPT}{line}")
        if not console.run(line):
            return BAD_INPUT
    return DONE


def _serve(options: DebugOptions) -> int:
    """One client, until it leaves."""
    if options.listen is None:
        sink = sys.stdout.buffer
        with redirect_stdout(sys.stderr):  # what anything prints must not get between the messages
            return _talk(options, Wire(partial(os.read, sys.stdin.fileno()), sink))
    try:
        with socket.create_server(("127.0.0.1", options.listen)) as server:
            complain(f"listening on 127.0.0.1:{server.getsockname()[1]}")
            client, _ = server.accept()
    except OSError as error:
        raise BadInput("--listen", str(options.listen), str(error.strerror), "choose another port") from None
    with client, client.makefile("wb") as sink:
        return _talk(options, Wire(client.recv, sink))


def _talk(options: DebugOptions, wire: Wire) -> int:
    try:
        adapter = Adapter(wire, partial(_begin, options))
        adapter.serve()
    except OSError:
        complain("the client has gone")
        return DONE
    if not adapter.ended:
        complain("the client has gone")
    return DONE


def _begin(options: DebugOptions, given: dict[str, Any]) -> tuple[Debugger, list[str], str]:
    session = open_subject(launched(options, given))
    return Debugger(session.timeline, session.symbols, everyone=True), session.said, session.why


def _interact(console: Console) -> int:
    """Commands from standard input, with history and completion where it is a terminal."""
    if sys.stdin is None:
        raise BadInput("", "stdin", "is closed", "give commands by -x")
    terminal = sys.stdin.isatty()
    if terminal:
        _complete(console)
    done = True
    while not console.ended:
        try:
            line = input(PROMPT if terminal else "")
        except EOFError:
            break
        except KeyboardInterrupt:
            complain("interrupted; `quit` leaves")
            continue
        done = console.run(line) and done
    return DONE if done or terminal else BAD_INPUT


def _complete(console: Console) -> None:
    try:
        import readline
    except ImportError:  # not on every system
        return
    symbols = console.debugger.symbols
    places = [name.removeprefix("_") for name in symbols.image.symbols.names]

    def offer(text: str, state: int) -> str | None:
        begun = readline.get_line_buffer().lstrip()
        words = [*console.verbs()] if " " not in begun else [*places, *symbols.known_names()]
        return [*(one for one in sorted(set(words)) if one.startswith(text)), None][state]

    readline.set_completer(offer)
    readline.parse_and_bind("tab: complete")
