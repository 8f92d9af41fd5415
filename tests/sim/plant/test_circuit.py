"""The bridge and the winding: against tiny Euler steps, against the energy balance, at the special cases."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_sim.plant.drive import Winding
from miro_sim.plant.params import Bridge, DriveParams
from tests.naive.plant import NaiveBridge, winding_run
from tests.states import restore, snapshot

PARAMS = DriveParams(bridge=Bridge(on_delay_s=0.0, off_delay_s=0.0))
LATE = DriveParams()
DRIVES = st.sampled_from((-1, 0, 1))
CURRENTS = st.one_of(st.just(0.0), st.floats(-2.5, 2.5))
EMFS = st.floats(-12.0, 12.0)
TICKS = st.integers(1, 2048)


def winding(drive, current):
    made = Winding(PARAMS)
    made.ask(drive)
    made.current_a = current
    return made


@settings(max_examples=40)
@given(DRIVES, CURRENTS, EMFS, TICKS)
@example(-1, 4e-13, 8.0, 1)  # the twin's first part ends at zero: half a tick was half of the change
def test_current_and_charge_are_those_of_tiny_euler_steps(drive, current, emf, ticks):
    one = winding(drive, current)
    charge = one.step(ticks, emf)
    naive_current, naive_charge = winding_run(PARAMS, drive, current, emf, ticks, parts=4)
    assert one.current_a == pytest.approx(naive_current, abs=0.006)
    assert charge == pytest.approx(naive_charge, abs=0.006 * ticks, rel=0.005)


@settings(max_examples=300)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_winding_and_shaft_never_get_more_than_the_battery_gives(drive, current, emf, ticks):
    one = winding(drive, current)
    charge_c = one.step(ticks, emf) / 24e6
    stored = 0.5 * PARAMS.motor.inductance_h * (one.current_a**2 - current**2)
    battery_c = drive * charge_c if drive else -abs(charge_c)
    assert stored + emf * charge_c <= PARAMS.battery.voltage_v * battery_c + 1e-15


@settings(max_examples=200)
@given(DRIVES, CURRENTS, EMFS, TICKS, TICKS)
def test_two_intervals_in_a_row_are_one_long_interval(drive, current, emf, first, second):
    ticks = min(first + second, 2048)
    whole, parts = winding(drive, current), winding(drive, current)
    charge = whole.step(ticks, emf)
    parts_charge = parts.step(first, emf) + (parts.step(ticks - first, emf) if first < ticks else 0.0)
    if first <= ticks:
        assert parts.current_a == pytest.approx(whole.current_a, abs=1e-12)
        assert parts_charge == pytest.approx(charge, abs=1e-9)


@pytest.mark.slow
@settings(max_examples=200)
@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_forward_and_backward_are_mirror_images_to_the_bit(drive, current, emf, ticks):
    one, other = winding(drive, current), winding(-drive, -current)
    assert one.step(ticks, emf) == -other.step(ticks, -emf)
    assert one.current_a == -other.current_a


def test_the_current_of_a_switched_off_bridge_dies_into_the_battery_and_stays_at_zero():
    one = winding(0, 1.0)
    one.step(2048, 3.0)
    assert one.current_a == 0.0
    assert one.step(2048, 3.0) == 0.0


@pytest.mark.parametrize(("drive", "emf"), [(0, 9.1), (0, -9.1), (1, 7.0), (-1, -9.1 + 2.5), (1, 9.1)])
def test_nothing_flows_while_the_back_emf_is_between_the_two_thresholds(drive, emf):
    one = winding(drive, 0.0)
    assert one.step(2048, emf) == 0.0
    assert one.current_a == 0.0


def on_intervals(params, pulses):
    """[(first, last) tick] at which the bridge drives forward, looked at tick by tick; `pulses` are ticks of EN."""
    one, found = Winding(params), []
    for tick in range(2048):
        if tick in pulses:
            one.ask(pulses[tick])
        if one.drive == 1 and found and found[-1][1] == tick - 1:
            found[-1] = (found[-1][0], tick)
        elif one.drive == 1:
            found.append((tick, tick))
        one.step(1, 0.0)
    return found


def test_the_bridge_turns_on_7_ticks_and_off_62_ticks_after_its_enable_pin():
    """ST's sheet: on after 0.3 us; off after 2.2 us (sink) to 3 us (source)."""
    assert on_intervals(LATE, {100: 1, 292: 0}) == [(107, 353)]


@settings(max_examples=60)
@given(st.lists(st.tuples(DRIVES, st.integers(1, 100)), min_size=1, max_size=12), EMFS)
def test_intervals_cut_anywhere_see_the_bridge_switch_as_the_slow_twin_does(changes, emf):
    one, naive = Winding(LATE), NaiveBridge(LATE)
    tick, current, charge, naive_charge = 0, 0.0, 0.0, 0.0
    for drive, ticks in changes:
        one.ask(drive)
        naive.ask(tick, drive)
        charge += one.step(ticks, emf)
        for at in range(tick, tick + ticks):
            current, passed = winding_run(LATE, naive.at(at), current, emf, 1, parts=2)
            naive_charge += passed
        tick += ticks
        assert one.drive == naive.at(tick)
    assert one.current_a == pytest.approx(current, abs=0.01)
    assert charge == pytest.approx(naive_charge, abs=0.01 * tick, rel=0.005)


@pytest.mark.parametrize(
    ("pulses", "intervals"),
    [
        ({100: 1, 1000: 0, 1048: 1, 1500: 0}, [(107, 1561)]),  # 125/128 leave a gap of 48 ticks
        ({100: 1, 1000: 0, 1064: 1, 1500: 0}, [(107, 1061), (1071, 1561)]),  # 124/128 leave one of 64
        ({100: 1, 106: 0}, []),
        ({100: 1, 116: 0}, [(107, 177)]),  # the shortest of a chip
    ],
)
def test_gaps_and_pulses_shorter_than_the_delays_vanish(pulses, intervals):
    assert on_intervals(LATE, pulses) == intervals


def test_at_12_of_128_the_delays_carry_half_as_much_charge_again():
    """8 us at 2 V of back-EMF, which is 0.7 m/s."""
    charges = []
    for params in (PARAMS, LATE):
        one = Winding(params)
        for _ in range(2):
            one.ask(1)
            charge = one.step(192, 2.0)
            one.ask(0)
            charge += one.step(1856, 2.0)
        charges.append(charge)
    assert charges[1] / charges[0] == pytest.approx(1.54, abs=0.01)


def test_the_drop_is_that_of_st_s_typical_saturations():
    drops = [LATE.bridge.drop_v + LATE.bridge.drop_ohm * amperes for amperes in (1.0, 2.0)]
    assert drops == pytest.approx([1.35 + 1.2, 2.0 + 1.7])


@pytest.mark.parametrize(
    ("late", "known"), [(LATE, PARAMS), (DriveParams(bridge=Bridge(on_delay_s=1e-6)), LATE)]
)
def test_a_saved_bridge_that_waits_longer_than_its_delay_is_refused(late, known):
    waiting, other = Winding(late), Winding(known)
    waiting.ask(1)
    with pytest.raises(ValueError, match="waits"):
        restore(other, snapshot(waiting))


@given(DRIVES, DRIVES, st.integers(1, 70))
def test_a_bridge_saved_while_it_waits_switches_on_the_same_tick(first, then, ticks):
    one, other = Winding(LATE), Winding(LATE)
    one.ask(first)
    one.step(200, 0.0)
    one.ask(then)
    one.step(ticks, 0.0)
    restore(other, snapshot(one))
    for each in (one, other):
        each.step(30, 0.0)
    assert snapshot(other) == snapshot(one)


@pytest.mark.parametrize("ticks", [-1, 0, 2049])
def test_an_interval_the_tables_do_not_cover_is_refused(ticks):
    with pytest.raises(ValueError, match=r"1\.\.2048"):
        winding(1, 0.0).step(ticks, 0.0)


@given(DRIVES, CURRENTS, EMFS, TICKS)
def test_no_current_flows_in_an_open_winding_until_it_is_mended(drive, current, emf, ticks):
    one, other = winding(drive, current), winding(drive, 0.0)
    one.open(1)
    assert (one.step(ticks, emf), one.current_a) == (0.0, 0.0)
    restore(other, snapshot(one))
    assert (other.step(ticks, emf), other.current_a) == (0.0, 0.0)
    other.open(0)
    whole = winding(drive, 0.0)
    whole.step(ticks, emf)
    whole.current_a = 0.0
    assert other.step(ticks, emf) == whole.step(ticks, emf)


def test_a_saved_open_winding_with_a_current_is_refused():
    one, other = winding(1, 0.5), winding(1, 0.0)
    saved = snapshot(one)
    other.open(1)
    with pytest.raises(ValueError, match=r"0\.5 A flow in an open winding"):
        restore(one, saved[:8] + snapshot(other)[8:])
