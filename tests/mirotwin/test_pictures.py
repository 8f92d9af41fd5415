"""Pictures: what a reader of the overlay may rely on, and that a file no camera can have made is refused in a line."""

import math
import struct
import warnings
import zlib
from contextlib import suppress

import numpy as np
import pytest
from PIL import Image

from miro_exact.bad_input import BadInput
from miro_host.eye.track import Sighting
from miro_host.eye.tracker import Notes
from miro_host.posture import Posture
from mirotwin.camera import overlay
from mirotwin.camera.overlay import INK, LOST, SCALE, Box, draw
from mirotwin.camera.picture import Picture, parse, png, taken
from tests.host.eye.scenes import FRAME, tracker
from tests.naive.painted_frame import PaintedFrame, PaintedRobot

ROBOTS = [
    PaintedRobot(Posture(0.3, 0.3, 0.4), "yellow", 0),
    PaintedRobot(Posture(0.3, 0.42, 2.0), "yellow", 1),
    PaintedRobot(Posture(0.42, 0.3, -1.0), "yellow", 2),
]


def drawn(robots, numbers=(0, 1, 2), frames=2, known=False):
    one = tracker("yellow", numbers)
    one.notes = Notes()
    for track, robot in zip(one.tracks, robots if known else (), strict=known):
        at = robot.posture
        track.remember(Sighting(at.x_m, at.y_m, at.theta_rad, 0, 1.0))
    seen = robots if isinstance(robots[0], list) else [robots]
    pictures = [taken(PaintedFrame(each)) for each in seen]
    for frame in range(frames):
        picture = pictures[min(frame, len(pictures) - 1)]
        one.track(picture, frame * FRAME)
    return np.asarray(draw(picture, one, one.notes, "painted")), picture, one


def count(pixels, colour):
    return int((pixels == np.array(colour)).all(axis=-1).sum())


def test_notes_say_which_windows_were_read_and_change_nothing():
    plain, noted = tracker("yellow", (0, 1, 2)), tracker("yellow", (0, 1, 2))
    noted.notes = Notes()
    picture = taken(PaintedFrame(ROBOTS))
    assert noted.track(picture, 0) == plain.track(picture, 0)
    assert {window.slot for window in noted.notes.windows} == {-1}
    assert noted.track(picture, FRAME) == plain.track(picture, FRAME)
    assert [(window.slot, window.width) for window in noted.notes.windows] == [(0, 32), (1, 32), (2, 32)]
    assert [pair.sighting for pair in noted.notes.pairs] == plain.track(picture, FRAME)
    for pair in noted.notes.pairs:
        posture = noted.top.posture(pair.u, pair.v, pair.identity_u, pair.identity_v)
        assert posture == (pair.sighting.x_m, pair.sighting.y_m, pair.sighting.theta_rad)


def test_where_nothing_is_drawn_the_picture_is_the_cameras_each_pixel_three_by_three():
    pixels, picture, _ = drawn(ROBOTS)
    plain = np.asarray(picture.image()).repeat(SCALE, axis=0).repeat(SCALE, axis=1)
    changed = (pixels[: plain.shape[0]] != plain).any(axis=-1)
    assert 0.0 < changed.mean() < 0.02
    assert not changed[:, 600:].any()


def test_classes_are_outlined_in_their_colours_and_a_lost_robot_is_red():
    pixels, _, _ = drawn(ROBOTS)
    for name in ("yellow", "magenta", "cyan", "green"):
        assert count(pixels, INK[name]) > 40
    assert count(pixels, INK["orange"]) == count(pixels, LOST) == 0
    pixels, _, _ = drawn([ROBOTS, ROBOTS[:2]])
    assert count(pixels, LOST) > 3 * 64 * 4


def test_a_picture_that_the_tracker_never_got_is_drawn_without_anything():
    one = tracker("yellow", (0,))
    picture = taken(PaintedFrame(ROBOTS))
    pixels = np.asarray(draw(picture, one, None, "dropped"))
    plain = np.asarray(picture.image()).repeat(SCALE, axis=0).repeat(SCALE, axis=1)
    assert (pixels[: plain.shape[0]] == plain).all()


@pytest.mark.parametrize("turn", range(8))
def test_labels_of_robots_side_by_side_keep_clear_of_each_other(monkeypatch, turn):
    boxes = []
    cost = overlay._cost
    monkeypatch.setattr(overlay, "_cost", lambda place, *rest: boxes.append(cost(place, *rest)) or boxes[-1])
    angle = turn * math.pi / 4.0
    close = [PaintedRobot(Posture(0.3 + 0.12 * n, 0.3, angle), "yellow", n) for n in range(3)]
    drawn(close, known=True)
    assert [min(boxes[at : at + 8]) for at in (0, 8, 16)] == [0.0, 0.0, 0.0]


def test_two_rectangles_share_what_both_cover():
    assert Box(0, 0, 4, 4).shared(Box(2, 3, 9, 9)) == 2.0
    assert Box(0, 0, 4, 4).shared(Box(5, 0, 9, 9)) == 0.0


def test_a_saved_picture_differs_by_rounding_where_colours_are_shown_in_full():
    colours = [(200, 60, 150), (128, 128, 128), (100, 150, 90), (16, 130, 126)]
    picture = Picture(bytes(colours[0]) * 19200 + bytes(colours[1]) * 19200 + bytes(colours[2]) * 19200
                      + bytes(colours[3]) * 19200)  # fmt: skip
    for at, (y, cb, cr) in zip((0, 80, 140, 200), colours, strict=True):
        red = y + 1.402 * (cr - 128)
        green = y - 0.344136 * (cb - 128) - 0.714136 * (cr - 128)
        blue = y + 1.772 * (cb - 128)
        shown = picture.image().getpixel((5, at))
        assert max(abs(a - b) for a, b in zip(shown, (red, green, blue), strict=True)) <= 1.0


# Files that are no picture of ours

WHOLE = png(Image.new("RGB", (320, 240), (30, 60, 90)))
BEHIND_HEAD, BEFORE_END = 33, len(WHOLE) - 12
KINDS = b"tRNS gAMA cHRM sRGB pHYs iCCP tEXt zTXt iTXt eXIf acTL fcTL fdAT".split()


def with_chunk(kind, data, at):
    """The picture with a chunk more, whose sum is right."""
    body = kind + data
    chunk = struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    return WHOLE[:at] + chunk + WHOLE[at:]


@pytest.mark.parametrize("at", [BEHIND_HEAD, BEFORE_END])
@pytest.mark.parametrize("kind", KINDS)
def test_a_chunk_of_any_kind_and_size_is_passed_over_or_refused_without_a_warning(kind, at):
    for size in range(0, 30, 3):
        for data in (bytes(size), b"\xff" * size, b"a\0\0" + zlib.compress(bytes(size))):
            with warnings.catch_warnings(), suppress(BadInput):
                warnings.simplefilter("error")
                assert parse(with_chunk(kind, data, at), "x.png").width == 320


def test_a_colour_profile_of_nothing_is_damage():
    with pytest.raises(BadInput, match=r"x\.png: is damaged: .*; write the picture again"):
        parse(with_chunk(b"iCCP", b"", BEFORE_END), "x.png")
