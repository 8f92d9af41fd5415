"""What commands print on stdout, on a terminal and in a pipe."""

import io
import sys

import pytest
from rich.table import Table

from mirotwin.shell.console import plain_table, show

LINE = "written to " + "/a folder with a long name" * 12 + "/out.vcd"


class Terminal(io.StringIO):
    """80 columns wide."""

    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_a_line_of_text_is_not_folded_however_long(stream, monkeypatch):
    out = stream()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setenv("COLUMNS", "80")
    show(LINE)
    assert out.getvalue() == f"{LINE}\n"


def test_a_narrow_terminal_folds_a_long_word_and_cuts_nothing(monkeypatch):
    monkeypatch.setattr(sys, "stdout", out := Terminal())
    monkeypatch.setenv("COLUMNS", "40")
    table = plain_table("name", "value")
    table.add_row("digest", "0123456789abcdef" * 4)
    show(table)
    assert "".join(out.getvalue().split()).endswith("digest" + "0123456789abcdef" * 4)


def test_a_table_in_a_pipe_is_not_folded_at_80_columns_nor_padded(monkeypatch):
    monkeypatch.setattr(sys, "stdout", out := io.StringIO())
    monkeypatch.setenv("COLUMNS", "80")
    table = Table("name", "value", box=None)
    table.add_row("a" * 100, "1")
    show(table)
    assert out.getvalue().splitlines()[1].strip() == "a" * 100 + "  1"
    assert not any(line.endswith(" ") for line in out.getvalue().splitlines())
