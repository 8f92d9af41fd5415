"""The whole drive: figures of the data sheets, tiny Euler steps, energy, determinism."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_robot.lm629.chip import Lm629
from miro_sim.plant.drive import DifferentialDrive, Winding
from miro_sim.plant.params import Battery, Bridge, Chassis, DriveParams, Motor, OpticalEncoder
from tests.children import uncompiled
from tests.naive.plant import NaiveDrive
from tests.robot.lm629.bench import Bench
from tests.sim.plant.runs import TRACED, kinetic_energy_j, pwm, trace
from tests.states import restore, snapshot, values

PARAMS = DriveParams()
PROMPT = DriveParams(bridge=Bridge(on_delay_s=0.0, off_delay_s=0.0))  # a bridge without delays
MAGNITUDES = st.integers(-128, 128)
SECOND = 24_000_000


def speed_after(params, magnitude, seconds=1.5):
    drive = DifferentialDrive(params)
    pwm(drive, magnitude, magnitude, round(seconds * SECOND / 2048))
    return drive.velocity_at(drive.tick)[0]


@pytest.mark.parametrize(("volts", "written_m_s"), [(6.0, 1.59), (7.2, 2.02)])
def test_full_duty_reaches_the_speed_that_drop_and_friction_leave(volts, written_m_s):
    """From the catalogue figures; `written_m_s` stands in the plant's README."""
    params = DriveParams(battery=Battery(voltage_v=volts))
    friction_a = params.friction_nm() / params.motor.torque_constant_nm_a
    rad_s = (volts - 1.4 - friction_a * (1.94 + 1.15 + 0.15)) / params.motor.torque_constant_nm_a
    speed = speed_after(params, 128)
    assert speed == pytest.approx(rad_s * 0.020 / 8, rel=1e-4)
    assert round(speed, 2) == written_m_s


def test_the_bare_motor_runs_at_its_catalogue_speed():
    ideal = DriveParams(
        battery=Battery(voltage_v=6.0, resistance_ohm=1e-9),
        bridge=Bridge(drop_v=0.0, drop_ohm=0.0),
        chassis=Chassis(rolling_resistance=0.0),
    )
    rpm = speed_after(ideal, 128) / 0.020 * 8 * 60 / (2 * math.pi)
    assert rpm == pytest.approx(8200, rel=0.002)


def test_the_loaded_time_constant_is_74_milliseconds_on_an_ideal_supply():
    ideal = DriveParams(
        motor=Motor(friction_nm=0.0),
        battery=Battery(resistance_ohm=1e-9),
        bridge=Bridge(drop_v=0.0, drop_ohm=0.0),
        chassis=Chassis(rolling_resistance=0.0),
    )
    final = 7.2 / 6.92e-3 * 0.020 / 8
    reached = speed_after(ideal, 128, 0.074)
    assert -0.074 / math.log(1 - reached / final) == pytest.approx(0.074, rel=0.01)


def test_speed_rises_with_duty_and_small_duties_do_not_move_the_robot():
    speeds = [speed_after(PARAMS, magnitude, 0.6) for magnitude in (0, 4, 8, 32, 64, 96, 128)]
    assert speeds[:3] == [0.0, 0.0, 0.0]
    assert speeds[2:] == sorted(speeds[2:])
    assert 0.3 < speeds[3] < speeds[4] < speeds[6]


def test_with_zero_duty_the_robot_stands_exactly_still():
    drive = DifferentialDrive(PARAMS, 0.3, -0.1, 1.0)
    before = values(drive)
    pwm(drive, 0, 0, 500)
    after = values(drive)
    assert {name for name in before if after[name] != before[name]} == {"tick", "next_tick"}
    assert drive.pose_at(drive.tick) == (0.3, -0.1, 1.0)


def test_coasting_slows_by_friction_alone_and_ends_exactly_at_rest():
    drive = DifferentialDrive(PARAMS)
    pwm(drive, 40, 40, 3000)
    pwm(drive, 0, 0, 100)
    v0 = drive.velocity_at(drive.tick)[0]
    pwm(drive, 0, 0, 1000)
    v1 = drive.velocity_at(drive.tick)[0]
    roll = 0.020 / 8
    mass = 0.5 + 2 * 2.7e-7 / roll**2
    assert (v0 - v1) / (1000 * 2048 / 24e6) == pytest.approx(2 * PARAMS.friction_nm() / roll / mass, rel=1e-9)
    pwm(drive, 0, 0, 30000)
    assert drive.velocity_at(drive.tick) == (0.0, 0.0)


def test_a_larger_wheel_turns_the_robot_away_from_its_side():
    drive = DifferentialDrive(
        DriveParams(chassis=Chassis(left_radius_factor=1.015, right_radius_factor=0.985))
    )
    pwm(drive, 64, 64, 20000)
    v, w = drive.velocity_at(drive.tick)
    assert w == pytest.approx(-0.03 * v / 0.068, rel=0.1)


@pytest.mark.parametrize("magnitudes", [(60, 60), (128, -128), (-30, 90), (20, 128)])
def test_tiny_euler_steps_go_the_same_way(magnitudes):
    drive, naive = DifferentialDrive(PARAMS), NaiveDrive(PARAMS)
    for stretch in (magnitudes, (0, 0), tuple(-m for m in magnitudes)):
        pwm(drive, *stretch, 60)
        pwm(naive, *stretch, 60)
    v, w = drive.velocity_at(drive.tick)
    naive_v, naive_w = naive.velocity()
    assert v == pytest.approx(naive_v, abs=1.5e-3)
    assert w == pytest.approx(naive_w, abs=0.05)
    assert drive.pose_at(drive.tick) == pytest.approx((naive.x, naive.y, naive.theta), abs=2e-4)


def energy_j(drive):
    currents = (drive.left_winding.current_a, drive.right_winding.current_a)
    return kinetic_energy_j(drive.body) + sum(0.5 * 45e-6 * i * i for i in currents)


@settings(max_examples=30)
@given(st.lists(st.tuples(MAGNITUDES, MAGNITUDES, st.integers(1, 2048)), min_size=1, max_size=150))
def test_no_step_ends_with_more_energy_than_it_had_and_the_battery_gave(steps):
    drive = DifferentialDrive(PROMPT)
    for left, right, ticks in steps:
        for side, value in enumerate((left, right)):
            drive.set_bridge(drive.tick, side, 1 if value else 0, 1 if value >= 0 else 0)
        before, work = energy_j(drive), 0.0
        windings = (drive.left_winding, drive.right_winding)
        for winding, speed in zip(windings, (drive.body.left_rad_s, drive.body.right_rad_s), strict=True):
            copy = Winding(PROMPT)
            restore(copy, snapshot(winding))
            charge_c = copy.step(ticks, 6.92e-3 * speed) / 24e6
            work += 7.2 * (copy.drive * charge_c if copy.drive else -abs(charge_c))
        drive.advance(drive.tick + ticks)
        assert energy_j(drive) <= before + work + 1e-15


def test_both_chips_count_what_the_shafts_have_turned():
    drive, left, right = DifferentialDrive(PARAMS), Lm629(), Lm629()
    drive.attach(left, right)
    pwm(drive, 40, -70, 2000)
    pwm(drive, -30, 30, 300)
    pwm(drive, 0, 0, 20000)  # until everything stands
    drive.left.set_encoder(drive.tick, drive.left_encoder.a(), drive.left_encoder.b())
    drive.right.set_encoder(drive.tick, drive.right_encoder.a(), drive.right_encoder.b())
    assert drive.velocity_at(drive.tick) == (0.0, 0.0)
    assert left.encoder.counts == drive.left_encoder.count > 10_000
    assert right.encoder.counts == drive.right_encoder.count < -10_000


class DrivenBench(Bench):
    """A bench whose chip sees the left encoder of a drive, edge by edge in tick order."""

    def __init__(self, params):
        super().__init__()
        self.plant = DifferentialDrive(params)
        self.plant.attach(self.chip, Lm629())
        self.plant.set_bridge(0, 0, 1, 1)
        self.reset()

    def wait(self, ticks):
        end = self.tick + ticks
        while self.chip.next_tick <= end:
            self.plant.advance(self.chip.next_tick)
            self.chip.advance(self.chip.next_tick)
        self.plant.advance(end)
        self.tick = end


def test_two_indices_a_turn_of_the_motor_apart_are_caught_2048_counts_apart():
    bench = DrivenBench(DriveParams(encoder=OpticalEncoder(index_pulse=True)))
    origin = bench.chip.real_position - bench.plant.left_encoder.count
    captured = []
    while len(captured) < 4:
        bench.command("RSTI", 0)
        bench.command("SIP")
        while not bench.chip.status & 0x08:
            bench.wait(8192)
        captured.append(bench.ask("RDIP"))
    steps = [later - before for before, later in itertools.pairwise(captured)]
    assert all(step > 0 and step % 2048 == 0 for step in steps), steps
    assert abs((captured[0] - origin) % 2048 - 2048) < 64 or abs((captured[0] - origin) % 2048) < 64


def test_without_an_index_channel_nothing_is_ever_caught():
    bench = DrivenBench(PARAMS)
    bench.command("SIP")
    bench.wait(SECOND // 10)
    assert bench.chip.real_position > 3 * 2048
    assert bench.signals() & 0x0009 == 0x0001


def test_looking_changes_nothing_and_a_past_tick_is_no_step():
    drive = DifferentialDrive(PARAMS)
    pwm(drive, 60, 61, 100)
    before = snapshot(drive)
    x, *_ = drive.pose_at(drive.tick)
    later, *_ = drive.pose_at(drive.tick + 1000)
    drive.velocity_at(drive.tick + 5)
    drive.advance(drive.tick - 7)
    assert later > x
    assert snapshot(drive) == before
    assert drive.next_tick == drive.tick + 2048


@pytest.mark.parametrize("periods", [10, 16, 17, 40])
def test_a_long_advance_is_cut_into_pwm_periods(periods):
    one, other = DifferentialDrive(PARAMS), DifferentialDrive(PARAMS)
    for drive in (one, other):
        drive.set_bridge(0, 0, 1, 1)
    one.advance(periods * 2048 + 100)
    for _ in range(periods):
        other.advance(other.next_tick)
    other.advance(periods * 2048 + 100)
    assert snapshot(one) == snapshot(other)


def test_a_drive_that_stands_goes_on_in_pwm_periods_like_one_that_moves():
    """Up to a tick, and between edges of PWM without one: the last step ends by the tick that is asked for."""
    drive = DifferentialDrive(PARAMS)
    drive.attach(Lm629(), Lm629())
    begun = snapshot(drive)
    found = []
    for until in (2047, 2048, 9000, 9001, 10240):
        drive.run_pulses(until)
        found.append((drive.tick, drive.next_tick))
    assert found == [(0, 2048), (2048, 4096), (8192, 10240), (8192, 10240), (10240, 12288)]
    drive.advance(10300)
    assert (drive.tick, drive.next_tick) == (10300, 12348)
    other = DifferentialDrive(PARAMS)
    restore(other, begun)
    other.advance(10300)
    assert snapshot(drive) == snapshot(other)


@pytest.mark.parametrize("side", [0, 1])
def test_a_bridge_that_waits_to_be_on_ends_the_rest(side):
    """The delay is shorter than a step: a drive that stood moves in the step in which its bridge begins to drive."""
    drive = DifferentialDrive(PARAMS)
    drive.advance(5000)
    drive.set_bridge(5000, side, 1, 1)
    drive.advance(7048)
    assert (drive.left_winding, drive.right_winding)[side].current_a > 0.0
    assert (drive.body.left_rad_s, drive.body.right_rad_s)[side] > 0.0


@pytest.mark.parametrize("name", TRACED)
@settings(max_examples=20)
@given(MAGNITUDES, MAGNITUDES, MAGNITUDES, MAGNITUDES)
def test_a_restored_drive_goes_on_with_the_same_bits(name, left, right, next_left, next_right):
    drive, other = DifferentialDrive(TRACED[name]), DifferentialDrive(TRACED[name], 9.0, 9.0, 9.0)
    pwm(drive, left, right, 50)
    restore(other, snapshot(drive))
    assert repr(other) == repr(drive)
    for each in (drive, other):
        pwm(each, next_left, next_right, 50)
    assert snapshot(other) == snapshot(drive)


@pytest.mark.parametrize("name", TRACED)
def test_the_drive_in_use_and_its_uncompiled_source_give_the_same_bits(name):
    code = f"from tests.sim.plant.runs import trace; print('\\n'.join(trace('{name}')))"
    assert uncompiled(code).splitlines() == trace(name)
