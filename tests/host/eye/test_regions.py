"""Regions: the hot module, its source and a flood fill agree on any window; and their centroids, weighted by chroma."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.eye import regions as hot
from miro_host.eye.regions import TABLE_SIZE, Regions
from miro_host.eye.weighing import Weighing
from tests.exact.uncompiled import uncompiled
from tests.example_count import examples
from tests.naive import regions as naive

TABLE = bytes(cell >> 12 & 3 for cell in range(TABLE_SIZE))  # the class is two bits of Y
HOT, SOURCE = Regions(TABLE), uncompiled(hot).Regions(TABLE)
KINDS = {".": 0, "a": 1, "b": 2, "c": 3}


def window(*rows):
    pixels = bytearray()
    for row in rows:
        for letter in row:
            pixels += bytes((16 * KINDS[letter], 128, 128))
    return pixels, len(rows[0]), len(rows)


def found(regions, pixels, width, height):
    return [tuple(regions.region(index)) for index in range(regions.find(pixels, width, height))]


@st.composite
def windows(draw):
    width, height = draw(st.integers(1, 20)), draw(st.integers(1, 20))
    letters = draw(st.sampled_from(["a.", "ab", "aab.", "abc."]))
    rows = draw(st.lists(st.text(letters, min_size=width, max_size=width), min_size=height, max_size=height))
    return window(*rows)


@examples(300)
@given(windows())
def test_any_window_has_the_regions_that_a_flood_fill_finds(drawn):
    expected = [tuple(region) for region in naive.regions(TABLE, *drawn)]
    assert found(HOT, *drawn) == expected
    assert found(SOURCE, *drawn) == expected


def test_the_largest_window_of_single_pixels_fits():
    rows = ["ab" * 32, "ba" * 32] * 32
    assert len(found(HOT, *window(*rows))) == 4096


def test_regions_that_touch_by_a_corner_stay_apart():
    assert [region[1] for region in found(HOT, *window("aa..", "aa..", "..aa", "..aa"))] == [4, 4]


def test_arms_that_meet_further_down_are_one_region():
    [region] = found(HOT, *window("a.a.a", "a.a.a", "aaaaa"))
    assert region == (1, 11, 0, 0, 5, 3, 55, 37, True)


def test_centroids_are_in_pixels_whose_centre_is_a_half():
    HOT.find(*window("....", ".aa.", "....", "...."))
    assert HOT.centroid(0) == (2.0, 1.5)
    assert HOT.region(0).touches is False


@pytest.mark.parametrize(("width", "height"), [(0, 4), (65, 64), (4097, 1), (-4, -4), (1 << 20, 1 << 20)])
def test_a_window_without_pixels_or_with_too_many_is_refused(width, height):
    for regions in (HOT, SOURCE):
        with pytest.raises(ValueError, match="it must have 1 to 4096"):
            regions.find(bytearray(12), width, height)


def test_bytes_that_are_not_the_window_and_tables_of_another_size_are_refused():
    with pytest.raises(ValueError, match="11 bytes are not 2 x 2 pixels of 3"):
        HOT.find(bytearray(11), 2, 2)
    with pytest.raises(ValueError, match="has 16 entries, not 65536"):
        Regions(bytes(16))


def test_a_region_that_is_not_there_is_refused():
    HOT.find(*window("a."))
    for ask in (HOT.region, HOT.centroid):
        with pytest.raises(IndexError, match="region 1 of 1"):
            ask(1)


YELLOW, LIME, GREEN = (-1490, 400), (-1250, -320), (-420, -990)
FLOOR = (-80, -320)


def of(chroma, share=1.0):
    return tuple(round(128 + share * part / 16) for part in chroma)


def test_a_patch_weighs_what_the_floor_has_less():
    weighing = Weighing(YELLOW, GREEN, FLOOR)
    team, identity = weighing.weight(0, *of(YELLOW)), weighing.weight(1, *of(GREEN))
    assert team == pytest.approx(256 - 40, abs=4)
    assert 150 < identity < 200  # a green floor takes a third


@pytest.mark.parametrize("identity", [LIME, GREEN])
def test_floor_and_black_weigh_nothing(identity):
    weighing = Weighing(YELLOW, identity, FLOOR)
    for which in (0, 1):
        assert weighing.weight(which, 128, 128) == weighing.weight(which, *of(FLOOR)) == 0


def test_half_of_a_patch_weighs_less_and_no_pixel_more_than_one_and_a_half():
    weighing = Weighing(YELLOW, LIME)
    whole, half = weighing.weight(0, *of(YELLOW)), weighing.weight(0, *of(YELLOW, 0.5))
    assert 0 < half < 0.5 * whole
    assert Weighing((160, 0), LIME).weight(0, 255, 128) == 384


def test_a_colour_without_chroma_is_refused():
    with pytest.raises(ValueError, match="without chroma"):
        Weighing((0, 0), LIME)


def test_the_other_patch_does_not_pull_and_symmetric_patches_have_their_middle():
    """Two squares of 8 pixels side by side, 1 between them, on grey."""
    pixels = bytearray((100, 128, 128) * 32 * 32)
    for left, chroma in ((7, YELLOW), (16, LIME)):
        for row in range(12, 20):
            for column in range(left, left + 8):
                at = 3 * (32 * row + column)
                pixels[at + 1 : at + 3] = bytes(of(chroma))
    table = bytearray(TABLE_SIZE)
    for kind, chroma in ((1, YELLOW), (2, LIME)):
        cb, cr = of(chroma)
        for luma in range(16):
            table[luma << 12 | (cb >> 2) << 6 | cr >> 2] = kind
    regions, weighing = Regions(bytes(table)), Weighing(YELLOW, LIME, (0, 0))
    assert regions.find(pixels, 32, 32) == 2
    weighing.centroids(pixels, regions, 0, 1, 20)
    assert weighing.centroid(0) == (11.0, 16.0)
    assert weighing.centroid(1) == (20.0, 16.0)
