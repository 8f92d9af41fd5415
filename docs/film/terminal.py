"""Commands in a pseudo terminal, and the lines that they print there.

Codes other than those of lines and progress bars are refused.
"""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

SHIM = f"#!/bin/sh\nexec '{sys.executable}' -c 'from mirotwin.entry import main; main()' \"$@\"\n"
"""The `mirotwin` of this Python, whichever stands first on the path."""
ESCAPE = "\x1b"
TOKEN = re.compile(r"\x1b\[\??[\d;]*[A-Za-z]|[\s\S]")
STYLE = re.compile(r"\x1b\[([\d;]*)m")
BOLD = {"": False, "0": False, "1": True, "22": False}
"""Other styles, colours above all, are not shown."""
ERASE_LINE = "\x1b[2K"
CURSOR_UP = re.compile(r"\x1b\[(\d*)A")
CURSOR = ("\x1b[?25l", "\x1b[?25h")
"""Hides the cursor and shows it again."""


class Run(NamedTuple):
    """Characters of one kind."""

    text: str
    bold: bool


Line = tuple[Run, ...]


def text_of(line: Line) -> str:
    """Without its style."""
    return "".join(run.text for run in line)


def recorded(commands: Sequence[str], columns: int, rows: int) -> list[list[Line]]:
    """The lines that each command prints, in one new folder, one after the other."""
    with tempfile.TemporaryDirectory(prefix="mirotwin-film-") as name:
        folder = Path(name)
        programs = folder / ".bin"
        programs.mkdir()
        shim = programs / "mirotwin"
        shim.write_text(SHIM, encoding="utf-8")
        shim.chmod(0o755)
        return [_lines(_output(command, folder, programs, columns, rows), columns) for command in commands]


def _output(command: str, folder: Path, programs: Path, columns: int, rows: int) -> str:
    """All that a command writes to its terminal."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "CI")}
    environment |= {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "TERM": "xterm",
        "LC_ALL": "C.UTF-8",
    }
    started = subprocess.Popen(
        ["sh", "-c", command], cwd=folder, env=environment, stdin=theirs, stdout=theirs, stderr=theirs
    )
    os.close(theirs)
    found = b"".join(_read(ours))
    os.close(ours)
    started.wait()
    return found.decode("utf-8")


def _read(terminal: int) -> Iterator[bytes]:
    """Until all programs have closed the terminal, which Linux reports as an error."""
    while True:
        try:
            part = os.read(terminal, 1 << 16)
        except OSError:
            return
        if not part:
            return
        yield part


def _lines(output: str, columns: int) -> list[Line]:
    """Lines of at most so many characters, as a terminal breaks them. Raises ValueError for an unknown code."""
    found: list[Line] = []
    for row in _rows(output):
        while row and not row[-1].text.strip():
            row.pop()
        found += [_joined(row[at : at + columns]) for at in range(0, len(row) or 1, columns)]
    return found


def _rows(output: str) -> list[list[Run]]:
    """What stands in each row at the end: a progress bar has been there and is gone."""
    rows: list[list[Run]] = [[]]
    at, column, bold = 0, 0, False
    for token in TOKEN.findall(output):
        if token == "\n":
            at, column = at + 1, 0
            rows += [[] for _ in range(at + 1 - len(rows))]
        elif token == "\r":
            column = 0
        elif style := STYLE.fullmatch(token):
            bold = BOLD.get(style[1], bold)
        elif token == ERASE_LINE:
            rows[at] = []
        elif up := CURSOR_UP.fullmatch(token):
            at -= int(up[1] or 1)
        elif token[0] != ESCAPE:
            row = rows[at]
            row += [Run(" ", False)] * (column - len(row))
            row[column : column + 1] = [Run(token, bold)]
            column += 1
        elif token not in CURSOR:
            raise ValueError(f"a code that is not shown: {token!r}")
    return rows if rows[-1] else rows[:-1]


def _joined(characters: Sequence[Run]) -> Line:
    """Neighbours of one kind as one run."""
    runs: list[Run] = []
    for one in characters:
        if runs and runs[-1].bold == one.bold:
            runs[-1] = Run(runs[-1].text + one.text, one.bold)
        else:
            runs.append(one)
    return tuple(runs)
