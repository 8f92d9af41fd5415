"""Dead, deaf and lame robots fail any run that sends them frames; robots that nothing reaches are not judged."""

import pytest

from miro_sim.radio.params import Radio
from miro_sim.scenario.file import load, parse
from miro_sim.world.world import World
from mirotwin.verify.checks.alive import FRAMES, frames_needed
from mirotwin.verify.checks.monitors import Checks
from tests.mirotwin.verify.checks.rig import built, finish, needs_sdcc, own_image, send, silent_world, team
from tests.mirotwin.verify.conform.images import BABBLES, HANGS, READS_BOTH, image_of

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
    assert "wanted a robot that does not begin again by itself" in str(checks.failures[0])
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
[[network]]
[[network.robot]]
slot = 0
reference.kind = "line"
[[network.robot]]
slot = 2
reference = {kind = "line", start_y_cm = 40.0}
[[network]]
[[network.robot]]
slot = 1
reference = {kind = "line", start_y_cm = 60.0}
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
