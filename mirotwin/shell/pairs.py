"""A table of names and what belongs to each, printed without `rich`, which takes a tenth of a short run to load."""

import os
import shutil
import sys
from textwrap import wrap

import click

from miro_exact.bad_input import one_line

PIPE_COLUMNS = 200
LEAST_COLUMNS = 20
"""Of the texts, on a terminal that is too narrow."""
BOLD, END = "\x1b[1m", "\x1b[0m"


class Pairs:
    """Rows of a name, bold on a terminal, and a text, which goes on below itself where it is longer than a line."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, str]] = []

    def add_row(self, name: str, text: str) -> None:
        self.rows.append((name, one_line(text)))

    def show(self) -> None:
        """Prints the rows on stdout."""
        indent = 2 + max(len(name) for name, _ in self.rows)
        terminal = sys.stdout.isatty()
        columns = shutil.get_terminal_size().columns if terminal else PIPE_COLUMNS
        bold, end = (
            (BOLD, END) if terminal and os.environ.get("TERM") not in ("dumb", "unknown") else ("", "")
        )
        for name, text in self.rows:
            lines = wrap(text, max(columns - indent, LEAST_COLUMNS), break_on_hyphens=False)
            below = ("\n" + " " * indent).join(lines)
            click.echo(f"{bold}{name}{end}{' ' * (indent - len(name))}{below}".rstrip(" "))
