"""`mirotwin debug`: a debugger that goes backwards, as a console or for an editor."""

from __future__ import annotations

import os
import secrets
import socket
import sys
from contextlib import nullcontext, redirect_stdout, suppress
from pathlib import Path
from typing import Annotated, TextIO

from miro_exact.bad_input import BadInput
from mirotwin.debug.adapter import Adapter
from mirotwin.debug.console import Console, history_kept
from mirotwin.debug.subject import DebugSubject, open_subject
from mirotwin.debug.wire import Wire
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.options import Whole
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.verdicts import BAD_INPUT, DONE

COMMAND = Option(
    "-x", metavar="COMMAND", apart="dap", help="Do this command of the console, then end; may be repeated."
)
DAP = Option(apart="subject", help="Speak the Debug Adapter Protocol on standard input and output.")
LISTEN = Option(
    type=Whole(0, 65535),
    metavar="PORT",
    apart="subject",
    help="Speak it to one client of 127.0.0.1:PORT; 0 takes a free port.",
)

_TCP = Path("/proc/net/tcp")  # Linux: who has which connection


class DebugOptions(DebugSubject, frozen=True, kw_only=True):
    COMMAND = "debug"

    commands: Annotated[tuple[str, ...], COMMAND] = ()
    dap: Annotated[bool, DAP] = False
    listen: Annotated[int | None, LISTEN] = None


@command_of(DebugOptions)
def debug(options: DebugOptions) -> int:
    """Steps through the firmware of SUBJECT, forwards and backwards.

    SUBJECT is a scenario, an image (on the bare processor, or on --board), a board file with --firmware, a recording, a
    stream file, or a case. A case opens at its failed check, a scenario with steps at the failed step. `help` lists the
    commands. With --dap or --listen the editor chooses the subject.
    """
    if options.listen is not None:
        return _listen(options.listen)
    if options.dap:
        sink = sys.stdout.buffer
        with redirect_stdout(sys.stderr):  # what anything prints must not get between the messages
            source = os.fdopen(_stdin("connect to --listen").fileno(), "rb", closefd=False)
            return _serve(Wire(source, sink))
    debugger, notes, why = open_subject(options)
    console = Console(debugger)
    console.session.say(why)
    for line in (*notes, *console.session.lines):
        show_line(line)
    if not options.commands:
        return _interact(console)
    for line in options.commands:
        show_line(f"{console.prompt}{line}")
        ended = console.onecmd(line)
        if console.interrupted:
            raise KeyboardInterrupt
        if ended or not console.done:
            break
    return DONE if console.done else BAD_INPUT


def _listen(port: int) -> int:
    """Serves the first client of this user.

    If the system does not reveal the client's user, the client needs the token.
    """
    token = "" if _TCP.exists() else secrets.token_hex(16)
    try:
        with socket.create_server(("127.0.0.1", port)) as server:
            words = f", token {token}" if token else ""
            complain(f"listening on 127.0.0.1:{server.getsockname()[1]}{words}")
            client, _ = server.accept()
            while not token and not _is_own(client):
                client.close()
                complain("a client of another user was sent away")
                client, _ = server.accept()
    except OSError as error:
        raise BadInput("--listen", str(port), str(error.strerror), "choose another port") from None
    with client, client.makefile("wb") as sink:
        return _serve(Wire(client.makefile("rb"), sink), token)


def _is_own(client: socket.socket) -> bool:
    """True if the other end of a connection within this machine belongs to the user of this process."""
    try:
        ends = [_written(*end) for end in (client.getpeername(), client.getsockname())]
        rows = [line.split() for line in _TCP.read_text().splitlines()[1:]]
    except OSError:  # it has gone already
        return False
    own = [row for row in rows if row[1:3] == ends and int(row[7]) == os.getuid()]
    return any(row[9] != "0" for row in own)  # inode 0: nobody's any more, and listed as root's


def _written(host: str, port: int) -> str:
    """An address as the system's table has it: the bytes of the host as a number of this machine."""
    return f"{int.from_bytes(socket.inet_aton(host), sys.byteorder):08X}:{port:04X}"


def _serve(wire: Wire, token: str = "") -> int:
    """Serves one client until it disconnects."""
    adapter = Adapter(wire, token)
    with suppress(OSError):
        adapter.serve()
    if not adapter.ended:
        complain("the client has gone")
    return DONE


def _interact(console: Console) -> int:
    """Commands from standard input, with history and completion where it is a terminal."""
    terminal = _stdin("give commands by -x").isatty()
    if not terminal:
        console.prompt = console.completekey = ""
    with history_kept() if terminal else nullcontext():
        while not console.ended:
            try:
                console.cmdloop()
            except KeyboardInterrupt:
                if not terminal:
                    raise
                complain("interrupted; `quit` leaves")
    return DONE if console.done or terminal else BAD_INPUT


def _stdin(remedy: str) -> TextIO:
    if sys.stdin is None:
        raise BadInput("", "stdin", "is closed", remedy)
    return sys.stdin
