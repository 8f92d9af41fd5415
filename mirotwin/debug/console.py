"""The line console of the debugger: lines that are typed or given, with history and completion."""

from __future__ import annotations

import os
import signal
from cmd import Cmd
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.session import Session
from mirotwin.debug.verbs import completions, do
from mirotwin.shell.program import complain, show_line

_MOST_LINES = 1000


class Console(Cmd):
    """Does commands. `done`: whether all could be done; `interrupted`: Ctrl-C ended the last one."""

    prompt = "(mirotwin) "

    def __init__(self, debugger: Debugger) -> None:
        super().__init__()
        self.session = Session(debugger)
        self.done = True
        self.interrupted = False
        self.last = ""

    @property
    def ended(self) -> bool:
        return self.session.ended

    def onecmd(self, line: str) -> bool:
        """Runs one line, or repeats the last step for an empty line, and shows the result.

        Returns True after the last line. Ctrl-C stops a search at its present place.
        """
        stopped: list[int] = []
        before = signal.signal(signal.SIGINT, lambda number, frame: stopped.append(number))
        words = "quit" if line == "EOF" else line.strip() or self.last
        try:
            with self.session.timeline.shown(words, lambda: bool(stopped)):
                verb = do(self.session, words)
                again = words.split()[0] if verb is not None and verb.has_form else words
                self.last = again if verb is not None and verb.repeats else ""
        except BadInput as error:
            complain(f"error: {error}")
            self.done = False
        finally:
            signal.signal(signal.SIGINT, before)
            self.interrupted = bool(stopped)
            for output in self.session.lines:
                show_line(output)
        return self.ended

    def postcmd(self, stop: bool, line: str) -> bool:
        """Drops the rest of a list of commands after Ctrl-C; an interactive user continues."""
        if self.interrupted and not self.prompt:
            raise KeyboardInterrupt
        return stop

    def completedefault(self, text: str, line: str, begin: int, end: int) -> list[str]:
        """Completions of the `text` from `begin` on."""
        first, words = completions(self.session, line[:end])
        return [
            line[begin:first] + word[max(begin - first, 0) :] for word in words
        ]  # readline cuts words elsewhere

    completenames = completedefault


@contextmanager
def history_kept() -> Iterator[None]:
    """Within it the lines of earlier sessions can be gone back to; those of this one are added to them."""
    try:
        import readline
    except ImportError:  # Windows
        yield
        return
    given = Path(os.environ.get("XDG_STATE_HOME", ""))
    folder = given if given.is_absolute() else Path.home() / ".local" / "state"
    file = folder / "mirotwin" / "debug_history"
    with suppress(OSError):
        readline.read_history_file(file)
    readline.set_history_length(_MOST_LINES)
    readline.set_completer_delims(" \t\n()[]!&|^<>=+*/%,")
    try:
        yield
    finally:
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            readline.write_history_file(file)
