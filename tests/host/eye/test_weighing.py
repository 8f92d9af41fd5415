"""Weights of pixels by their chroma."""

import pytest

from miro_host.eye.regions import TABLE_SIZE, Regions
from miro_host.eye.weighing import Weighing

YELLOW, LIME, GREEN = (-1490, 400), (-1250, -320), (-420, -990)
FLOOR = (-80, -320)


def of(chroma, share=1.0):
    return tuple(round(128 + share * part / 16) for part in chroma)


def test_a_patch_weighs_what_the_floor_has_less():
    weighing = Weighing(YELLOW, GREEN, FLOOR)
    team, _ = weighing.weights(*of(YELLOW))
    _, identity = weighing.weights(*of(GREEN))
    assert team == pytest.approx(256 - 40, abs=4)
    assert 150 < identity < 200  # a green floor takes a third


@pytest.mark.parametrize("identity", [LIME, GREEN])
def test_floor_and_black_weigh_nothing(identity):
    weighing = Weighing(YELLOW, identity, FLOOR)
    assert weighing.weights(128, 128) == (0, 0)
    assert weighing.weights(*of(FLOOR)) == (0, 0)


def test_half_of_a_patch_weighs_less_and_no_pixel_more_than_one_and_a_half():
    weighing = Weighing(YELLOW, LIME)
    whole, half = weighing.weights(*of(YELLOW))[0], weighing.weights(*of(YELLOW, 0.5))[0]
    assert 0 < half < 0.5 * whole
    assert Weighing((160, 0), LIME).weights(255, 128)[0] == 384


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
