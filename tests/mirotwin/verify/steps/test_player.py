"""Steps are done in virtual time: actions take none, waits end at their event and lose nothing."""

from itertools import pairwise
from pathlib import Path

import msgspec
import pytest

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.decoder import Decoder, Received
from miro_protocol.transmission import Transmission
from miro_sim.scenario.errors import ScenarioError
from mirotwin.runs.test_file import run_test
from tests.mirotwin.verify.checks.rig import MS, built, needs_sdcc, own_image, planted
from tests.mirotwin.verify.steps.rig import digest_without_steps, play

BOOTED = "{ pause_ms = 5 }"
DRIVE = '{ send = "team", left_m_s = 0.2, right_m_s = 0.2 }'
STANDING = 'reference = { kind = "line", drive_s = 0.0 }'
TWO_ROBOTS = f"""
duration_s = 1.0
network = [{{ host = "silent", robot = [
    {{ slot = 0, {STANDING} }},
    {{ slot = 2, start_error_y_cm = 20.0, {STANDING} }},
] }}]
"""


def sent_by(player):
    return [one for one in player.trace.script() if isinstance(one, Transmission)]


def frames_of(sent):
    decoder = Decoder(3)
    found = [event for one in sent for event in decoder.feed_symbols(one.symbols())]
    return [event for event in found if isinstance(event, Received)]


def test_actions_take_no_time_and_a_pause_takes_its_time_to_the_tick():
    player = play(f"{DRIVE}, {{ pause_ms = 0.125 }}")
    assert (player.done, player.failure, player.world.tick) == (2, None, 3000)


def test_a_wait_ends_at_the_tick_of_its_event():
    player = play(f'{DRIVE}, {{ wait_for = "frame" }}')
    assert player.world.tick // MS == 24  # key-up and 23 characters, the last one but its stop bit
    assert player.world.robot().board.log.end >= 23


def test_what_happens_in_a_pause_is_there_for_the_next_waits_in_its_order():
    waits = ", ".join(
        f'{{ expect = "received", byte = {byte}, within_ms = 0 }}' for byte in (0x31, 0x32, 0x33)
    )
    late = play(f'{BOOTED}, {{ send = "bytes", hex = "31 32 33" }}, {{ pause_ms = 300 }}, {waits}')
    assert (late.done, late.failure) == (6, None)
    assert late.world.tick == 305 * MS


def test_a_pause_of_seconds_loses_nothing_of_its_begin():
    steps = (
        f'{DRIVE}, {{ stream = "on" }}, {{ pause_ms = 2500 }}, {{ expect = "frame", seq = 1, within_ms = 0 }}'
    )
    player = play(steps, "duration_s = 3.0")
    assert player.failure is None
    board = player.world.robot().board
    assert board.log.first > 0  # its log no longer holds the begin


def test_from_now_passes_over_what_has_happened():
    steps = BOOTED + ', { send = "bytes", hex = "31 32" }, { pause_ms = 50 }, '
    assert play(steps + '{ wait_for = "received", within_ms = 5 }').failure is None
    failure = play(steps + '{ wait_for = "received", within_ms = 5, from_now = true }').failure
    assert (failure.number, failure.tick) == (4, 60 * MS)
    assert failure.found == "nothing happened meanwhile"


def test_wait_for_passes_over_what_does_not_fit_and_expect_fails_there():
    steps = BOOTED + ', { send = "bytes", hex = "31 32 33" }, '
    assert play(steps + '{ wait_for = "received", byte = 0x33, within_ms = 9 }').failure is None
    failure = play(steps + '{ expect = "received", byte = 0x33, within_ms = 9 }').failure
    assert f"{failure}".startswith("step 3: expect received: tick ")
    assert failure.found == "net0/robot0: received 31h"
    assert failure.wanted == "received with byte = 51 within 9 ms"


def test_a_step_that_is_not_reached_in_time_says_when_what_was_wanted_and_what_was_seen():
    asked = '{ note = "never asked", wait_for = "answer", from_now = true, within_ms = 100 }'
    failure = play(f"{BOOTED}, {DRIVE}, {asked}").failure
    assert (failure.number, failure.begun_tick, failure.tick) == (3, 5 * MS, 105 * MS)
    assert failure.step == "step 3 (never asked): wait_for answer"
    assert failure.wanted == "answer within 100 ms"
    found = "only 1 sent, 23 received, 1 frame, 4 command; the last: tick "
    assert failure.found.startswith(found)
    assert failure.found.endswith("net0/robot0: command right STT")


def test_never_looks_from_now_on_and_fails_at_the_event():
    steps = f'{DRIVE}, {{ pause_ms = 50 }}, {{ never = "command", for_ms = 50 }}'
    assert play(steps).failure is None
    failure = play(f'{DRIVE}, {{ never = "command", name = "STT", for_ms = 50 }}').failure
    assert 24 * MS < failure.tick < 30 * MS
    assert failure.wanted == 'no command with name = "STT" for 50 ms'
    assert failure.found == "net0/robot0: command left STT"


def test_silence_is_of_the_robots_of_a_network():
    assert play(f"{DRIVE}, {{ silence_for_ms = 60 }}").failure is None
    failure = play('{ send = "poll" }, { silence_for_ms = 60 }').failure
    assert failure.found == "net0/pc: heard 55h"


def test_wheels_are_waited_for_and_hold_their_speed():
    steps = """
        { stream = "on", left_m_s = 0.3, right_m_s = -0.3 },
        { wait_for = "wheels", left_m_s = 0.3, right_m_s = -0.3, within_ms = 150 },
        { hold = "wheels", left_m_s = 0.3, right_m_s = -0.3, for_ms = 300 },
        { stream = "off" },
        { hold = "wheels", left_m_s = 0.3, tolerance_m_s = 0.01, for_ms = 200 },
    """
    player = play(steps)
    assert player.done == 4
    assert player.failure.wanted == "wheels with left_m_s = 0.3, tolerance_m_s = 0.01 for 200 ms"
    found = float(player.failure.found.removeprefix("left_m_s = ").partition(",")[0])
    assert 0.285 < found < 0.29
    failure = play(
        f'{BOOTED}, {{ wait_for = "wheels", left_m_s = 0.1, from_now = true, within_ms = 20 }}'
    ).failure
    assert failure.found == "left_m_s = 0.0000, right_m_s = 0.0000; nothing happened meanwhile"


def test_a_stream_sends_a_frame_a_period_until_it_is_told_to_stop_and_a_step_changes_it():
    steps = """
        { stream = "on", left_m_s = 0.1, right_m_s = 0.1, ask = false },
        { pause_ms = 100 },
        { send = "ping" },
        { stream = "on", left_m_s = 0.2, every_ms = 50, frames = 3 },
    """
    sent = sent_by(play(steps, finish=True))
    seqs = [frame.seq for frame in frames_of(sent)]
    assert seqs == list(range(1, len(seqs) + 1))
    assert len(sent) == 3 + 1 + 3
    ticks = [one.tick for one in sent]
    assert [after - before for before, after in pairwise(ticks[:3])] == 2 * [CONTROL_PERIOD_TICKS]
    assert ticks[6] - ticks[5] == 50 * MS
    told = [frame.message(3) for frame in frames_of(sent)]
    assert [frame.velocities[0] for frame in told if hasattr(frame, "velocities")] == [
        *3 * [(1139, 1139)],
        *3 * [(2279, 1139)],
    ]


def test_numbers_are_fresh_and_a_poll_has_that_of_its_robot():
    polls = ", ".join(f'{{ send = "poll", slot = {slot} }}, {{ pause_ms = 40 }}' for slot in (0, 1, 2, 2, 0))
    player = play(f'{{ send = "team", seq = 60 }}, {{ pause_ms = 40 }}, {polls}', finish=True)
    seqs = [frame.seq for frame in frames_of(sent_by(player))]
    assert seqs == [60, 63, 1, 2, 5, 6]  # 64 is no multiple of 3
    assert player.world.robot().counter(0) == 6


def test_a_poll_whose_turn_does_not_come_in_eight_numbers_is_told_so():
    head = "duration_s = 1.0\nset = { network.robots = 5 }"
    what = "step 2: no number that is fresh after 59 asks robot 4: 64 is not a multiple of 5; send a team frame before"
    with pytest.raises(ScenarioError, match=what):
        play('{ send = "team", seq = 59 }, { send = "poll", slot = 4 }', head)


def test_a_robot_in_another_slot_is_told_and_asked_by_default_where_it_is_the_only_one():
    head = "duration_s = 1.0\nset = { network.robot.slot = 2 }"
    steps = f"""
        {DRIVE},
        {{ expect = "wheels", left_m_s = 0.2, right_m_s = 0.2, within_ms = 100 }},
        {{ send = "poll" }},
        {{ expect = "answer", slot = 2, accepted = 2, rejected = 0, within_ms = 60 }}
    """
    assert play(steps, head).failure is None


def test_two_robots_are_told_and_asked_apart():
    steps = """
        { send = "team", team_m_s = [[0.1, 0.1], [0, 0], [-0.1, -0.1]] },
        { send = "poll", slot = 2 },
        { expect = "answer", slot = 2, within_ms = 90 },
        { expect = "wheels", slot = 2, left_m_s = -0.1, right_m_s = -0.1, within_ms = 10 },
        { hold = "wheels", slot = 0, left_m_s = 0.1, right_m_s = 0.1, for_ms = 10 },
        { send = "poll", slot = 0 },
        { expect = "answer", slot = 2, within_ms = 60 },
    """
    failure = play(steps, TWO_ROBOTS).failure
    assert failure.number == 7
    assert "1 answer" in failure.found  # that of the other robot


def test_damage_is_refused_by_the_robot_and_counted():
    steps = """
        { send = "team", wrong_bits = [3, 9] },
        { pause_ms = 40 },
        { send = "team", bad_stop = [22] },
        { pause_ms = 40 },
        { send = "bytes", hex = "55 55! ff 2d d4" },
        { pause_ms = 40 },
        { send = "poll" },
        { expect = "answer", accepted = 1, rejected = 1, within_ms = 60 },
    """
    player = play(steps, finish=True)
    assert player.failure is None
    assert [one.bad_stop for one in sent_by(player)] == [(), (22,), (1,), ()]


def test_service_frames_reach_the_chips():
    steps = """
        { send = "filter", kp = 1, ki = 2, kd = 3, il = 4 },
        { wait_for = "command", name = "LFIL", side = "left", hex = "03 0f 00 01 00 02 00 03 00 04", within_ms = 40 },
        { send = "acceleration", acceleration_m_s2 = 3.0 },
        { pause_ms = 50 },
        { send = "team", left_m_s = 1.0, right_m_s = 1.0 },
        { wait_for = "command", name = "LTRJ", within_ms = 40 },
    """
    player = play(steps)
    assert player.failure is None


def test_a_symbol_a_pin_and_an_lm629_command_are_waited_for():
    steps = f"""
        {DRIVE},
        {{ wait_for = "reached", symbol = "motion_stop", within_ms = 200 }},
        {{ wait_for = "edge", pin = "left.wr", level = 0, within_ms = 2 }},
        {{ wait_for = "command", name = "STT", side = "right", within_ms = 4 }},
    """
    player = play(steps)
    assert player.failure is None
    assert 134 * MS < player.world.tick < 137 * MS  # 25 ms of frame, 110 of failsafe


def test_a_check_of_a_step_judges_from_there_on():
    steps = f"""
        {{ check = {{ failsafe_stop_ms = 100.0 }}, note = "wrong on purpose" }},
        {DRIVE},
        {{ pause_ms = 300 }},
        {{ check = {{ failsafe_stop_ms = 100.0 }} }},
    """
    player = play(steps, finish=True)
    assert [[one.verdict for one in checks.verdicts()] for checks in player.checks] == [
        ["failed"],
        ["not judged"],
    ]


def test_what_a_step_saves_is_loaded_and_goes_on_to_the_same_digest():
    player = play(f'{DRIVE}, {{ pause_ms = 12.34 }}, {{ save = "driving.world" }}', finish=True)
    assert digest_without_steps(player, saved=player.saved["driving.world"]) == player.world.digest


def test_a_run_with_steps_is_the_run_in_which_the_same_is_sent_at_the_same_ticks():
    steps = """
        { stream = "on", left_m_s = 0.3, right_m_s = 0.2 },
        { wait_for = "wheels", left_m_s = 0.3, within_ms = 150 },
        { send = "ping" },
        { wait_for = "edge", pin = "txd", within_ms = 200 },
        { hold = "wheels", left_m_s = 0.3, for_ms = 70 },
        { stream = "off" },
        { wait_for = "reached", symbol = "motion_stop", within_ms = 200 },
    """
    player = play(steps, finish=True)
    assert player.failure is None
    assert digest_without_steps(player, player.trace.script()) == player.world.digest


def test_a_firmware_fault_that_stops_the_run_fails_the_step_that_waits():
    faulty = msgspec.structs.replace(own_image(), code=bytes([0xA5]) + own_image().code[1:])
    steps = '{ wait_for = "answer", within_ms = 500 }, { pause_ms = 1 }'
    failure = play(steps, image=faulty, finish=True).failure
    assert failure.number == 1
    assert "a firmware fault has stopped the run" in failure.found


def test_a_radio_that_is_gone_a_reset_and_a_battery_taken_out_are_survived_in_order():
    steps = """
        { pause_ms = 5 },
        { stream = "on", left_m_s = 0.2, right_m_s = 0.2, ask = false },
        { wait_for = "wheels", left_m_s = 0.2, within_ms = 150 },
        { radio = "down" },
        { never = "frame", from_now = true, for_ms = 30 },
    """
    with pytest.raises(ScenarioError, match="from_now: unknown key; it belongs to wait_for and expect"):
        play(steps)
    steps = steps.replace("from_now = true, ", "")
    rest = """
        { wait_for = "wheels", left_m_s = 0, within_ms = 250 },
        { radio = "up" },
        { wait_for = "wheels", left_m_s = 0.2, within_ms = 150 },
        { reset = 1 },
        { never = "command", for_ms = 60 },
        { reset = 0 },
        { wait_for = "wheels", left_m_s = 0.2, within_ms = 200 },
        { stream = "off" },
        { power = "off" },
        { send = "poll" },
        { silence_for_ms = 100 },
        { power = "on" },
        { pause_ms = 5 },
        { send = "poll" },
        { expect = "answer", from_now = true, slot = 0, accepted = 1, within_ms = 60 },
    """
    player = play(steps + rest, "duration_s = 1.5", finish=True)
    assert player.failure is None
    assert digest_without_steps(player, player.trace.script()) == player.world.digest


# Mistakes that are planted in the firmware's source

EXAMPLES = Path(__file__).parents[4] / "examples" / "hil-steps"
ALONE = """
scenario = "silent"
duration_s = 0.5
step = [
    { pause_ms = 5 },
    { send = "team", left_m_s = 0.2, right_m_s = 0.2 },
    { wait_for = "frame", within_ms = 30 },
    { wait_for = "command", name = "STT", side = "right", within_ms = 5 },
    { never = "command", for_ms = 105 },
    { note = "110 ms", wait_for = "command", name = "STT", within_ms = 6 },
]
"""


@pytest.fixture
def alone(tmp_path):
    """A file with steps for the failsafe, and no check."""
    path = tmp_path / "alone.scenario.toml"
    path.write_text(ALONE)
    return path


def test_the_shipped_firmware_passes_steps_alone(alone):
    assert run_test(str(alone), own_image()).verdict == "passed"


@needs_sdcc
@pytest.mark.parametrize("mistake", ["stops 15 ms late", "never stops"])
def test_steps_alone_find_a_failsafe_that_comes_late_or_never(mistake, alone):
    outcome = run_test(str(alone), planted(mistake))
    assert outcome.lines[0].startswith("step failed: step 6 (110 ms): wait_for command: tick ")


@needs_sdcc
def test_steps_alone_find_a_failsafe_that_comes_early(alone):
    early = built("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS - 15)")
    assert run_test(str(alone), early).lines[0].startswith("step failed: step 5: never command: tick ")


@needs_sdcc
def test_a_failsafe_of_125_ms_fails_a_step_and_the_checks_of_the_example():
    outcome = run_test(str(EXAMPLES / "failsafe.scenario.toml"), planted("stops 15 ms late"))
    step, check = outcome.lines[:2]
    assert step.startswith("step failed: step 9 (smooth stop): wait_for command: tick ")
    assert 'wanted command with name = "STT" within 6 ms, found nothing happened meanwhile' in step
    assert check.startswith("expectation failed: failsafe_stop_ms: net0/robot0: tick ")


@needs_sdcc
def test_firmware_that_takes_damaged_frames_fails_the_other_example():
    outcome = run_test(str(EXAMPLES / "damage.scenario.toml"), planted("takes frames with a bad CRC"))
    assert outcome.lines[0].startswith("step failed: step 3: never command: tick ")
