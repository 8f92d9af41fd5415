"""The output of a command: tables and text, on a terminal or in a pipe."""

import sys
from collections.abc import Iterable
from typing import Any

import click
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from miro_exact.bad_input import one_line

PIPE_COLUMNS = 200


class _Plain(Console):
    """A console for text of others: each string (a cell of a table, too) is one line without control characters."""

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(one_line(text), **options)


def plain_table(*names: str, right: Iterable[str] = (), bold: bool = False, **style: Any) -> Table:
    """A table without lines, with these columns, each in this style, and those of numbers at the `right`."""
    table = Table(box=None, pad_edge=False)
    for index, name in enumerate(names):
        table.add_column(name, style="bold" if bold and not index else None, **style)
    for name in right:
        table.add_column(name, justify="right")
    return table


def facts_table() -> Table:
    """A table of names and a text for each."""
    table = plain_table("", "", bold=True)
    table.show_header = False
    return table


def show(*results: RenderableType) -> None:
    """Prints results on stdout. No line of text is folded; tables in a file or a pipe are not padded.

    In a narrow terminal a word that is too long for its column is folded, not cut: it may be a digest or a name.
    """
    for result in results:
        whole = isinstance(result, str)  # a path is one word, however long
        if isinstance(result, Table):
            for column in result.columns:
                column.overflow = "fold"
        if sys.stdout.isatty():
            _Plain(highlight=False, markup=False).print(result, soft_wrap=whole)
            continue
        console = _Plain(highlight=False, markup=False, width=PIPE_COLUMNS)
        with console.capture() as capture:
            console.print(result, soft_wrap=whole)
        click.echo("\n".join(line.rstrip(" ") for line in capture.get().split("\n")), nl=False)
