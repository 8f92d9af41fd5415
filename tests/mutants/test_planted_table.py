"""Every planted mistake can be planted into the present source, builds, is no other mistake, and breaks a rule."""

import pytest

from tests.mutants.build import build
from tests.mutants.draw import source_files
from tests.mutants.judge import judged
from tests.mutants.planted import PLANTED, Planted
from tests.mutants.sdcc import needs_sdcc

SOURCES = source_files()
BREAKS = {
    **dict.fromkeys(("stops 15 ms late", "stops 1 ms late", "stops 2 ms early", "never stops"), "P29"),
    **dict.fromkeys(("goes off 100 ms late", "goes off 20 ms late"), "P32"),
    **dict.fromkeys(("stale frames feed the failsafe", "garbage feeds the failsafe"), "P30"),
    **dict.fromkeys(("never takes an old host back", "takes a host back after 160 ms"), "P18"),
    **dict.fromkeys(("does not cut off", "does not cut off backwards"), "P26"),
    **dict.fromkeys(("swaps the wheels", "takes the velocities of the robot before it"), "P22"),
    **dict.fromkeys(("answers every question", "answers frames that ask nobody"), "P43"),
    **dict.fromkeys(("never answers", "answers in another robot's turn"), "P41"),
    "stops by opening the loops": "P31",
    "milliseconds that come together count once": "P30",
    "acts on a frame that is repeated": "P20",
    "takes step 0 for fresh": "P17",
    "takes any other step for fresh": "P17",
    "keeps its memory over a reset": "P55",
    "takes frames with a bad CRC": "P08",
    "begins the CRC without the layout byte": "P24",
    "takes frames of another layout too": "P06",
    "looks at one character less": "P09",
    "does not empty the window": "P12",
    "does not look at spacings": "P10",
    "takes gaps of 90 us": "P10",
    "takes bad stop bits": "P09",
    "loses sync for good after a bad CRC": "P14",
    "does not count damaged frames": "P49",
    "counts stale frames as accepted": "P48",
    "compares velocities without their sign": "P25",
    "drives backward velocities forward": "P25",
    "starts the wheels one by one": "P27",
    "obeys service frames of other robots": "P38",
    "acts on opcodes that it does not know": "P39",
    "stops for a service frame": "P34",
    "drives by a frame of type 2": "P40",
    "changes the acceleration in motion": "P37",
    "answers with another number": "P41",
    "does not whiten its answers": "P42",
    "tells the upper half of positions": "P47",
    "tells what happened again and again": "P45",
    "writes while a chip is busy": "P51",
    "stays in an interrupt": "P52",
    "pushes for ever": "P53",
}
"""A rule of `mirotwin conform` that each of them breaks."""


@pytest.mark.parametrize("name", PLANTED)
def test_a_mistake_applies_to_the_present_source_and_says_what_it_breaks(name):
    one = PLANTED[name]
    assert one.applied(SOURCES[one.file]) != SOURCES[one.file]
    assert one.breaks.endswith(".")
    assert "\n" not in one.breaks


def test_no_two_mistakes_have_a_name_or_a_source_in_common():
    made = {(one.file, one.applied(SOURCES[one.file])) for one in PLANTED.values()}
    assert len(made) == len(PLANTED) >= 15


@pytest.mark.parametrize("text", ["", "x; x;"])
def test_a_text_that_does_not_stand_there_once_is_refused(text):
    with pytest.raises(ValueError, match=r"^late: a\.c has [02] times 'x;', wanted once$"):
        Planted("late", "a.c", "x;", "y;", "").applied(text)


@needs_sdcc
def test_every_mistake_builds_to_an_image_of_its_own():
    built = [build({one.file: one.applied(SOURCES[one.file])}) for one in PLANTED.values()]
    assert [one.error for one in built] == [""] * len(PLANTED)
    images = {one.image.read_bytes() for one in built}
    assert len(images) == len(PLANTED)
    assert not any(one.is_shipped for one in built)


def test_a_rule_is_known_for_every_mistake():
    assert set(BREAKS) == set(PLANTED)


@needs_sdcc
@pytest.mark.parametrize("name", PLANTED)
def test_a_mistake_breaks_its_rule(name):
    one = PLANTED[name]
    built = build({one.file: one.applied(SOURCES[one.file])})
    assert judged(built.image, (BREAKS[name],)).rules == (BREAKS[name],)
