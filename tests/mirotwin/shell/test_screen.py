"""What commands show on a terminal and in a pipe: lines, tables, and a bar for people who wait."""

import io
import sys

import pytest
from rich.table import Table

from mirotwin.shell import progress
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.progress import ProgressBar

LINE = "written to " + "/a folder with a long name" * 12 + "/out.vcd"


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


def shown(monkeypatch, kind=Screen, columns=80):
    """Where the program says everything from now on."""
    out = kind()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", out)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", f"{columns}")
    return out


@pytest.mark.parametrize("kind", [io.StringIO, Screen])
def test_a_line_of_text_is_not_folded_however_long(kind, monkeypatch):
    out = shown(monkeypatch, kind)
    show(LINE)
    assert out.getvalue() == f"{LINE}\n"


def test_a_narrow_terminal_folds_a_long_word_and_cuts_nothing(monkeypatch):
    screen = shown(monkeypatch, columns=40)
    table = plain_table("name", "value")
    table.add_row("digest", "0123456789abcdef" * 4)
    show(table)
    assert "".join(screen.getvalue().split()).endswith("digest" + "0123456789abcdef" * 4)


def test_a_table_in_a_pipe_is_not_folded_at_80_columns_nor_padded(monkeypatch):
    out = shown(monkeypatch, io.StringIO)
    table = Table("name", "value", box=None)
    table.add_row("a" * 100, "1")
    show(table)
    assert out.getvalue().splitlines()[1].strip() == "a" * 100 + "  1"
    assert not any(line.endswith(" ") for line in out.getvalue().splitlines())


@pytest.mark.parametrize(
    ("kind", "patience_s", "quiet", "drawn"),
    [
        pytest.param(Screen, 0.0, False, True, id="after a while"),
        pytest.param(Screen, 60.0, False, False, id="soon over"),
        pytest.param(io.StringIO, 0.0, False, False, id="no terminal"),
        pytest.param(Screen, 0.0, True, False, id="quiet"),
    ],
)
def test_a_bar_is_drawn_for_people_who_wait(monkeypatch, kind, patience_s, quiet, drawn):
    screen = shown(monkeypatch, kind)
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", patience_s)
    with ProgressBar("simulating", 10, quiet) as bar:
        for done in range(10):
            bar.to(done)
    assert ("simulating" in screen.getvalue()) == bool(screen.getvalue()) == drawn


def test_what_is_counted_is_shown_with_its_rate_and_the_time_left(monkeypatch):
    screen = shown(monkeypatch, columns=120)
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", 0.0)
    now_s = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s[0])
    with ProgressBar("noise.toml", 1000, unit="runs") as bar:
        bar.begun = 200
        now_s[0] += 10.0
        bar.to(240)
    assert "4.0 runs/s, 0:03:10 left" in screen.getvalue()
