"""Tables of names and texts: aligned, below themselves where they are long, bold on a terminal alone."""

import os
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mirotwin.shell.pairs import BOLD, END, PIPE_COLUMNS, Pairs
from tests import children


def shown(capsys, *rows):
    table = Pairs()
    for row in rows:
        table.add_row(*row)
    capsys.readouterr()
    table.show()
    return capsys.readouterr().out


def on_terminal(monkeypatch, columns, term):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("TERM", term)


def test_texts_stand_below_each_other_without_spaces_at_their_end(capsys):
    assert (
        shown(capsys, ("digest", "ab cd"), ("time", "6.01 s"), ("", ""))
        == "digest  ab cd\ntime    6.01 s\n\n"
    )


def test_what_strangers_wrote_is_one_line_without_control_characters(capsys):
    assert shown(capsys, ("set", "a\nb\x1b[2J")) == "set  a\\nb\\x1b[2J\n"


WORDS = st.lists(st.text("abc./-", min_size=1, max_size=30), min_size=1, max_size=40).map(" ".join)


@settings(max_examples=50)
@given(WORDS)
def test_a_long_text_goes_on_below_itself(text):
    with pytest.MonkeyPatch.context() as patch:
        lines = []
        patch.setattr("click.echo", lines.append)
        table = Pairs()
        table.add_row("name", text)
        table.show()
    first, *more = lines[0].split("\n")
    assert all(len(line) <= PIPE_COLUMNS for line in (first, *more))
    assert all(line.startswith(" " * 6) for line in more)
    assert " ".join([first[6:], *(line[6:] for line in more)]) == text


def test_names_are_bold_on_a_terminal_and_texts_as_wide_as_it_is(capsys, monkeypatch):
    on_terminal(monkeypatch, 26, "xterm")
    name = f"{BOLD}digest{END}"
    assert (
        shown(capsys, ("digest", "0123456789 abcdef ghijkl"))
        == f"{name}  0123456789 abcdef\n        ghijkl\n"
    )
    on_terminal(monkeypatch, 26, "dumb")
    assert shown(capsys, ("digest", "ab")) == "digest  ab\n"


def test_a_run_prints_its_table_without_the_library_for_bars_and_tables(tmp_path):
    script = (
        "import sys\nfrom mirotwin.commands import main\n"
        "try:\n    main(sys.argv[1:])\n"
        "finally:\n    print('loaded:', *sorted(sys.modules), file=sys.stderr)\n"
    )
    arguments = ["run", "silent", "--no-figure", "--to", "40ms", "--out", os.fspath(tmp_path / "out")]
    done = children.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("scenario  silent, seed 0\n")
    assert "rich" not in done.stderr.rpartition("loaded: ")[2].split()
