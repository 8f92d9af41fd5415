"""Single checks: robots that do not act, courses and speeds, and conditions that happen or never do."""

import json

import msgspec
import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS, ticks
from miro_protocol.frames import encode
from miro_sim.radio.params import Radio
from miro_sim.scenario.file import load, parse
from miro_sim.world.conditions import CONDITIONS
from miro_sim.world.world import World
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD, Tracks
from mirotwin.verify.checks.alive import FRAMES, frames_needed
from mirotwin.verify.checks.monitors import Checks
from tests.mirotwin.conform.images import BABBLES, HANGS, READS_BOTH, image_of
from tests.mirotwin.verify.checks.rig import (
    MS,
    built,
    finish,
    needs_sdcc,
    own_image,
    send,
    silent_world,
    team,
)

# Dead, deaf and lame robots fail any run that sends them frames; robots that nothing reaches are not judged.

DEAF = ("uart.c", "SCON = MODE_1_RECEIVE;", "SCON = 0x40;")
OTHER_BAUD = ("uart.c", "SCON = MODE_1_RECEIVE;", "SCON = MODE_1_RECEIVE; RCAP2L = 0; TL2 = 0;")
NO_FILTER = ("motion.c", "    lm629_command(UDF);", "    ;")


def judged(scenario):
    return finish(scenario, Checks(scenario))


def world(image, *settings, name="line", seed=0):
    return World(load(name, ("duration_s=1.0", *settings)).scenario, seed, image)


@pytest.mark.parametrize(
    "name", ["fig6", "fig7", "fig8", "fig9", "fig10", "line", "curve", "sine", "waypoints"]
)
def test_a_processor_that_hangs_fails_each_built_in_scenario_that_drives(name):
    assert judged(world(image_of(HANGS), name=name))["acts_at_all"] == "failed"
    assert judged(world(own_image(), name=name))["acts_at_all"] == "passed"


@pytest.mark.parametrize("code", [BABBLES, READS_BOTH], ids=["babbles", "reads both chips"])
def test_programs_that_are_no_firmware_fail(code):
    assert judged(world(image_of(code), "stop_on_fault=false"))["acts_at_all"] == "failed"


@needs_sdcc
@pytest.mark.parametrize("mistake", [DEAF, OTHER_BAUD, NO_FILTER], ids=["deaf", "other baud", "no filter"])
def test_firmware_that_hears_nothing_or_drives_nothing_fails(mistake):
    assert judged(world(built(*mistake)))["acts_at_all"] == "failed"


@needs_sdcc
def test_firmware_that_hangs_in_the_middle_of_a_run_fails():
    hangs = "    while (last_left > 1200)\n        ;\n    state = STATE_DRIVING;"  # at about half its speed
    running = world(built("motion.c", "    state = STATE_DRIVING;", hangs))
    checks = Checks(running)
    assert finish(running, checks)["acts_at_all"] == "failed"
    assert checks.failures[0].tick > 12_000_000 / 2


@needs_sdcc
def test_firmware_that_begins_again_by_itself_fails_and_one_that_is_reset_does_not():
    again = "    if (last_left > 1200)\n        ((void (*)(void))0)();\n    state = STATE_DRIVING;"
    running = world(built("motion.c", "    state = STATE_DRIVING;", again))
    checks = Checks(running)
    assert finish(running, checks)["acts_at_all"] == "failed"
    assert "wanted a robot that does not reset unexpectedly" in str(checks.failures[0])
    healthy = world(own_image())
    checks = Checks(healthy)
    for begun_tick, for_ticks in ((8_000_000, 100_000), (12_100_000, 400_000), (16_000_000, 1_700_000)):
        healthy.run_to(begun_tick)
        for level, until_tick in ((1, begun_tick + for_ticks), (0, begun_tick + for_ticks + 1000)):
            healthy.set_reset(level)
            healthy.run_to(until_tick)
    assert finish(healthy, checks)["acts_at_all"] == "passed"


def test_the_failure_names_the_wheels_and_what_the_firmware_has_counted():
    dead = world(image_of(HANGS))
    checks = Checks(dead)
    finish(dead, checks)
    (failure,) = checks.failures
    assert failure.wanted == "a robot that acts on one of 5 frames that reached it"
    assert failure.found == "no command to turn the left and the right wheel"


@pytest.mark.parametrize(
    "radio",
    ["bit_error_rate = 0.5", "lost_frames = 1.0", "lost_character_rate = 0.9", "baud_offset_ppm = 40000"],
)
def test_a_robot_that_no_frame_reaches_is_not_judged(radio):
    assert judged(world(image_of(HANGS), f"network.radio={{{radio}}}"))["acts_at_all"] == "not judged"


@pytest.mark.parametrize(
    "radio",
    ["bit_error_rate = 0.002", "lost_frames = 0.3", "lost_character_rate = 0.02", 'profile = "fade15"'],
)
def test_under_a_bad_radio_a_dead_robot_fails_and_a_healthy_one_does_not(radio):
    settings = (f"network.radio={{{radio}}}", "duration_s=4.0")
    assert judged(world(image_of(HANGS), *settings))["acts_at_all"] == "failed"
    assert judged(world(own_image(), *settings))["acts_at_all"] == "passed"


def test_frames_with_bad_stop_bits_or_old_numbers_ask_for_nothing():
    running, checks = silent_world("")
    send(running, [team(1, 900, 700)] * 12)
    for _ in range(12):
        running.run_to(running.period_end + 1)
        running.inject(bytes([0x55] * 20))
    assert finish(running, checks)["acts_at_all"] != "failed"


def test_one_speed_again_and_again_is_told_once_and_passes():
    running, checks = silent_world("")
    send(running, [team(seq % 64, 900, 700) for seq in range(20)])
    assert finish(running, checks)["acts_at_all"] == "passed"


def test_a_robot_without_supply_or_in_reset_is_not_asked():
    running, checks = silent_world("")
    running.robot(0, 1).board.set_reset(1)
    send(running, [team(seq % 64, 900 + seq, 700) for seq in range(20)])
    assert finish(running, checks)["acts_at_all"] == "not judged"


TWO = """
name = "two"
duration_s = 1.0
network = [
    { robot = [{ slot = 0, reference.kind = "line" }, { slot = 2, reference = { kind = "line", start_y_cm = 40 } }] },
    { robot = [{ slot = 1, reference = { kind = "line", start_y_cm = 60 } }] },
]
"""


def test_one_dead_robot_among_others_is_named():
    running = World(parse(TWO, "two"), 0, own_image())
    checks = Checks(running)
    running.robot(0, 2).board.load(image_of(HANGS))
    assert finish(running, checks)["acts_at_all"] == "failed"
    assert {(one.network, one.slot) for one in checks.failures} == {(0, 2)}


def test_a_radio_that_loses_frames_needs_more_of_them():
    assert frames_needed(Radio(), 23) == FRAMES
    assert frames_needed(Radio(lost_frames=0.1), 23) == 13
    assert frames_needed(Radio(lost_frames=1.0), 23) == 0


# Where a robot is and how fast its wheels are: a changed scenario fails, at the tick that is meant.

PERIODS = 60
STARTS_OFF = "network.robot.start_error_x_cm=7.0"
FEW = f"duration_s={PERIODS * CONTROL_PERIOD_TICKS / 24e6}"


def driven(*settings):
    world = World(load("line", [FEW, *settings]).scenario, 2, own_image())
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
    failures, tracks, _ = driven(settings, STARTS_OFF)
    seen = [sample for sample in errors(tracks) if sample.tick >= ticks(from_s)]
    outside = [sample.position_cm > limit_cm for sample in seen]
    leaving = [now and not before for now, before in zip(outside, [False, *outside], strict=False)]
    assert [one.tick for one in failures] == [
        sample.tick for sample, leaves in zip(seen, leaving, strict=True) if leaves
    ]
    assert all(one.wanted == "at most 1 cm from the reference" for one in failures)


def test_without_a_time_the_last_second_of_the_run_is_judged():
    failures, tracks, found = driven("expect.tracks_within_cm=0.001", STARTS_OFF)
    end_tick = PERIODS * CONTROL_PERIOD_TICKS
    first = next(one for one in errors(tracks) if one.tick >= end_tick - 24_000_000)
    assert failures[0].tick == first.tick
    assert failures[0].found == f"{first.position_cm:.3f} cm"
    assert found["tracks_within_cm"] == "failed"


def test_a_robot_settles_in_time_or_fails_when_the_time_is_over():
    failures, tracks, found = driven("expect.settles_within_s=1.5", STARTS_OFF)
    assert (failures, found["settles_within_s"]) == ([], "passed")
    unsettled = [one.tick for one in errors(tracks) if not one.within_limits]
    assert unsettled  # it had to settle first
    within_s = (unsettled[-1] - 1) / 24e6
    failures, _, _ = driven(f"expect.settles_within_s={within_s}", STARTS_OFF)
    assert [one.tick for one in failures] == [unsettled[-1]]
    assert failures[0].wanted.startswith(
        f"within {SETTLED_CM:g} cm and {SETTLED_RAD:g} rad of the reference after"
    )


def test_a_robot_that_drives_over_the_edge_fails_once_for_each_time():
    along_the_edge = ("network.robot.reference.start_y_cm=-6.2", "network.robot.reference.heading_deg=0.0")
    failures, tracks, found = driven("expect.inside_pitch=true", *along_the_edge)
    off = [one.off_pitch for one in errors(tracks)]
    leaving = [
        one.tick
        for one, before in zip(errors(tracks), [False, *off], strict=False)
        if one.off_pitch and not before
    ]
    assert (found["inside_pitch"], [one.tick for one in failures]) == ("failed", leaving)
    assert leaving
    assert driven("expect.inside_pitch=true")[2]["inside_pitch"] == "passed"


def test_wheels_that_are_told_to_turn_too_fast_fail_at_the_command():
    failures, _, _ = driven("expect.wheels_within_m_s={limit_m_s=0.15, overshoot_m_s=10.0}")
    assert failures
    for one in failures:
        assert one.wanted == "orders to a wheel of at most 0.15 m/s"
        assert abs(float(one.found.split()[0])) > 0.15
        assert one.tick % CONTROL_PERIOD_TICKS != 0
    assert driven("expect.wheels_within_m_s=1.46")[2]["wheels_within_m_s"] == "passed"


def test_wheels_that_are_too_fast_without_being_told_fail_too():
    text = """
name = "pushed"
duration_s = 0.5
expect.wheels_within_m_s = { limit_m_s = 0.5, overshoot_m_s = 0.02 }
network = [{ host = "silent", robot = [{ reference.kind = "line" }] }]
"""
    world = World(parse(text, "pushed"), 0, own_image())
    checks = Checks(world)
    (watched,) = checks.devices
    (monitor,) = [one for one in watched.monitors if one.check.name == "wheels_within_m_s"]
    record = world.step().robots[0]
    for tick, v_m_s, w_rad_s in ((0, 0.5, 0.0), (MS, 0.5, 2.0), (2 * MS, 0.5, 2.0), (3 * MS, -0.53, 0.0)):
        monitor.period(msgspec.structs.replace(record, v_m_s=v_m_s, w_rad_s=w_rad_s), tick)
    assert [(one.tick, one.found) for one in monitor.failures] == [
        (MS, "0.5680 m/s of the right one"),
        (3 * MS, "-0.5300 m/s of the left one"),
    ]


# `happens` and `never_happens` judge a condition as a wait finds it, to the tick.

SAID = [
    encode(team(1, 900, 800, ask=True), 3),
    encode(team(3, 500, 400), 3),
    encode(team(4, 0, 0, ask=True), 3),
]
GIVEN = [
    {"event": "answer"},
    {"event": "answer", "slot": 1, "seq": 4, "accepted": 3, "stopped": False},
    {"event": "heard"},
    {"event": "heard", "byte": 0x2D},
    {"event": "frame"},
    {"event": "frame", "slot": 1, "seq": 3},
    {"event": "command", "name": "STT", "side": "right"},
    {"event": "command", "side": "left", "hex": "03 0f 01 90 00 28 0b b8 07 d0"},
    {"event": "received", "byte": 0xD4},
    {"event": "transmitted", "byte": 0xFF},
    {"event": "sent"},
]
NEVER = [
    {"event": "answer", "seq": 5},
    {"event": "answer", "slot": 0},
    {"event": "frame", "seq": 9},
    {"event": "command", "hex": "01 02 03"},
    {"event": "fault"},
    {"event": "touch"},
    {"event": "frame", "network": 1},
]


def heard(name, given):
    keys = {f"condition.{key}": value for key, value in given.items()} | {"until_tick": 1000 * MS}
    world, checks = silent_world("".join(f"{name}.{key} = {json.dumps(keys[key])}\n" for key in keys))
    send(world, SAID)
    verdicts = finish(world, checks)
    return verdicts, [one.tick for one in checks.failures]


@pytest.mark.parametrize("given", GIVEN, ids=str)
def test_a_condition_is_judged_at_the_tick_at_which_a_wait_for_it_ends(given):
    world, checks = silent_world("")
    send(world, SAID)
    event = world.run_until(msgspec.convert(given, CONDITIONS[given["event"]]))
    checks.finish()
    assert heard("never_happens", given)[1] == [event.tick]
    assert heard("happens", given)[0]["happens"] == "passed"


@pytest.mark.parametrize("given", NEVER, ids=str)
def test_what_does_not_come_fails_the_one_and_passes_the_other(given):
    verdict = "not judged" if "network" in given else "failed"
    assert heard("happens", given)[0]["happens"] == verdict
    assert heard("never_happens", given)[1] == []
