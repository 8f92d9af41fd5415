"""Drive parameters: figures that must close on themselves, and refusals."""

import math

import msgspec
import pytest

from miro_sim.plant.params import Battery, Chassis, DriveParams, Motor, OpticalEncoder

PARAMS = DriveParams()


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


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [(Motor, "inductance_h", 0.0), (Battery, "voltage_v", -7.2), (Chassis, "mass_kg", math.nan)]
    + [(Chassis, "rolling_resistance", -0.1), (OpticalEncoder, "lines", 0)],
)
def test_impossible_figures_are_refused_by_name(kind, field, value):
    with pytest.raises(ValueError, match=f"{field} must be .* got"):
        kind(**{field: value})


def test_an_unknown_key_is_refused_with_its_path():
    with pytest.raises(msgspec.ValidationError, match=r"masskg.*\$\.chassis"):
        msgspec.convert({"chassis": {"masskg": 1.0}}, DriveParams)
