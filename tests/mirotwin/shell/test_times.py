"""Times on the command line have their unit, everywhere the same ones."""

from fractions import Fraction

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.shell.times import UNITS_S, TimeType, wall_time


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
