"""A record of options is the parser, the defaults and the line that gives the command again."""

import shlex
from pathlib import Path
from typing import Annotated

import click
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.options import NAME, PATH, Whole
from mirotwin.shell.times import Time, TimeType


class WindowOptions(Options, frozen=True, kw_only=True):
    to: Annotated[Time | None, Option(type=TimeType(), help="End there.", heading="Window")] = None
    wide: Annotated[bool, Option(help="Wider.", heading="Window", needs="to")] = False


class LookOptions(Options, frozen=True, kw_only=True):
    COMMAND = "camera look"
    file: Annotated[str, Argument("FILE", NAME)]
    out: Annotated[Path | None, Option("-o", "--out", type=PATH, help="File to write.")] = None
    number: Annotated[int, Option(type=Whole(0), help="How many.")] = 0
    settings: Annotated[tuple[str, ...], Option("--set", help="A key.")] = ()
    window: WindowOptions = WindowOptions()
    live: Annotated[str | None, Option(help="Watch.", alone="here")] = None
    quiet: Annotated[bool, Option("-q", "--quiet", help="No lines.", apart="live")] = False


taken = []


@command_of(LookOptions)
def look(options):
    """Looks.

    At FILE.
    """
    taken.append(options)


def run(*words):
    taken.clear()
    return CliRunner().invoke(look, words, catch_exceptions=False)


def test_a_command_gets_its_options_as_one_record():
    assert run("a.mcap", "--number", "7", "--set", "a=1", "--set", "b=2", "-q").exit_code == 0
    assert taken == [LookOptions(file="a.mcap", number=7, settings=("a=1", "b=2"), quiet=True)]


def test_what_is_not_given_has_the_default_of_the_record():
    run("a.mcap")
    assert taken == [LookOptions(file="a.mcap")]


def test_a_record_within_stands_for_its_options():
    run("a.mcap", "--to", "20ms", "--wide")
    assert taken[0].window.to.ticks() == 480_000
    assert taken[0].window.wide


def test_an_option_may_be_given_without_its_value():
    run("a.mcap", "--live")
    assert taken[0].live == "here"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--wide",), "--wide needs --to."),
        (("-q", "--live=there"), "--quiet does not go with --live."),
        (("--number", "x"), "'x' is not a whole number."),
    ],
)
def test_options_that_do_not_go_together_are_refused(words, said):
    done = run("a.mcap", *words)
    assert done.exit_code == 2
    assert said in done.output
    assert taken == []


def test_the_line_has_only_what_differs_from_the_defaults():
    assert LookOptions(file="a.mcap", number=0).command_line() == "mirotwin camera look a.mcap"
    assert LookOptions(file="a b", out=Path("-o.png"), settings=("x='1'",)).command_line() == (
        """mirotwin camera look 'a b' --out ./-o.png --set 'x='"'"'1'"'"''"""
    )


def test_the_help_shows_options_below_their_heading():
    said = run("--help").output
    assert said.split("\n\n")[1:3] == ["  Looks.", "  At FILE."]
    options, window = said.split("Options:\n")[1].split("Window:\n")
    assert "--number N" in options
    assert "[default: 0; x>=0]" in options
    assert [line.split()[0] for line in window.splitlines()] == ["--to", "--wide"]


def test_what_was_given_can_be_named():
    options = LookOptions(file="a", quiet=True, window=WindowOptions(wide=True))
    assert options.given("wide", "quiet", "number") == ["--wide", "--quiet"]


texts = st.text(st.sampled_from("a-/. ='\"\\$;*\n\u00e9"), min_size=1)


@given(
    file=texts,
    out=st.none() | texts.map(Path),
    number=st.integers(0, 99),
    settings=st.lists(texts).map(tuple),
    ticks=st.none() | st.integers(0, 9999),
    live=st.none() | texts.filter(lambda text: not text.startswith("-")),  # click takes no such value
    quiet=st.booleans(),
)
def test_the_line_gives_the_same_options_again(file, out, number, settings, ticks, live, quiet):
    to = None if ticks is None else TimeType().convert(f"{ticks}t", None, None)
    options = LookOptions(
        file=file,
        out=out,
        number=number,
        settings=settings,
        window=WindowOptions(to=to, wide=to is not None),
        live=live,
        quiet=quiet and live is None,
    )
    words = shlex.split(options.command_line())[3:]
    taken.clear()
    look.main(words, "look", standalone_mode=False)
    again = taken[0]
    assert again.file in (file, f"./{file}")
    assert again.out in (out, None if out is None else Path(f"./{out}"))
    assert again == LookOptions(**{**_values(options), "file": again.file, "out": again.out})


def _values(options):
    return {name: getattr(options, name) for name in options.__struct_fields__}


def test_a_command_is_called_as_its_function():
    assert isinstance(look, click.Command)
    assert look.name == "look"
