"""`mirotwin debug`: a debugger that goes backwards, as a console or for an editor."""

from __future__ import annotations

import sys
from typing import Annotated

from miro_exact.bad_input import BadInput
from mirotwin.debug.console import PROMPT, Console
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.subject import DebugSubject, open_subject
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.options import AT
from mirotwin.shell.program import BAD_INPUT, DONE, complain, show_line
from mirotwin.shell.times import Time


class DebugOptions(DebugSubject, frozen=True, kw_only=True):
    COMMAND = "debug"
    at: Annotated[Time | None, AT.saying("Stand there first: 1.5s, 20ms or 48000t.")] = None
    commands: Annotated[
        tuple[str, ...],
        Option(
            "-x",
            metavar="COMMAND",
            help="Do this command of the console, and end behind the last; may be repeated.",
        ),
    ] = ()


@command_of(DebugOptions)
def debug(options: DebugOptions) -> int:
    """Steps through the firmware of SUBJECT, forwards and backwards.

    SUBJECT is a scenario, an image (on the bare processor), a recording, a stream file, or a case, which stands at its
    failed check.
    """
    session = open_subject(options)
    debugger = Debugger(session.timeline, session.symbols)
    console = Console(debugger)
    for line in session.said:
        show_line(line)
    if options.at is not None:
        console.say(debugger.go_to(options.at.ticks(session.timeline.run.tick_hz)))
    else:
        console.say("case" if session.said else "begin")
    if options.commands:
        for line in options.commands:
            show_line(f"{PROMPT}{line}")
            if not console.run(line):
                return BAD_INPUT
        return DONE
    return _interact(console)


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
        return ([one for one in sorted(set(words)) if one.startswith(text)] + [None])[state]

    readline.set_completer(offer)
    readline.parse_and_bind("tab: complete")
