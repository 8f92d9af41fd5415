"""The bridge and the winding: against tiny Euler steps, against the energy balance, at the special cases."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.naive.plant import winding_run

from miro_exact.state import restore, snapshot
from miro_sim.plant.circuit import Winding
from miro_sim.plant.params import DriveParams

PARAMS = DriveParams()
BRIDGES = {1: (1, 1), -1: (1, 0), 0: (0, 1)}
DRIVES = st.sampled_from((-1, 0, 1))
CURRENTS = st.one_of(st.just(0.0), st.floats(-2.5, 2.5))
EMFS = st.floats(-12.0, 12.0)
TICKS = st.integers(1, 2048)


def winding(drive, current):
    made = Winding(PARAMS)
    made.set_bridge(*BRIDGES[drive])
    made.current_a = current
    return made


@settings(deadline=None, max_examples=40)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_current_and_charge_are_those_of_tiny_euler_steps(drive, current, emf, ticks):
    one = winding(drive, current)
    charge = one.step(ticks, emf)
    naive_current, naive_charge = winding_run(PARAMS, drive, current, emf, ticks, parts=2)
    assert one.current_a == pytest.approx(naive_current, abs=0.006)
    assert charge == pytest.approx(naive_charge, abs=0.006 * ticks, rel=0.005)


@settings(deadline=None, max_examples=300)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_winding_and_shaft_never_get_more_than_the_battery_gives(drive, current, emf, ticks):
    one = winding(drive, current)
    charge_c = one.step(ticks, emf) / 24e6
    stored = 0.5 * PARAMS.motor.inductance_h * (one.current_a**2 - current**2)
    battery_c = drive * charge_c if drive else -abs(charge_c)
    assert stored + emf * charge_c <= PARAMS.battery.voltage_v * battery_c + 1e-15


@settings(deadline=None, max_examples=200)
@given(DRIVES, CURRENTS, EMFS, TICKS, TICKS)
def test_two_intervals_in_a_row_are_one_long_interval(drive, current, emf, first, second):
    ticks = min(first + second, 2048)
    whole, parts = winding(drive, current), winding(drive, current)
    charge = whole.step(ticks, emf)
    parts_charge = parts.step(first, emf) + (parts.step(ticks - first, emf) if first < ticks else 0.0)
    if first <= ticks:
        assert parts.current_a == pytest.approx(whole.current_a, abs=1e-12)
        assert parts_charge == pytest.approx(charge, abs=1e-9)


@settings(deadline=None, max_examples=200)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_forward_and_backward_are_mirror_images_to_the_bit(drive, current, emf, ticks):
    one, other = winding(drive, current), winding(-drive, -current)
    assert one.step(ticks, emf) == -other.step(ticks, -emf)
    assert one.current_a == -other.current_a


def test_the_stalled_motor_draws_what_drop_and_resistances_leave():
    one = winding(1, 0.0)
    one.step(2048, 0.0)
    assert one.current_a == pytest.approx((7.2 - 1.0) / (1.94 + 1.35 + 0.15), rel=0.002)


def test_the_current_of_a_switched_off_bridge_dies_into_the_battery_and_stays_at_zero():
    one = winding(0, 1.0)
    one.step(2048, 3.0)
    assert one.current_a == 0.0
    assert one.step(2048, 3.0) == 0.0


def test_after_a_reversal_the_old_current_dies_through_the_diodes_before_the_new_one_grows():
    one = winding(-1, 1.5)
    one.step(100, 0.0)
    assert 0.0 < one.current_a < 1.5
    one.step(2048, 0.0)
    assert one.current_a == pytest.approx(-(7.2 - 1.0) / 3.44, rel=0.002)


@pytest.mark.parametrize(("drive", "emf"), [(0, 9.1), (0, -9.1), (1, 7.0), (-1, -9.1 + 2.5), (1, 9.1)])
def test_nothing_flows_while_the_back_emf_is_between_the_two_thresholds(drive, emf):
    one = winding(drive, 0.0)
    assert one.step(2048, emf) == 0.0
    assert one.current_a == 0.0


def test_a_motor_faster_than_battery_and_diodes_charges_the_battery():
    one = winding(0, 0.0)
    assert one.step(2048, 9.4) < 0.0


@pytest.mark.parametrize("ticks", [-1, 0, 2049])
def test_an_interval_the_tables_do_not_cover_is_refused(ticks):
    with pytest.raises(ValueError, match=r"1\.\.2048"):
        winding(1, 0.0).step(ticks, 0.0)


@settings(deadline=None)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_a_snapshot_goes_on_with_the_same_bits(drive, current, emf, ticks):
    one = winding(drive, current)
    one.step(ticks, emf)
    other = Winding(PARAMS)
    restore(other, snapshot(one))
    assert other.step(ticks, emf) == one.step(ticks, emf)
    assert snapshot(other) == snapshot(one)
    assert math.isfinite(one.current_a)
    assert repr(other) == repr(one)
