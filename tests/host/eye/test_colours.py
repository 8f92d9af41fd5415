"""Colour classes: from a file to samples, from samples to means, from means to the table."""

import pytest

from miro_host.eye import eye_file
from miro_host.eye.colours import CLASS_OF, ColourClasses, ColourMean, classes_of, parse_samples
from miro_host.eye.eye_file import EyeError
from miro_host.eye.patterns import COLOURS
from tests.naive.painted_frame import PAINTS, sampled, ycbcr

CLASSES = classes_of(sampled())


def of(rgb):
    y, cb, cr = (int(part) for part in ycbcr(rgb))
    return CLASSES.table[y >> 4 << 12 | cb >> 2 << 6 | cr >> 2]


@pytest.mark.parametrize("name", COLOURS)
def test_every_paint_has_its_class_also_in_dim_light(name):
    assert of(PAINTS[name]) == CLASS_OF[name]
    assert of([0.65 * part for part in PAINTS[name]]) == CLASS_OF[name]


@pytest.mark.parametrize("name", ["floor", "black"])
def test_floor_and_black_have_none(name):
    assert of(PAINTS[name]) == 0
    assert of((255, 255, 255)) == 0


def test_means_are_those_of_the_samples():
    samples = {"yellow": [(100, 60, 140), (102, 62, 144)] * 5, "blue": [(60, 200, 110)] * 4}
    found = classes_of(samples)
    assert found.colours["yellow"] == ColourMean(y=101.0, cb=61.0, cr=142.0, spread=2.25)
    assert found.floor is None


def test_classes_read_back_from_their_text_as_they_were():
    assert eye_file.parse(CLASSES.text(), ColourClasses, "colours.toml") == CLASSES


@pytest.mark.parametrize(
    ("samples", "said"),
    [
        ({}, "colours: there is no colour; sample"),
        ({"pink": [(100, 160, 190)] * 9}, "colours.pink: unknown colour; use yellow"),
        ({"yellow": [(100, 60, 140)] * 3}, "colours.yellow: 3 sampled pixels; sample at least 4"),
        ({"yellow": [(100, 130, 131)] * 9}, "colours.yellow: the samples are grey; sample inside"),
        (
            {"yellow": [(100, 60, 140), (100, 60, 152)] * 9, "orange": [(100, 62, 152)] * 9},
            "colours.orange: cannot be told from yellow: hues too near",
        ),
        (
            {"green": [(100, 100, 80)] * 9, "floor": [(60, 112, 100)] * 9},
            "colours.green: the floor has nearly the same colour; use another paint",
        ),
    ],
)
def test_samples_that_make_no_classes_are_refused_with_a_remedy(samples, said):
    with pytest.raises(EyeError) as caught:
        classes_of(samples, "samples.csv")
    assert f"{caught.value}".startswith("samples.csv: ")
    assert said in f"{caught.value}"


def test_a_file_with_overlapping_colours_is_refused_by_name():
    text = """
        [colours.yellow]
        y = 100
        cb = 60
        cr = 140
        [colours.lime]
        y = 100
        cb = 60
        cr = 140
    """
    with pytest.raises(EyeError, match=r"c\.toml: colours\.lime: cannot be told from yellow"):
        eye_file.parse(text, ColourClasses, "c.toml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a" + ".a" * 16 + " = 1\n", "colours.toml: line 1: a key of more than 16 parts; remove it"),
        ("# " + "x" * (513 << 10), "colours.toml: holds more than 512 KiB"),
        ("[colours.yellow]\ny = nan\n", "colours.yellow.y: nan is not a number that can be used"),
    ],
)
def test_a_text_that_would_take_minutes_or_holds_no_number_is_refused_at_once(text, said):
    with pytest.raises(EyeError) as caught:
        eye_file.parse(text, ColourClasses, "colours.toml")
    assert said in str(caught.value)


def test_samples_are_collected_by_colour():
    text = "colour,y,cb,cr\nyellow,200,40,140\nblue, 60 ,190,110\nyellow,201,41,141\n\n"
    assert parse_samples(text, "s.csv") == {
        "yellow": [(200, 40, 140), (201, 41, 141)],
        "blue": [(60, 190, 110)],
    }
    assert parse_samples("cr,colour,y,cb\n3,a,1,2\n", "s.csv") == {"a": [(1, 2, 3)]}


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
