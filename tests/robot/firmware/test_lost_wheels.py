"""Wheels that do not follow: both motors go off, and stay off until the host tells both wheels to stand."""

from itertools import pairwise

import pytest

from miro_protocol.table import POSITION_ERROR_MAX
from miro_robot.lm629.host_port import DEAD, STUCK, WHOLE
from miro_robot.plant import IdealWheels, Plant
from tests.robot.firmware.rig import MS, SAMPLE, Rig, iram

LPES, LTRJ, RSTI = 0x1A, 0x1F, 0x1D
OFF = bytes.fromhex("0100")
MOTOR_OFF, POSITION_ERROR = 0x80, 0x20
SPEED = 2279  # 0.2 m/s
RESET_PINS = 0x20


def told_in_vain(left=SPEED, right=SPEED):
    """A robot with unplugged motors that was told to drive, and the tick at which the frame was dealt with."""
    rig = Rig(plant=Plant())
    rig.team(0, left, right)
    return rig, rig.now


def both_off(rig):
    return all(chip.status & MOTOR_OFF for chip in (rig.board.left, rig.board.right))


@pytest.mark.parametrize(("left", "right"), [(SPEED, SPEED), (SPEED, 0), (0, -SPEED), (16633, 300)])
def test_both_motors_go_off_within_4_ms_after_one_wheel_is_too_far_away(left, right):
    rig, _ = told_in_vain(left, right)
    chips = (rig.board.left, rig.board.right)
    while not any(chip.status & POSITION_ERROR for chip in chips):
        assert not both_off(rig)
        assert all(abs(chip.desired_position) <= POSITION_ERROR_MAX for chip in chips)
        rig.run_to(rig.now + SAMPLE)
    rig.run_ms(4.2)
    assert both_off(rig)
    assert rig.board.left.pwm_magnitude == rig.board.right.pwm_magnitude == 0


def test_a_wheel_that_follows_is_never_lost():
    rig = Rig()
    for seq in range(1, 60):
        rig.team(seq, 16633 if seq % 8 < 4 else -16633, SPEED)
    assert not both_off(rig)
    assert rig.u8("_failsafe_flags") == 0x10  # from power-on


class HeldWheels(IdealWheels):
    """Something holds both wheels while `held`."""

    held = False

    def advance(self, tick):
        if not self.held:
            super().advance(tick)


@pytest.mark.parametrize(("held_ms", "lost"), [(19, False), (21, True)])
def test_a_wheel_at_a_fifth_of_a_metre_a_second_may_be_held_for_19_ms(held_ms, lost):
    rig = Rig(plant=HeldWheels())
    for seq in range(3):
        rig.team(seq, SPEED, SPEED)
    rig.board.plant.held = True
    rig.run_ms(held_ms)
    rig.board.plant.held = False
    rig.team(3, SPEED, SPEED)
    assert both_off(rig) == lost


def test_it_stays_off_until_both_wheels_are_told_to_stand():
    rig, _ = told_in_vain()
    rig.run_ms(60)
    for seq, (left, right) in enumerate([(SPEED, SPEED), (0, SPEED), (-SPEED, 0)], 1):
        rig.told(rig.board.left)
        rig.team(seq, left, right)
        assert both_off(rig)
        assert rig.told(rig.board.left) == []
    assert rig.board.left.status & POSITION_ERROR  # which an answer tells
    rig.team(4, 0, 0)
    assert [c.data for c in rig.told(rig.board.left) if c.opcode == RSTI] == [b"\x00\xdf"]
    assert not rig.board.left.status & (POSITION_ERROR | MOTOR_OFF)
    rig.team(5, 300, 300)
    assert rig.told(rig.board.left)[0].opcode == LTRJ


def test_a_lost_wheel_is_no_failsafe_and_tells_no_flag():
    rig, _ = told_in_vain()
    rig.team(1, SPEED, SPEED, ask=True)
    rig.run_ms(60)
    assert rig.u8("_failsafe_flags") == 0x10
    assert both_off(rig)


def test_the_failsafe_says_nothing_more_to_motors_that_are_off_already():
    rig, _ = told_in_vain()
    rig.run_ms(80)
    rig.told(rig.board.left)
    rig.run_ms(600)
    assert rig.told(rig.board.left) == []


def test_the_limit_survives_a_reset_of_the_chips():
    rig = Rig()
    rig.board.left.port.broken = STUCK
    rig.team(0, SPEED, SPEED)
    rig.board.left.port.broken = WHOLE
    rig.told(rig.board.left)
    rig.team(1, SPEED, SPEED)
    rig.run_ms(5)
    limits = [c.data for c in rig.told(rig.board.left) if c.opcode == LPES]
    assert limits == [POSITION_ERROR_MAX.to_bytes(2, "big")]


@pytest.mark.parametrize("fault", [STUCK, DEAD])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_chip_that_stays_broken_is_reset_eight_times_and_never_again(side, fault):
    rig = Rig()
    getattr(rig.board, side).port.broken = fault
    resets = []
    for seq in range(20):
        rig.writes = rig.board.writes = []
        rig.team(seq, SPEED, -SPEED)
        rig.run_ms(5)
        pins = [latch & RESET_PINS for _, port, latch in rig.board.writes if port == 2]
        resets.append(any(low < high for low, high in pairwise(pins)))
        assert rig.board.left.pwm_magnitude == rig.board.right.pwm_magnitude == 0
    assert sum(resets) == 8
    assert rig.cpu.sfr(0xA0) & RESET_PINS == 0  # held in reset
    rig.team(21, 0, 0, ask=True)
    rig.run_ms(40)
    assert len(rig.sent()) == 19  # it answers all the same


def test_a_chip_that_was_broken_for_a_moment_is_set_up_again_however_often_that_was():
    rig = Rig()
    seq = 0
    for _ in range(10):
        rig.board.left.port.broken = STUCK
        rig.team(seq % 64, SPEED, SPEED)
        rig.board.left.port.broken = WHOLE
        for _ in range(258):
            seq += 1
            rig.team(seq % 64, SPEED, SPEED)
        seq += 1
    assert rig.board.left.trajectory.max_velocity == SPEED << 8
    assert not both_off(rig)


@pytest.mark.parametrize("name", ["_robots", "_slot", "_frame_size"])
@pytest.mark.parametrize("bit", range(8))
def test_a_damaged_copy_of_a_strap_lasts_4_ms(name, bit):
    rig = Rig(slot=1)
    address = iram(name)
    rig.cpu.poke_iram(address, rig.cpu.peek_iram(address) ^ 1 << bit)
    rig.run_ms(4.1)
    rig.team(0, SPEED, -SPEED, slot=1)
    assert rig.counters == (1, 0, 0)
    assert rig.i16("_last_left") == SPEED
    assert (rig.now > 20 * MS, both_off(rig)) == (True, False)
