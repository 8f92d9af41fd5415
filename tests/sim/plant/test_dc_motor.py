"""How a motor behind a bridge turns."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_sim.plant.dc_motor import DcMotor
from tests.naive.dc_motor import speed
from tests.sim.plant.motor_bench import HZ, bench, drive, put_mode

MS = HZ // 1000
RPM = 60 / math.tau
PLAIN = ("bridge", "motor")


def test_without_load_it_turns_as_the_shops_say():
    board = bench(names=PLAIN)
    drive(board, [("forward", 1000 * MS)])
    assert board.read("motor.rpm") == pytest.approx(200, rel=0.005)
    drive(board, [("backward", 1000 * MS)])
    assert board.read("motor.rpm") == pytest.approx(-200, rel=0.005)


def test_it_starts_with_its_time_constant():
    keys = DcMotor(friction_nm=0.0)
    board = bench(keys, names=PLAIN)
    time_constant_s = keys.inertia_kg_m2 * keys.resistance_ohm / keys.torque_constant_nm_a**2
    drive(board, [("forward", int(time_constant_s * HZ))])
    top = 6.0 / keys.torque_constant_nm_a * RPM
    assert board.read("motor.rpm") == pytest.approx(top * (1 - math.exp(-1)), rel=0.01)


def test_it_brakes_quicker_than_it_coasts():
    turns = {}
    for mode in ("brake", "coast"):
        board = bench(names=PLAIN)
        drive(board, [("forward", 1000 * MS)])
        before = board.read("motor.turns")
        drive(board, [(mode, 2000 * MS)])
        assert board.read("motor.rpm") == 0
        turns[mode] = board.read("motor.turns") - before
    assert turns["coast"] > 1.3 * turns["brake"] > 0


@pytest.mark.parametrize("end", ["coast", "brake"])
def test_when_it_stands_it_has_no_events(end):
    board = bench(names=PLAIN)
    assert board.named["motor"].next_tick == NEVER_TICK
    drive(board, [("forward", 100 * MS)])
    assert board.named["motor"].next_tick < NEVER_TICK
    drive(board, [(end, 2000 * MS)])
    assert board.named["motor"].next_tick == NEVER_TICK
    assert board.read("motor.rpm") == 0


def test_a_load_beyond_its_torque_holds_it_and_a_lesser_one_slows_it():
    board = bench(names=PLAIN)
    board.put("motor.load_nm", 0.2)
    drive(board, [("forward", 100 * MS)])
    assert (board.read("motor.rpm"), board.named["motor"].next_tick) == (0, NEVER_TICK)
    board.put("motor.load_nm", 0.03)
    board.run(board.tick + 1000 * MS)
    assert 80 < board.read("motor.rpm") < 150


def test_a_blocked_shaft_stands_at_once_and_goes_on_when_it_is_free():
    board = bench(names=PLAIN)
    drive(board, [("forward", 500 * MS)])
    board.put("motor.blocked", True)
    turns = board.read("motor.turns")
    board.run(board.tick + 500 * MS)
    assert (board.read("motor.rpm"), board.read("motor.turns")) == (0, turns)
    assert board.named["motor"].next_tick == NEVER_TICK
    board.put("motor.blocked", False)
    board.run(board.tick + 500 * MS)
    assert board.read("motor.rpm") > 190


def test_a_flat_battery_does_not_move_it():
    board = bench(DcMotor(supply_v=2.0), names=PLAIN)
    drive(board, [("forward", 500 * MS)])
    assert board.read("motor.rpm") == 0


def test_without_the_supply_of_its_bridge_it_rolls_out():
    board = bench(names=PLAIN)
    drive(board, [("forward", 500 * MS)])
    board.power(0)
    assert board.read("motor.rpm") > 190
    board.run(board.tick + 2000 * MS)
    assert board.read("motor.rpm") == 0


def pwm(hz, share, off, seconds):
    period = HZ // hz
    return [("forward", int(period * share)), (off, period - int(period * share))] * int(seconds * hz)


@pytest.mark.parametrize("hz", [92, 20_000])
@pytest.mark.parametrize("off", ["coast", "brake"])
def test_under_pwm_it_turns_as_its_slow_twin(hz, off):
    stretches = pwm(hz, 0.5, off, 0.3)
    board = bench(names=PLAIN)
    drive(board, stretches)
    wanted, angle = speed([(mode, ticks / HZ) for mode, ticks in stretches])
    assert board.read("motor.rpm") == pytest.approx(wanted * RPM, abs=2)
    assert board.read("motor.turns") == pytest.approx(angle / math.tau, rel=0.02)


STRETCHES = st.lists(
    st.tuples(st.sampled_from(["forward", "backward", "brake", "coast"]), st.integers(1, 60)),
    min_size=1,
    max_size=5,
)


@settings(max_examples=15)
@given(STRETCHES)
def test_it_turns_as_its_slow_twin_whatever_drives_it(stretches):
    """Its speed is that of the last point, a millisecond old at most."""
    board = bench(names=PLAIN)
    drive(board, [(mode, ms * MS) for mode, ms in stretches])
    wanted, angle = speed([(mode, ms / 1000) for mode, ms in stretches])
    assert board.read("motor.rpm") == pytest.approx(wanted * RPM, abs=8)
    assert board.read("motor.turns") == pytest.approx(angle / math.tau, abs=0.02)


@settings(max_examples=25)
@given(STRETCHES, st.lists(st.integers(1, 60), max_size=4))
def test_nobody_who_looks_changes_it_and_saving_and_loading_neither(stretches, cuts):
    board, quiet = bench(names=PLAIN), bench(names=PLAIN)
    for mode, ms in stretches:
        begin = board.tick
        put_mode(board, mode)
        for cut in sorted(cuts):
            board.run(begin + min(cut, ms) * MS)
            board.read("motor.turns")
            other = bench(names=PLAIN)
            other.load(board.save())
            other.tick = board.tick
            board = other
        board.run(begin + ms * MS)
        drive(quiet, [(mode, ms * MS)])
        assert board.save() == quiet.save()


def test_turns_go_on_between_two_points():
    board = bench(names=PLAIN)
    drive(board, [("forward", 500 * MS)])
    begin = board.named["motor"].from_tick
    board.run(begin + 1)
    first = board.read("motor.turns")
    board.run(begin + 1001)
    assert board.read("motor.turns") - first == pytest.approx(board.read("motor.rpm") / 60 * 1000 / HZ)
