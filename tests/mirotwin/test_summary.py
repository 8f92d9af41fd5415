"""The summary: its keys, its definitions, and the picture that goes with it."""

import json
import math
import tracemalloc
from types import SimpleNamespace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.scenario.file import load
from mirotwin.recording.track import ErrorSample, Tracks, error_of, wrapped
from mirotwin.runs.summary import off_pitch_text, rms_name, settling_text, summarise, to_json, tracking_of
from tests.mirotwin.synthetic import periods

KEYS = {
    "": "scenario seed engine digest simulated_s wall_s realtime_factor tracking link firmware vision theory",
    "tracking": "rms_x_cm rms_y_cm rms_theta_deg rms_position_cm settling_s off_pitch_s",
    "link": "frames_sent frames_accepted frames_rejected frames_stale bit_errors",
    "firmware": "sha256 instructions machine_cycles idle_cycles faults",
    "vision": "frames lost dropped repeated wrong swapped",
    "theory": "disturbance assumption_1 assumption_2 assumption_3 reversals backward_s chattering_m_s2 effort_m_s2",
}


NUMBERS = {"link": (180, 178, 2, 0, 9), "firmware": (5, 7, 2, 0), "vision": (180, 1, 2, 0, 0, 0)}
COUNTERS = {
    table: dict(zip([key for key in KEYS[table].split() if key != "sha256"], numbers, strict=True))
    for table, numbers in NUMBERS.items()
}


def summary_of(run):
    world = SimpleNamespace(
        scenario=load("fig6").scenario,
        seed=7,
        image=SimpleNamespace(sha256="ab" * 32),
        tick=len(run) * CONTROL_PERIOD_TICKS,
        counters=lambda: COUNTERS,
    )
    return summarise(world, Tracks(run), 0.5)


def samples(*errors):
    return [ErrorSample(index * CONTROL_PERIOD_TICKS, *error) for index, error in enumerate(errors)]


def test_the_file_has_exactly_the_keys_that_others_read():
    written = json.loads(to_json(summary_of(list(periods(60)))))
    for table, keys in KEYS.items():
        found = written[table] if table else written
        assert list(found) == keys.split()


def test_several_robots_are_listed_beside_the_first():
    written = json.loads(to_json(summary_of(list(periods(60, [(0, 0), (0, 2), (1, 1)])))))
    assert [(one["network"], one["slot"]) for one in written["robots"]] == [(0, 0), (0, 2), (1, 1)]
    assert written["robots"][0]["tracking"] == written["tracking"]
    assert written["robots"][0]["theory"] == written["theory"]


def test_times_and_factor_follow_from_the_ticks():
    summary = summary_of(list(periods(180)))
    assert summary.simulated_s == 180 * 800_800 / 24e6
    assert summary.realtime_factor == summary.simulated_s / 0.5
    assert summary.digest == list(periods(180))[-1].digest


def test_rms_is_taken_over_the_last_second_only():
    run = samples(*[(100.0, 0.0, 0.0)] * 40, *[(3.0, 4.0, math.radians(2.0))] * 30)
    tracking = tracking_of(run)
    assert (tracking.rms_x_cm, tracking.rms_y_cm, tracking.rms_position_cm) == (3.0, 4.0, 5.0)
    assert tracking.rms_theta_deg == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("first", "count", "text"),
    [
        (0, 30, "rms of the last second"),
        (0, 29, "rms (0.00 s to 0.97 s)"),
        (24, 6, "rms (0.80 s to 1.00 s)"),
        (24, 156, "rms of the last second"),
    ],
)
def test_rms_over_less_than_a_second_says_what_time_it_covers(first, count, text):
    assert rms_name(samples(*[(0.0, 0.0, 0.0)] * (first + count))[first:]) == text


@pytest.mark.parametrize(
    ("errors", "settling", "text"),
    [
        ([(0.0, 0.0, 0.0)] * 4, 0.0, "settled at 0.00 s"),
        ([(5.0, 0.0, 0.0), *[(1.0, 0.0, 0.0)] * 30], 0.0, "settled at 0.00 s"),
        ([(5.0, 0.0, 0.0), (0.0, 0.0, 0.2), *[(1.0, 0.0, 0.0)] * 30], 800_800 / 24e6, "settled at 0.03 s"),
        ([(5.0, 0.0, 0.0), (0.0, 0.0, 0.2), *[(1.0, 0.0, 0.0)] * 29], None, "not settled"),
        ([(5.0, 0.0, 0.0), (1.0, 0.0, 0.0)], None, "not settled"),
        ([(0.0, 0.0, 0.0), (2.9, 2.9, 0.0)], None, "not settled"),
        ([(0.0, 0.0, 0.0), (0.0, 0.0, -0.151)], None, "not settled"),
        ([(5.0, 0.0, 0.0), (0.0, 0.0, 0.2)], None, "not settled"),
        ([(3.0, 0.0, 0.15)], 0.0, "settled at 0.00 s"),
    ],
)
def test_settling_is_the_last_time_outside_three_centimetres_or_0_15_radian(errors, settling, text):
    """And a robot that is outside at any time of the last second has not settled: it has no such time."""
    assert tracking_of(samples(*errors)).settling_s == settling
    assert settling_text(samples(*errors)) == text


def test_the_time_off_the_pitch_is_counted_by_the_corners_of_the_robot():
    # along y = 0 at 0.2 m/s: its front edge crosses x = 120 cm at 116.25 cm, after 5.81 s
    run = list(periods(200))
    off = [period for period in run if period.robots[0].truth.x_m + 0.0375 > 1.2]
    assert 20 < len(off) < 30
    summary = summary_of(run)
    assert summary.tracking.off_pitch_s == len(off) * 800_800 / 24e6
    off_s = summary.tracking.off_pitch_s
    assert off_pitch_text(summary) == f"off it for {off_s:.2f} s (the pitch has no walls here)"


def test_each_robot_that_left_the_pitch_is_named_and_no_other():
    assert off_pitch_text(summary_of(list(periods(60)))) == ""
    text = off_pitch_text(summary_of(list(periods(200, [(0, 0), (0, 2)]))))
    assert "(net0/robot0)" in text
    assert "(net0/robot2)" in text


def test_a_run_without_a_period_has_no_tracking():
    assert set(msgspec.structs.astuple(tracking_of([]))) == {None}


@given(st.floats(-3.14, 3.14), st.integers(-20, 20))
def test_a_heading_error_is_wrapped_whatever_turns_lie_behind_it(angle, turns):
    assert wrapped(angle + turns * 2.0 * math.pi) == pytest.approx(angle, abs=1e-12)


def test_half_a_turn_is_positive():
    assert wrapped(-math.pi) == math.pi


def test_the_columns_of_a_run_say_what_its_periods_say():
    run = list(periods(40, [(0, 0), (1, 2)]))
    tracks = Tracks(run)
    assert list(tracks.robots) == [(0, 0), (1, 2)]
    assert (tracks.count, tracks.digest) == (40, run[-1].digest)
    for index, track in enumerate(tracks.robots.values()):
        records = [(period.robots[index], period.tick) for period in run]
        errors = [error_of(robot.truth, robot.reference, tick) for robot, tick in records]
        assert list(track.errors) == errors
        assert track.errors[-2:] == errors[-2:]
        assert track.truth.points_cm()[0] == [100.0 * robot.truth.x_m for robot, _ in records]
        assert track.reference.points_cm()[1] == [100.0 * robot.reference.y_m for robot, _ in records]
        assert track.measured.points_cm()[0] == [
            100.0 * robot.measurement.x_m for robot, _ in records if robot.measurement is not None
        ]


def test_inner_values_are_kept_by_name_and_robot_in_the_order_of_the_laws():
    tracks = Tracks(periods(3, [(0, 0), (1, 2)]))
    assert list(tracks.inner) == ["u1", "u2", "s1", "s2"]
    line = tracks.inner["s2"][1, 2]
    assert list(line.values) == [-2.0, -2.0]
    assert list(line.times_s) == [800_800 / 24e6, 2 * 800_800 / 24e6]


def test_a_control_period_leaves_less_than_250_bytes():
    tracks = Tracks(periods(10))
    tracemalloc.start()
    try:
        for period in periods(4000):
            tracks.add(period)
        del period
        used, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert used < 250 * 4000
