"""A record of options is the parser, the defaults and the line that gives the command again; times have their unit."""

import os
import shlex
import shutil
from fractions import Fraction
from pathlib import Path
from typing import Annotated

import click
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.times import UNITS_S
from mirotwin.shell.command import Argument, Option, Options, command_line, command_of
from mirotwin.shell.options import NAME, PATH, Whole
from mirotwin.shell.times import Time, TimeType, wall_time
from tests import children


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


@pytest.mark.parametrize(
    ("text", "ticks"),
    [
        ("2s", 48_000_000),
        ("20ms", 480_000),
        ("341us", 8184),
        ("5min", 7_200_000_000),
        ("1h", 86_400_000_000),
        ("48000t", 48_000),
        (".5s", 12_000_000),
        ("1.5 s", 36_000_000),
        ("0t", 0),
    ],
)
def test_a_time_is_a_number_with_its_unit(text, ticks):
    assert TimeType().convert(text, None, None).ticks() == ticks


def test_ticks_are_those_of_the_crystal_that_drives_the_program():
    assert TimeType().convert("1s", None, None).ticks(11_059_200) == 11_059_200
    assert TimeType().convert("11059200t", None, None).seconds(11_059_200) == 1.0


@pytest.mark.parametrize(
    "text",
    ["1", "0", "1.2", "1.t", "1.5t", "-1s", "1e3s", "nans", "2 sec", "", "s", "\u0661s", "9" * 5000 + "s"],
)
def test_anything_else_is_refused_with_both_spellings(text):
    with pytest.raises(click.BadParameter) as refused:
        TimeType().convert(text, None, None)
    assert "ticks" in refused.value.message
    assert len(refused.value.message) < 700


@given(st.integers(0, 10**9), st.sampled_from(sorted(UNITS_S)))
def test_whatever_was_read_is_exact(number, unit):
    wanted = number * UNITS_S[unit]
    if wanted > 10**9:
        with pytest.raises(click.BadParameter, match="too long"):
            TimeType().convert(f"{number}{unit}", None, None)
    else:
        assert TimeType().convert(f"{number}{unit}", None, None).value == Fraction(wanted)


def test_the_wall_clock_has_no_ticks():
    assert wall_time(100.0).convert("1min", None, None) == 60.0
    for text in ("5t", "5", "101s", "0s"):
        with pytest.raises(click.BadParameter) as refused:
            wall_time(100.0).convert(text, None, None)
        assert "ticks" not in refused.value.message


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize("name", [b"f\xff", b"\xff1 'a'\\", b"a b", "ä".encode(), b"\xfe\n"])
def test_a_command_to_copy_names_the_same_file_also_where_its_name_is_not_utf8(name):
    line = command_line("replay", os.fsdecode(name))
    assert line.isprintable()
    done = children.run(
        ["bash", "-c", f'mirotwin() {{ printf %s "$2"; }}; {line}'], capture_output=True, check=True
    )
    assert done.stdout == name
