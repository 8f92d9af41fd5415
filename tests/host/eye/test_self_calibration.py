"""The camera's parameters from lines and walls: marks in a rendered picture, and what a tracker learns from them."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_host.eye import self_calibration
from miro_host.eye.calibration import Calibration
from miro_host.eye.calibration_kinds import drawn_1997, worst_error_m
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.mark_finder import band_centre, expected, find
from miro_host.eye.patterns import PATTERNS
from miro_host.eye.pitch_marks import MARKS
from miro_host.eye.self_calibration import LEARNT, SPREADS, STRIDE, SelfCalibration
from miro_host.eye.track import Sighting, Track
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.picture_settings import PictureSettings
from tests.states import restore, snapshot

FRAME = 800_800
TRUE = CameraParameters()


def camera(true=TRUE, settings=None, seed=0):
    return Camera(true, settings or PictureSettings(), PATTERNS["diagonal"], Stream(seed, "pixels"))


def pictures(count, eye=None, robots=()):
    """Frames of the pitch with robots (network, slot, x_m, y_m) that stand on it."""
    eye = eye or camera()
    for index in range(count):
        eye.clear_robots()
        for network, slot, x_m, y_m in robots:
            eye.robot(network, slot, x_m, y_m, 0.3, 0.0, 0.0)
        eye.begin(index, index * FRAME)
        yield eye


def learnt(told, count, **scene):
    one = SelfCalibration(Calibration(camera=told))
    for picture in pictures(count, **scene):
        one.look(picture, ())
    return one


def worst_cm(one, true=TRUE):
    return 100.0 * worst_error_m(true, one.calibration)


def changed(changes):
    return msgspec.structs.replace(
        TRUE, **{name: getattr(TRUE, name) + by for name, by in zip(LEARNT, changes, strict=True)}
    )


def test_every_mark_is_found_where_the_true_camera_draws_it():
    (picture,) = pictures(1)
    for mark in MARKS:
        off_px = find(picture, expected(Lens(TRUE), mark))
        assert off_px is not None, mark
        assert abs(off_px) < (0.12 if mark.height_m else 0.35), mark


def test_the_stride_visits_every_mark():
    assert math.gcd(STRIDE, len(MARKS)) == 1


@pytest.mark.parametrize("width", [0.7, 1.0, 2.6, 4.0])
@pytest.mark.parametrize("place", [10.0, 10.3, 10.5, 10.8])
def test_the_middle_of_a_band_is_found_between_pixels(width, place):
    fine = (np.arange(23 * 100) + 0.5) / 100.0
    light = np.where(abs(fine - place) < 0.5 * width, 0.6, 0.03).reshape(23, 100).mean(axis=1)
    levels = bytes(np.round(255.0 * light**0.45).astype(np.uint8))
    assert abs(band_centre(levels) - place) < 0.13


@given(st.binary(min_size=23, max_size=23))
def test_any_row_of_levels_has_a_middle_in_it_or_none(levels):
    centre = band_centre(levels)
    assert centre is None or 0.0 < centre < 23.0


@pytest.mark.parametrize("seed", range(5))
def test_a_calibration_of_1997_is_right_to_half_a_millimetre_after_two_seconds(seed):
    told = drawn_1997(TRUE, Stream(seed, "net0/calibration")).camera
    assert 100.0 * worst_error_m(TRUE, Calibration(camera=told)) == pytest.approx(2.40)
    assert worst_cm(learnt(told, 60)) < 0.05


@settings(max_examples=10)
@given(
    st.tuples(*[st.floats(-0.3 * spread, 0.3 * spread) for spread in SPREADS[:-1]]), st.floats(-0.03, 0.05)
)
def test_errors_of_all_parameters_together_are_learnt(changes, k1):
    told = changed([*changes, k1])
    assume(worst_error_m(TRUE, Calibration(camera=told)) < 0.04)  # beyond that lines are taken for others
    assert worst_cm(learnt(told, 120)) < 0.1


def test_the_same_holds_for_another_camera_and_a_bad_picture():
    true = msgspec.structs.replace(
        TRUE, height_m=2.3, focal_px=520.0, tilt_x_rad=0.05, turn_rad=0.08, k1=-0.1
    )
    poor = PictureSettings(luma_noise=6.0, flicker=0.5, mains_hz=50, light_falloff=0.5, line_jitter_px=0.3)
    told = drawn_1997(true, Stream(3, "told")).camera
    assert worst_cm(learnt(told, 120, eye=camera(true, poor)), true) < 0.1


def test_robots_of_others_that_stand_on_lines_do_not_spoil_it():
    standing = [(1, n, *place) for n, place in enumerate(((0.55, 0.6), (0.05, 0.3), (0.6, -0.06)))]
    told = drawn_1997(TRUE, Stream(1, "told")).camera
    assert worst_cm(learnt(told, 120, robots=standing)) < 0.1


def test_a_mark_near_an_own_robot_is_left_out():
    one = SelfCalibration(Calibration(camera=TRUE))
    mark = MARKS[0]
    robot = Track()
    robot.remember(Sighting(mark.x_m + 0.05, mark.y_m + 0.1, 0.0, 0, 1.0))
    (picture,) = pictures(1)
    one.look(picture, (robot,))
    assert one.used == one.refused == 0


class Dark:
    """A picture of nothing, with some noise."""

    width, height = 320, 240

    def window(self, left, top, width, height):
        return bytearray((17 * (left + top) + 31 * index) % 9 + 40 for index in range(3 * width * height))


def test_where_nothing_is_seen_nothing_is_learnt():
    one = SelfCalibration(Calibration(camera=TRUE))
    assert not any(one.look(Dark(), ()) for _ in range(300))
    assert one.changes == [0.0] * len(LEARNT)
    assert one.used == 0


def test_one_update_is_that_of_the_textbook():
    told = drawn_1997(TRUE, Stream(2, "told")).camera
    one = SelfCalibration(Calibration(camera=told))
    for picture in pictures(40):
        before = np.array(one.covariance).reshape(7, 7), np.array(one.changes)
        used = one.used
        mark = MARKS[one.looked * STRIDE % len(MARKS)]
        off_px = find(picture, expected(Lens(self_calibration.changed(told, one.changes)), mark))
        one.look(picture, ())
        if one.used == used:
            continue
        h = np.array(self_calibration.slopes_of(told, mark))
        noise = self_calibration.WALL_NOISE_PX if mark.height_m else self_calibration.LINE_NOISE_PX
        gain = before[0] @ h / (h @ before[0] @ h + noise**2)
        after = (np.eye(7) - np.outer(gain, h)) @ before[0]
        assert np.allclose(one.changes, before[1] + gain * off_px, rtol=1e-9, atol=1e-15)
        assert np.allclose(np.array(one.covariance).reshape(7, 7), after, rtol=1e-6, atol=1e-12)


def test_what_was_learnt_is_saved_and_a_strange_memory_is_refused():
    told = drawn_1997(TRUE, Stream(2, "told")).camera
    one = learnt(told, 40)
    other = SelfCalibration(Calibration(camera=told))
    restore(other, snapshot(one))
    assert (other.changes, other.told, other.looked) == (one.changes, one.told, one.looked)
    one.changes[2] = 1e5
    strange = snapshot(one)
    with pytest.raises(ValueError, match="self-calibration"):
        restore(other, strange)
    assert other.looked == 40
