"""Checks of where a robot is and how fast its wheels are: a changed scenario fails them, at the tick that is meant."""

import msgspec
import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS, ticks
from miro_sim.scenario.file import load, parse
from miro_sim.world.world import World
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, Tracks
from mirotwin.verify.checks.monitors import Checks
from tests.mirotwin.verify.checks.rig import MS, own_image

PERIODS = 60
STARTS_OFF = "network.robot.start_error_x_cm=7.0"
WEAK = "network.robot.drive.battery.voltage_v=0.7"
FEW = f"duration_s={PERIODS * CONTROL_PERIOD_TICKS / 24e6}"


def judged(*settings, name="line"):
    world = World(load(name, [FEW, *settings]).scenario, 2, own_image())
    checks, tracks = Checks(world), Tracks()
    while not world.finished:
        tracks.add(world.step())
    checks.finish()
    return checks.failures, tracks, {one.name: one.verdict for one in checks.verdicts()}


def errors(tracks):
    (track,) = tracks.robots.values()
    return list(track.errors)


@pytest.mark.parametrize("from_s", [0.0, 0.7, 1.5])
def test_tracking_fails_at_the_first_period_outside_and_at_each_one_that_leaves_again(from_s):
    limit_cm = 1.0
    settings = f"expect.tracks_within_cm={{limit_cm={limit_cm}, from_s={from_s}}}"
    failures, tracks, _ = judged(settings, STARTS_OFF)
    seen = [sample for sample in errors(tracks) if sample.tick >= ticks(from_s)]
    outside = [sample.position_cm > limit_cm for sample in seen]
    leaving = [now and not before for now, before in zip(outside, [False, *outside], strict=False)]
    assert [one.tick for one in failures] == [
        sample.tick for sample, leaves in zip(seen, leaving, strict=True) if leaves
    ]
    assert all(one.wanted == "at most 1 cm from the reference" for one in failures)


def test_without_a_time_the_last_second_of_the_run_is_judged():
    failures, tracks, found = judged("expect.tracks_within_cm=0.001", STARTS_OFF)
    end_tick = PERIODS * CONTROL_PERIOD_TICKS
    first = next(one for one in errors(tracks) if one.tick >= end_tick - 24_000_000)
    assert failures[0].tick == first.tick
    assert failures[0].found == f"{first.position_cm:.3f} cm"
    assert found["tracks_within_cm"] == "failed"


def test_a_robot_settles_in_time_or_fails_when_the_time_is_over():
    failures, tracks, found = judged("expect.settles_within_s=1.5", STARTS_OFF)
    assert (failures, found["settles_within_s"]) == ([], "passed")
    unsettled = [one.tick for one in errors(tracks) if not one.settled]
    assert unsettled  # it had to settle first
    within_s = (unsettled[-1] - 1) / 24e6
    failures, _, _ = judged(f"expect.settles_within_s={within_s}", STARTS_OFF)
    assert [one.tick for one in failures] == [unsettled[-1]]
    assert failures[0].wanted.startswith(
        f"within {SETTLED_CM:g} cm and {SETTLED_RAD:g} rad of the reference after"
    )


def test_a_robot_with_an_empty_battery_neither_settles_nor_tracks():
    settings = ("expect.settles_within_s=1.5", "expect.tracks_within_cm=3.0")
    _, _, found = judged(*settings, WEAK)
    assert (found["settles_within_s"], found["tracks_within_cm"]) == ("failed", "failed")
    _, _, found = judged(*settings)
    assert (found["settles_within_s"], found["tracks_within_cm"]) == ("passed", "passed")


def test_a_robot_that_drives_over_the_edge_fails_once_for_each_time():
    along_the_edge = ("network.robot.reference.start_y_cm=-6.2", "network.robot.reference.heading_deg=0.0")
    failures, tracks, found = judged("expect.inside_pitch=true", *along_the_edge)
    off = [one.off_pitch for one in errors(tracks)]
    leaving = [
        one.tick
        for one, before in zip(errors(tracks), [False, *off], strict=False)
        if one.off_pitch and not before
    ]
    assert (found["inside_pitch"], [one.tick for one in failures]) == ("failed", leaving)
    assert leaving
    assert judged("expect.inside_pitch=true")[2]["inside_pitch"] == "passed"


def test_wheels_that_are_told_to_turn_too_fast_fail_at_the_command():
    failures, _, _ = judged("expect.wheels_within_m_s={limit_m_s=0.15, overshoot_m_s=10.0}")
    assert failures
    for one in failures:
        assert one.wanted == "a wheel told at most 0.15 m/s"
        assert abs(float(one.found.split()[0])) > 0.15
        assert one.tick % CONTROL_PERIOD_TICKS != 0
    assert judged("expect.wheels_within_m_s=1.46")[2]["wheels_within_m_s"] == "passed"


def test_wheels_that_are_too_fast_without_being_told_fail_too():
    text = """
name = "pushed"
duration_s = 0.5
expect.wheels_within_m_s = { limit_m_s = 0.5, overshoot_m_s = 0.02 }
network = [{ host = "silent", robot = [{ reference.kind = "line" }] }]
"""
    world = World(parse(text, "pushed"), 0, own_image())
    checks = Checks(world)
    (watched,) = checks.robots
    (monitor,) = [one for one in watched.monitors if one.check.name == "wheels_within_m_s"]
    record = world.step().robots[0]
    for tick, v_m_s, w_rad_s in ((0, 0.5, 0.0), (MS, 0.5, 2.0), (2 * MS, 0.5, 2.0), (3 * MS, -0.53, 0.0)):
        monitor.period(msgspec.structs.replace(record, v_m_s=v_m_s, w_rad_s=w_rad_s), tick)
    assert [(one.tick, one.found) for one in monitor.failures] == [
        (MS, "0.5680 m/s of the right one"),
        (3 * MS, "-0.5300 m/s of the left one"),
    ]
