"""What happens without fresh frames, measured at the LM629."""

import pytest

from miro_protocol.frames import TeamFrame, encode
from miro_robot.lm629.options import Lm629Options
from tests.robot.firmware.rig import CHARACTER, MS, SAMPLE, US, Rig

STT, LTRJ = 0x01, 0x1F
STOP, OFF = bytes.fromhex("0400"), bytes.fromhex("0100")
PLACES = [(0, 3), (4, 5)]


def driving(place, velocity=2279, chips=None):
    """A robot just told to drive at 0.2 m/s, and the tick of the last start bit."""
    rig = Rig(*place, options=chips)
    rig.run_ms(20)
    last = rig.team(0, velocity, -velocity, slot=place[0])
    rig.told(rig.board.left)
    rig.told(rig.board.right)
    return rig, last


def stop_after_ms(rig, end):
    """From `end`, the end of the last fresh frame, to the smooth stop; the left wheel is told nothing in between."""
    rig.told(rig.board.left)
    rig.run_to(end + 116 * MS)
    stop, start, *_ = rig.told(rig.board.left)
    assert (stop.data, start.opcode) == (STOP, STT)
    return (start.tick - end) / MS


@pytest.mark.parametrize("place", PLACES)
def test_both_wheels_stop_smoothly_after_110_ms_and_go_off_after_500(place):
    rig, last = driving(place)
    end = last + CHARACTER
    rig.run_to(end + 600 * MS)
    for chip in (rig.board.left, rig.board.right):
        stop, start, off, open_loop = rig.told(chip)
        assert (stop.opcode, stop.data, start.opcode) == (LTRJ, STOP, STT)
        assert (off.opcode, off.data, open_loop.opcode) == (LTRJ, OFF, STT)
        assert 109.7 * MS <= start.tick - end <= 110 * MS
        assert 499.7 * MS <= open_loop.tick - end <= 500 * MS
        assert chip.status & 0x80


@pytest.mark.parametrize("place", PLACES)
def test_the_wheels_stand_by_110_ms_and_the_ramp_and_one_sample(place):
    rig, last = driving(place)
    rig.run_to(last + CHARACTER + 110 * MS)
    assert rig.board.left.desired_velocity == 2279 << 8
    ramp = -(-(2279 << 8) // 5973)
    rig.run_to(last + CHARACTER + 110 * MS + (ramp + 1) * SAMPLE)
    assert rig.board.left.desired_velocity == rig.board.right.desired_velocity == 0


def test_fresh_frames_keep_it_driving():
    rig, _ = driving((0, 3))
    for seq in range(1, 6):
        rig.run_ms(75)  # a frame takes 24 ms and 4 to settle
        rig.team(seq, 2279, -2279)
    commands = rig.told(rig.board.left)
    assert [
        command.data for command in commands if command.opcode == LTRJ and command.data in (STOP, OFF)
    ] == []
    assert rig.board.left.desired_velocity == 2279 << 8


def test_stale_frames_do_not_keep_it_driving():
    rig, last = driving((0, 3))
    for _ in range(4):
        rig.team(0, 2279, -2279)
    assert rig.counters == (1, 0, 4)
    rig.run_to(last + 112 * MS)
    assert [command.data for command in rig.told(rig.board.left)][:1] == [STOP]


def test_a_frame_during_the_stop_resumes_driving():
    rig, last = driving((0, 3))
    rig.run_to(last + 112 * MS)
    rig.team(1, 1000, 1000)
    assert [c.opcode for c in rig.told(rig.board.left)] == [LTRJ, STT, LTRJ, STT]
    rig.run_ms(40)
    assert rig.board.left.desired_velocity == 1000 << 8


def test_a_frame_after_motors_off_closes_the_loop_again():
    rig, last = driving((0, 3))
    rig.run_to(last + 700 * MS)
    assert rig.board.left.status & 0x80
    rig.team(1, 1000, 1000)
    assert not rig.board.left.status & 0x80
    rig.run_ms(40)
    assert rig.board.left.desired_velocity == rig.board.right.desired_velocity == 1000 << 8


def test_the_same_frame_repeated_never_rearms_a_stopped_robot():
    rig, last = driving((0, 3))
    rig.run_to(last + 700 * MS)
    for _ in range(3):
        rig.team(0, 2279, 2279)
    assert rig.counters == (1, 0, 3)
    assert rig.board.left.status & 0x80


@pytest.mark.parametrize("place", PLACES)
def test_a_long_step_is_fresh_again_from_150_ms_on(place):
    for age, accepted in ((140, 1), (149.95, 1), (150.05, 2), (170, 2)):
        rig, last = driving(place)
        length = (17 + 5 if place[1] == 3 else 25 + 5) * CHARACTER  # first to last start bit
        rig.run_to(last + int(age * MS) - length)
        rig.line_free = 0
        final = rig.team(40, 0, 0)
        assert abs(final - last - age * MS) < MS / 100
        assert rig.counters == (accepted, 0, 2 - accepted), age


def before_the_wrap():
    """A robot 86 ms before its counter of milliseconds wraps, and the tick at which it will."""
    rig = Rig()
    while rig.u8("_ticks") != 170:
        rig.run_ms(0.1)
    return rig, rig.now + 86 * MS


@pytest.mark.parametrize("quarter", range(-16, 5))
def test_110_ms_count_from_the_frame_wherever_the_millisecond_counter_wraps(quarter):
    rig, wrap = before_the_wrap()
    end = wrap + quarter * MS // 4
    data = encode(TeamFrame(0, 0, ((1000, 1000),) * 3), 3)
    rig.send(data, at=end - len(data) * CHARACTER)
    rig.run_to(end + 10 * MS)
    assert 109.7 <= stop_after_ms(rig, end) <= 110


@pytest.mark.parametrize("quarter", range(-8, 9))
def test_a_long_step_is_stale_wherever_the_millisecond_counter_wraps(quarter):
    rig, wrap = before_the_wrap()
    rig.frame(encode(TeamFrame(0, 0, ((0, 0),) * 3), 3))
    rig.send(encode(TeamFrame(0, 30, ((0, 0),) * 3), 3), at=wrap - 22 * CHARACTER + quarter * MS // 4)
    rig.run_to(wrap + 10 * MS)
    assert rig.counters == (1, 0, 1)


def test_no_wheel_moves_before_the_first_frame():
    rig = Rig()
    rig.run_ms(700)
    assert rig.told(rig.board.left) == rig.told(rig.board.right) == []


ACCELERATION = 2
LOADING_MS = [i / 10 for i in range(-6, 13)]


def loading(place, chips=None):
    """A robot that stops and has an acceleration to load, and the tick at which it begins to do so."""
    ticks = []
    for until in (None, 0):
        rig, _ = driving(place, chips=chips)
        rig.service(1, place[0], ACCELERATION, 9000)
        rig.team(2, 0, 0, slot=place[0])
        if until is None:
            rig.told(rig.board.left)
            rig.run_ms(60)
            ticks = [c.tick for c in rig.told(rig.board.left) if c.opcode == LTRJ]
    (tick,) = ticks
    return rig, tick


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("late_ms", LOADING_MS)
def test_110_ms_count_from_the_character_also_when_the_robot_was_loading(place, late_ms):
    rig, tick = loading(place)
    data = encode(TeamFrame(0, 3, ((1000, 1000),) * place[1]), place[1])
    end = tick - int(late_ms * MS)
    rig.send(data, at=end - len(data) * CHARACTER)
    rig.run_to(end + 4 * MS)
    assert rig.u16("_frames_accepted") == 4
    assert 109.7 <= stop_after_ms(rig, end) <= 110


def stop_behind(rig, seq, behind, at):
    """Milliseconds from the end of a frame that ends at `at`, with characters right after it, to the stop."""
    data = encode(TeamFrame(0, seq, ((1000, 1000),) * rig.n), rig.n)
    rig.send(data + bytes(behind), at=at - len(data) * CHARACTER)
    rig.run_to(at + 15 * MS)
    assert rig.u16("_frames_accepted") == seq + 1
    return stop_after_ms(rig, at)


@pytest.mark.parametrize("behind", [0, 1, 2])
@pytest.mark.parametrize("late_us", [-2000, -1400, -600, 400])
def test_characters_that_come_while_slow_chips_hold_the_robot_up_make_no_stop_late(behind, late_us):
    chips = Lm629Options(
        busy_clocks=2000
    )  # 333 us; loading an acceleration takes more than a character's time
    rig = Rig(options=chips)
    rig.run_ms(20)
    undisturbed = stop_behind(rig, 0, 0, rig.now + 30 * MS)
    rig, tick = loading((0, 3), chips)
    held_up = stop_behind(rig, 3, behind, tick + late_us * US)
    assert abs(held_up - undisturbed) <= 0.05


PAUSES_US = [0, 25, 300, 450, 600, 650, 700, 900, 1200, 1600]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("behind", [1, 2, 5])
@pytest.mark.parametrize("pause_us", PAUSES_US)
def test_110_ms_count_from_the_frame_also_with_characters_behind_it(place, behind, pause_us):
    rig = Rig(*place)
    rig.send(encode(TeamFrame(0, 0, ((1000, 1000),) * place[1]), place[1]))
    end = rig.line_free
    rig.send(bytes(behind), at=end + pause_us * MS // 1000)
    rig.run_to(end + 12 * MS)
    assert 109.7 <= stop_after_ms(rig, end) <= 110
