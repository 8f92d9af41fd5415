"""The columns of a page are the recorded numbers, and each transmission became what it became."""

import math
from fractions import Fraction

import pytest
from msgspec.structs import replace

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_protocol.frames import TeamFrame
from miro_sim.pitch import ground
from mirotwin import ms
from mirotwin.recording.channels import SampleMessage
from mirotwin.recording.reader import read
from mirotwin.recording.track import error_of
from mirotwin.report.page.link import LinkLog, lanes_of
from mirotwin.report.page.run_page import MOST_POINTS, pitch_of
from mirotwin.report.page.tracks import M_S_PER_COUNT, add_samples, tracks_of
from tests.mirotwin import synthetic


@pytest.fixture(scope="module")
def recorded(fig6):
    return read(fig6 / "run.mcap").periods


@pytest.fixture(scope="module")
def robot(recorded):
    return tracks_of(recorded, [True], 1).robots[0]


def columns(postures):
    return list(zip(postures.x_m, postures.y_m, postures.theta_rad, strict=True))


def test_postures_are_those_of_the_recording(recorded, robot):
    def of(kind):
        found = [getattr(period.robots[0], kind) for period in recorded]
        return [(one.x_m, one.y_m, one.theta_rad) for one in found]

    assert columns(robot.truth) == of("truth")
    assert columns(robot.reference) == of("reference")


def test_a_measurement_that_is_missing_is_no_number(recorded, robot):
    for period, (x_m, y_m, theta_rad) in zip(recorded, columns(robot.measured), strict=True):
        seen = period.robots[0].measurement
        if seen is None:
            assert math.isnan(x_m)
        else:
            assert (x_m, y_m, theta_rad) == (seen.x_m, seen.y_m, seen.theta_rad)
    assert math.isnan(robot.measured.x_m[0])  # the picture is still under way


def test_errors_are_those_of_the_summary(recorded, robot):
    errors = [error_of(one.truth, one.reference, period.tick) for period in recorded for one in period.robots]
    assert list(robot.errors) == errors


def test_the_speed_of_a_wheel_is_its_counts_over_the_samples_between_two_exposures(recorded, robot):
    samples = Fraction(CONTROL_PERIOD_TICKS, 8192)
    for side in ("left", "right"):
        axes = [getattr(period.robots[0], side) for period in recorded]
        actual = list(robot.wheels[side].actual)
        assert math.isnan(actual[0])
        for before, after, speed in zip(axes, axes[1:], actual[1:], strict=False):
            if any(opcode in (0x00, 0x02) for _, opcode, _ in after.commands):
                assert math.isnan(speed)
                continue
            exact = (after.real_position - before.real_position) / samples * Fraction(M_S_PER_COUNT)
            assert speed == pytest.approx(float(exact), rel=1e-12, abs=1e-15)
    assert max(robot.wheels["left"].actual[10:]) > 0.1


def test_a_position_that_overflows_its_register_is_no_jump():
    periods = []
    for period, position in zip(synthetic.periods(2), ((1 << 31) - 10, -(1 << 31) + 10), strict=True):
        robot = synthetic.robot(1)
        left = replace(robot.left, real_position=position, commands=())
        periods.append(replace(period, robots=(replace(robot, left=left),)))
    speeds = tracks_of(periods, [True], 0).robots[0].wheels["left"].actual
    assert speeds[1] == 20 / (CONTROL_PERIOD_TICKS / 8192) * M_S_PER_COUNT


def test_a_window_has_the_periods_that_are_wanted():
    tracks = tracks_of(list(synthetic.periods(10))[3:7], [True], 0)
    assert tracks.first == 3
    assert tracks.ticks == [index * CONTROL_PERIOD_TICKS for index in range(3, 7)]


def test_samples_of_a_full_recording_go_to_their_robots():
    tracks = tracks_of(list(synthetic.periods(4, [(0, 0), (0, 2)]))[1:3], [True], 0)
    inside, before = tracks.ticks[0] + 5, tracks.ticks[0] - 5
    samples = [((0, 2), SampleMessage(tick, 1, 2, 65536, 4, 5, 6, 131072, 8)) for tick in (before, inside)]
    add_samples(tracks, samples)
    assert not len(tracks.robots[0].fine["left"].values)
    fine = tracks.robots[1].fine["right"]
    assert (list(fine.times_s), list(fine.values)) == ([inside / TICKS_PER_SECOND], [2 * M_S_PER_COUNT])


def test_the_path_of_a_long_run_is_thinned_but_keeps_its_ends():
    tracks = tracks_of(list(synthetic.periods(2 * MOST_POINTS + 4)), [True], 0)
    points = next(points for _, kind, points in pitch_of(tracks).paths if kind == "truth").split()
    assert len(points) <= MOST_POINTS + 1
    truth = tracks.robots[0].truth
    for point, index in ((points[0], 0), (points[-1], -1)):
        assert point == f"{100.0 * truth.x_m[index]:.2f},{100.0 * truth.y_m[index]:.2f}"


def test_a_path_that_leaves_the_pitch_is_in_the_picture():
    tracks = tracks_of(list(synthetic.periods(400)), [True], 0)  # 0.2 m/s for 13 s
    left, top, width, height = map(float, pitch_of(tracks).view_box.split())
    assert left <= -13.0
    corner_cm = 100.0 * math.sqrt(2.0) * ground.ROBOT_HALF_M
    assert left + width >= 100.0 * max(tracks.robots[0].truth.x_m) + corner_cm > 120.0
    assert -top >= 83.0
    assert height >= 96.0


HEARS = "net0/robot0 hears"


@pytest.fixture
def log(world):
    return LinkLog(world)


def fates(world, log):
    """Kinds at the robot after the period under way."""
    world.run_to(world.period_end)
    return [mark.kind for mark in log.marks() if mark.lane == HEARS and mark.kind != "noise"]


def test_a_frame_that_arrives_is_fresh_and_the_same_number_again_is_a_repetition(world, link, log):
    frame = TeamFrame(0, 9, ((0, 0), (0, 0), (0, 0)))
    link.send(frame)
    link.send(frame)
    world.run_for(ms(20))
    assert fates(world, log) == ["fresh", "repeated"]


def test_a_bad_stop_bit_damages_a_frame(world, link, log):
    link.send(velocities={0: (5, 5)}, bad_stop=[12])
    world.run_for(ms(40))
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(40))
    assert fates(world, log) == ["damaged", "fresh"]
    damaged = next(mark for mark in log.marks() if mark.kind == "damaged")
    sent = next(mark for mark in log.marks() if mark.kind in ("sent", "raw"))
    assert (damaged.start_tick, damaged.end_tick) == (sent.start_tick, sent.end_tick)


def test_a_frame_on_a_radio_that_is_down_is_lost(world, link, log):
    link.radio("down")
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(30))
    link.radio("up")
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(30))
    assert fates(world, log) == ["lost", "fresh"]
    assert "net0 done to it" in lanes_of(log.marks())


def test_characters_that_are_no_frame_are_shown_as_such(world, link, log):
    link.send(b"\x01\x02\x03")
    world.run_for(ms(60))
    marks = log.marks()
    assert [mark.text for mark in marks if mark.lane == "net0 PC sends"] == ["3 characters"]
    assert [mark.kind for mark in marks if mark.lane == HEARS] == ["damaged"]


def test_a_valid_answer_is_told_from_a_damaged_one(world, link, log):
    link.poll(slot=0)
    world.run_for(ms(40))
    world.run_to(world.period_end)
    heard = [mark for mark in log.marks() if mark.lane == "net0 PC hears"]
    assert [mark.kind for mark in heard if mark.kind != "noise"] == ["answer"]
    assert any("slot=0" in mark.text for mark in heard)


def test_a_frame_under_way_at_the_end_is_not_lost(world, link, log):
    world.run_to(world.period_end)
    link.send(velocities={0: (5, 5)}, at_tick=world.period_end - ms(8), wait=False)
    world.run_to(world.period_end)
    begun = [mark for mark in log.marks() if mark.lane == HEARS and mark.kind != "noise"]
    assert [(mark.kind, mark.end_tick) for mark in begun] == [("open", world.tick)]
