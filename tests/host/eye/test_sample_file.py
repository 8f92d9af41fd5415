"""Sampled pixels from a file: both kinds of columns, and what is refused."""

import pytest

from miro_host.eye.eye_file import EyeError
from miro_host.eye.sample_file import parse_samples


def test_samples_are_collected_by_colour():
    text = "colour,y,cb,cr\nyellow,200,40,140\nblue, 60 ,190,110\nyellow,201,41,141\n\n"
    assert parse_samples(text, "s.csv") == {
        "yellow": [(200, 40, 140), (201, 41, 141)],
        "blue": [(60, 190, 110)],
    }


def test_red_green_and_blue_become_luma_and_chroma():
    found = parse_samples("colour,r,g,b\na,255,255,255\nb,0,0,0\nc,255,0,0\nd,0,0,255\n", "s.csv")
    assert found["a"] == [(255, 128, 128)]
    assert found["b"] == [(0, 128, 128)]
    assert found["c"] == [(77, 85, 255)]
    assert found["d"] == [(29, 255, 107)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "s.csv:1: the columns are "),
        ("name,r,g,b\n", "the columns are name, r, g, b; they must be colour, r, g, b or colour, y, cb, cr"),
        ("colour,r,g,b\nyellow,1,2\n", "s.csv:2: 3 cells; a line must have 4"),
        ("colour,r,g,b\nyellow,1,2,256\n", "s.csv:2: '256' is no level; write whole numbers from 0 to 255"),
        ("colour,r,g,b\nyellow,1,2,nan\n", "'nan' is no level"),
        ("colour,r,g,b\nyellow,1,-2,3\n", "'-2' is no level"),
        ("colour,r,g,b\nyellow,1,2," + "9" * 5000 + "\n", "is no level"),
        ("colour,r,g,b\n" + "y" * 200_000 + ",1,2,3\n", "s.csv:2: is no CSV"),
    ],
)
def test_what_is_no_sample_is_named_with_its_line(text, said):
    with pytest.raises(EyeError) as caught:
        parse_samples(text, "s.csv")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
