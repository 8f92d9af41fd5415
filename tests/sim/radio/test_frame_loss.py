"""Frames lost against Eb/N0, in a sample small enough for every test run; the curves are `benchmarks.frame_loss`."""

import pytest

from benchmarks import frame_loss
from benchmarks.interval import clopper_pearson, wilson


def deviations(point):
    expected = frame_loss.formula(point.robots, point.eb_n0_db)
    return (point.lost - point.sent * expected) / (point.sent * expected * (1 - expected)) ** 0.5


@pytest.mark.parametrize("robots", [3, 5])
@pytest.mark.parametrize(("receiver", "frames"), [(frame_loss.decoder, 1500), (frame_loss.firmware, 150)])
def test_as_many_frames_are_lost_as_have_a_wrong_bit_where_it_counts(receiver, frames, robots):
    assert abs(deviations(receiver(robots, 10.0, frames, 4))) < 4


def test_a_slicer_that_has_not_settled_costs_frames():
    assert deviations(frame_loss.slicer(3, 10.0, 1500, 4)) > 4


@pytest.mark.parametrize("receiver", [frame_loss.decoder, frame_loss.firmware])
def test_without_errors_no_frame_is_lost_in_the_noise_between_frames(receiver):
    assert receiver(3, 40.0, 100, 4).lost == 0


def test_the_bits_that_count_are_those_from_sync_to_crc_and_one_stop_bit():
    assert [frame_loss.critical_bits(robots) for robots in (3, 5)] == [171, 251]
    assert frame_loss.formula(3, 12.31) == pytest.approx(171e-4, rel=0.02)


def test_the_same_figures_make_the_same_picture(tmp_path):
    points = [frame_loss.Point(3, "decoder", 10.0, 1000, 440), frame_loss.Point(5, "firmware", 14.0, 100, 0)]
    for name in ("a.png", "b.png"):
        frame_loss.draw(points, tmp_path / name)
    picture = (tmp_path / "a.png").read_bytes()
    assert picture == (tmp_path / "b.png").read_bytes()
    assert picture.startswith(b"\x89PNG")


@pytest.mark.parametrize(("count", "trials"), [(3, 300), (100, 300), (299, 300)])
def test_wilsons_interval_is_near_the_exact_one(count, trials):
    assert wilson(count, trials) == pytest.approx(clopper_pearson(count, trials), abs=0.012)
