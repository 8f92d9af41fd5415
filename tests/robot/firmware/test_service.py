"""Service frames: ping, filter gains, acceleration."""

import pytest

from miro_protocol.frames import seal
from miro_protocol.table import downlink
from tests.robot.firmware.rig import MS, SAMPLE, Rig

STT, UDF, LFIL, LTRJ, RDSIGS = 0x01, 0x04, 0x1E, 0x1F, 0x0C
PING, FILTER, ACCELERATION = 0, 1, 2
STOP = bytes.fromhex("0400")


@pytest.fixture
def rig():
    return Rig(slot=1)


def settings_of(commands):
    return [(command.opcode, command.data) for command in commands if command.opcode != RDSIGS]


def test_a_ping_is_fresh_and_changes_nothing(rig):
    rig.team(0, 1000, 1000, slot=1)
    rig.told(rig.board.left)
    for seq in range(1, 5):
        rig.run_ms(70)
        rig.service(seq, 0, PING)
    assert rig.told(rig.board.left) == []
    assert rig.counters == (5, 0, 0)
    assert rig.board.left.desired_velocity == 1000 << 8


def test_filter_gains_reach_both_chips_at_once(rig):
    rig.team(0, 1000, 1000, slot=1)
    for chip in (rig.board.left, rig.board.right):
        rig.told(chip)
    rig.service(1, 1, FILTER, 0x0102, 0x0304, 0x0506, 0x0708)
    for chip in (rig.board.left, rig.board.right):
        assert settings_of(rig.told(chip)) == [(LFIL, bytes.fromhex("030f 0102 0304 0506 0708")), (UDF, b"")]


def test_settings_for_another_slot_are_ignored(rig):
    rig.service(0, 0, FILTER, 1, 2, 3, 4)
    rig.service(1, 2, ACCELERATION, 4000)
    assert rig.told(rig.board.left) == []
    assert rig.counters == (2, 0, 0)


def test_an_acceleration_at_rest_is_in_force_with_the_first_velocity(rig):
    rig.service(0, 1, ACCELERATION, 0x00012345)
    rig.team(1, 16000, 16000, slot=1)
    commands = rig.told(rig.board.left)
    assert settings_of(commands)[0] == (LTRJ, bytes.fromhex("0020 00012345"))
    rig.run_to(commands[-1].tick + 10 * SAMPLE)
    steps, rest = divmod(rig.board.left.desired_velocity, 0x12345)
    assert rest == 0
    assert 9 <= steps <= 10


def test_an_acceleration_in_motion_waits_for_standstill(rig):
    rig.team(0, 8000, -8000, slot=1)
    rig.service(1, 1, ACCELERATION, 3000)
    rig.team(2, 8000, -8000, slot=1)
    rig.run_ms(60)
    rig.told(rig.board.left), rig.told(rig.board.right)
    assert rig.board.left.desired_velocity == 8000 << 8
    rig.team(3, 0, 0, slot=1)  # now it may come to rest, still with the old acceleration
    at_command = rig.told(rig.board.left)
    assert settings_of(at_command)[:2] == [(LTRJ, STOP), (STT, b"")]
    for seq in range(4, 11):
        rig.run_ms(10)
        rig.team(seq, 0, 0, slot=1)
    loaded = settings_of(rig.told(rig.board.left))
    assert loaded[0] == (LTRJ, bytes.fromhex("0020 00000bb8"))
    assert loaded[1][1][:2] == bytes.fromhex("1808")  # the next zero frame is a velocity again
    rig.team(11, 8000, 8000, slot=1)
    start = rig.told(rig.board.left)[-1].tick
    rig.run_to(start + 10 * SAMPLE)
    assert rig.board.left.desired_velocity % 3000 == 0
    assert rig.board.left.desired_velocity == rig.board.right.desired_velocity
    for chip in (rig.board.left, rig.board.right):
        assert not chip.status & 0x02  # no command error: the chip never refused an STT


def test_an_acceleration_waits_through_the_failsafe_too(rig):
    rig.team(0, 8000, 8000, slot=1)
    rig.service(1, 1, ACCELERATION, 3000)
    rig.run_ms(600)
    commands = settings_of(rig.told(rig.board.left))
    assert (LTRJ, bytes.fromhex("0020 00000bb8")) in commands
    assert commands.index((LTRJ, STOP)) < commands.index((LTRJ, bytes.fromhex("0020 00000bb8")))
    rig.team(2, 8000, 8000, slot=1)
    start = rig.told(rig.board.left)[-1].tick
    rig.run_to(start + 20 * SAMPLE)
    assert rig.board.left.desired_velocity % 3000 == 0
    assert not rig.board.left.status & 0x02
    assert start < rig.now < start + 50 * MS


def unchecked(rig, seq, opcode, data):
    """A service frame that `encode` would refuse."""
    body = bytes([1 << 6 | seq, 1, opcode]) + data
    rig.frame(seal(downlink(3), body.ljust(1 + downlink(3).payload_size, b"\0")))


def test_gains_above_32767_reach_the_chips_as_they_came_and_they_keep_15_bits(rig):
    unchecked(rig, 1, FILTER, bytes.fromhex("ffff 0180 ffff ffff"))
    (load, update) = settings_of(rig.told(rig.board.left))
    assert (load, update) == ((LFIL, bytes.fromhex("030f ffff 8001 ffff ffff")), (UDF, b""))
    rig.run_ms(2)
    assert (rig.board.left.pid.kp, rig.board.left.pid.ki) == (0x7FFF, 1)


def test_an_acceleration_above_30_bits_reaches_the_chips_as_it_came_and_they_keep_30_bits(rig):
    unchecked(rig, 1, ACCELERATION, (0xC0000000 + 3000).to_bytes(4, "little"))
    assert settings_of(rig.told(rig.board.left)) == [(LTRJ, bytes.fromhex("0020 c0000bb8"))]
    rig.team(2, 8000, 8000, slot=1)
    rig.run_to(rig.told(rig.board.left)[-1].tick + 10 * SAMPLE)
    steps, rest = divmod(rig.board.left.desired_velocity, 3000)
    assert (rest, 9 <= steps <= 10) == (0, True)


def test_with_acceleration_0_wheels_stay_at_rest_until_another_one_comes(rig):
    unchecked(rig, 1, ACCELERATION, bytes(4))
    rig.team(2, 8000, 8000, slot=1)
    rig.run_ms(50)
    assert rig.board.left.desired_velocity == 0
    rig.service(3, 1, ACCELERATION, 3000)
    for seq in range(4, 8):
        rig.team(seq, 0, 0, slot=1)
    rig.team(8, 8000, 8000, slot=1)
    rig.run_ms(20)
    assert rig.board.left.desired_velocity > 0
    assert not rig.board.left.status & 0x02


@pytest.mark.parametrize(("silence_ms", "status"), [(150, 0), (550, 0x80)], ids=["stopped", "off"])
def test_a_ping_after_the_failsafe_does_not_set_the_wheels_in_motion_again(rig, silence_ms, status):
    rig.team(0, 1000, 1000, slot=1)
    rig.run_ms(silence_ms)
    rig.told(rig.board.left)
    rig.service(1, 1, PING)
    rig.run_ms(100)
    assert rig.told(rig.board.left) == []
    assert rig.board.left.desired_velocity == 0
    assert rig.board.left.status & 0x80 == status


def test_a_robot_whose_slot_is_not_below_n_takes_settings_for_that_slot():
    rig = Rig(slot=7)
    body = bytes([1 << 6 | 1, 7, FILTER]) + bytes(range(8))
    rig.frame(seal(downlink(3), body.ljust(13, b"\0")))
    assert [command.opcode for command in rig.told(rig.board.left)] == [LFIL, UDF]


def test_a_velocity_of_minus_32768_is_cut_off_like_others(rig):
    body = bytes([1]) + bytes(4) + bytes.fromhex("0080 0080") + bytes(4)
    rig.frame(seal(downlink(3), body))
    assert rig.i16("_last_left") == rig.i16("_last_right") == -16633
