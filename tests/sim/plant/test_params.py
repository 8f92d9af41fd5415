"""Drive parameters: figures that must close on themselves, and refusals."""

import math
from pathlib import Path

import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from miro_sim.plant import params
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Battery, Bridge, Chassis, DriveParams, Motor, OpticalEncoder, Tyre
from tests.sim.plant.runs import pwm

PARAMS = DriveParams()
TABLES = [
    Tyre(grip=1.0) if name == "tyre" else getattr(PARAMS, name) for name in DriveParams.__struct_fields__
]


def test_catalogue_figures_follow_from_the_motor_constants():
    motor = PARAMS.motor
    no_load_a = motor.friction_nm / motor.torque_constant_nm_a
    no_load_rad_s = (6.0 - no_load_a * motor.resistance_ohm) / motor.torque_constant_nm_a
    stall_nm = motor.torque_constant_nm_a * 6.0 / motor.resistance_ohm
    time_constant_s = motor.rotor_inertia_kg_m2 * motor.resistance_ohm / motor.torque_constant_nm_a**2
    assert no_load_a == pytest.approx(0.029, rel=0.01)
    assert no_load_rad_s * 60 / (2 * math.pi) == pytest.approx(8200, rel=0.002)
    assert stall_nm == pytest.approx(21.2e-3, rel=0.015)
    assert time_constant_s == pytest.approx(11e-3, rel=0.01)


def test_rolling_costs_62_milliamperes_per_motor():
    assert PARAMS.friction_nm() / PARAMS.motor.torque_constant_nm_a == pytest.approx(0.062, rel=0.02)


def test_the_encoder_gives_2048_counts_a_motor_turn():
    assert PARAMS.counts_per_radian() * 2 * math.pi == pytest.approx(2048)


def test_each_wheel_has_its_own_radius():
    params = DriveParams(chassis=Chassis(left_radius_factor=0.99, right_radius_factor=1.01))
    assert (params.radius_m(0), params.radius_m(1)) == (0.020 * 0.99, 0.020 * 1.01)


@pytest.mark.parametrize("table", TABLES, ids=lambda table: type(table).__name__)
def test_every_number_has_a_range_whose_ends_are_in_it(table):
    numbers = {name for name in table.__struct_fields__ if not isinstance(getattr(table, name), bool)}
    assert table.WITHIN.keys() == numbers
    for name, (low, high) in table.WITHIN.items():
        for end in (low, high):
            assert getattr(type(table)(**{name: end}), name) == end
        for beyond in (low - 0.01 * abs(high), high * 1.01, math.nan):
            with pytest.raises(ValueError, match=f"{name} must be"):
                type(table)(**{name: beyond})


def test_the_readme_has_every_range():
    page = " ".join((Path(params.__file__).parent / "README.md").read_text(encoding="utf-8").split())
    for table in (Motor, Bridge, Battery, Chassis, OpticalEncoder):
        for name, (low, high) in table.WITHIN.items():
            assert f"`{name}` {low:g} to {high:g}" in page


@st.composite
def drives(draw):
    """A drive with figures anywhere in their ranges, evenly by their logarithm, that may be together."""
    tables = {}
    for name, kind in (("motor", Motor), ("battery", Battery), ("chassis", Chassis)):
        keys = {}
        for key in draw(st.sets(st.sampled_from(sorted(kind.WITHIN)))):
            low, high = kind.WITHIN[key]
            low = low or 1e-6
            keys[key] = min(low * (high / low) ** draw(st.floats(0.0, 1.0)), high)
        tables[name] = kind(**keys)
    try:
        return DriveParams(**tables)
    except ValueError:  # together they make too quick a motor
        reject()


@given(drives())
def test_no_shaft_that_is_driven_turns_faster_than_twice_its_speed_without_load(params):
    """So a step has few encoder edges, whatever the figures. Twice: with a large inductance speed overshoots."""
    drive = DifferentialDrive(params)
    most = 2.0 * params.battery.voltage_v / params.motor.torque_constant_nm_a
    for _ in range(300):
        pwm(drive, 128, -128, 1)
        assert abs(drive.body.left_rad_s) <= most
        assert abs(drive.body.right_rad_s) <= most
