"""The disturbing force: what it adds up to at a tick, and what a body makes of it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_sim.plant.disturbance import DisturbingForce
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Chassis, Disturbance, DriveParams, Motor, OpticalEncoder, RollingBall, Tyre

SECOND = 24_000_000
TICK = st.integers(0, 1 << 40)


def at(params, tick, seed=0):
    force = DisturbingForce(params, Stream(seed, "disturbance"))
    force.at(tick)
    return force.force_n, force.torque_nm


@given(TICK)
def test_a_constant_is_constant(tick):
    assert at(Disturbance(force_n=0.5, torque_nm=-0.01), tick) == (0.5, -0.01)


@given(TICK, st.floats(0.001, 100.0))
def test_the_sine_has_its_amplitude_and_period_and_begins_at_zero(tick, period_s):
    params = Disturbance(sine_force_n=2.0, sine_torque_nm=0.05, period_s=period_s)
    period = int(period_s * SECOND + 0.5)
    force, torque = at(params, tick)
    assert force == pytest.approx(2.0 * math.sin(2.0 * math.pi * (tick % period) / period), abs=1e-12)
    assert torque == pytest.approx(force / 40.0, abs=1e-12)
    assert at(params, 0) == (0.0, 0.0)


@given(TICK)
def test_noise_is_within_its_bounds_holds_for_a_period_and_is_that_of_the_seed(tick):
    params = Disturbance(noise_force_n=1.0, noise_torque_nm=0.02, period_s=0.5)
    period = SECOND // 2
    begun = tick // period * period
    force, torque = at(params, tick)
    assert (force, torque) == at(params, begun) == at(params, begun + period - 1)
    draws = Stream(0, "disturbance")
    assert force == 2.0 * draws.uniform(2 * (tick // period)) - 1.0
    assert torque == 0.02 * (2.0 * draws.uniform(2 * (tick // period) + 1) - 1.0)
    assert (force, torque) != at(params, tick, seed=1)
    assert (force, torque) != at(params, begun + period)


def test_what_is_off_is_zero():
    assert at(Disturbance(), 12345) == (0.0, 0.0)
    assert not Disturbance(period_s=0.1).is_on()


def test_a_force_and_a_torque_accelerate_mass_and_inertia():
    """Wheels on ice with shafts that turn freely: of the rotors' inertia nearly nothing is felt."""
    params = DriveParams(
        motor=Motor(friction_nm=0.0, rotor_inertia_kg_m2=1e-13, torque_constant_nm_a=2e-5),
        encoder=OpticalEncoder(lines=16),
        chassis=Chassis(rolling_resistance=0.0),
        tyre=Tyre(grip=0.01),
        ball=RollingBall(load_share=0.0),
        disturbance=Disturbance(force_n=0.5, torque_nm=0.002),
    )
    drive = DifferentialDrive(params)
    drive.body.push(0.0, 0.0, 1)  # before the first look at the force there is none
    assert drive.velocity_at(0) == (0.0, 0.0)
    for _ in range(100):
        drive.rough.feel(0)
        drive.body.push(0.0, 0.0, 2048)
    time_s = 100 * 2048 / 24e6
    v, w = drive.velocity_at(0)
    assert v == pytest.approx(0.5 / 0.5 * time_s, rel=1e-3)
    assert w == pytest.approx(0.002 / 4.7e-4 * time_s, rel=1e-3)


def test_a_force_below_the_friction_of_the_drive_moves_nothing():
    """Friction holds 0.17 N at each rim: 0.34 N along, or 11.7 mNm."""
    drive = DifferentialDrive(DriveParams(disturbance=Disturbance(force_n=0.2, torque_nm=0.004)))
    drive.advance(SECOND)
    assert drive.pose_at(drive.tick) == (0.0, 0.0, 0.0)
    drive = DifferentialDrive(DriveParams(disturbance=Disturbance(force_n=0.2, torque_nm=0.006)))
    drive.advance(SECOND)
    assert drive.pose_at(drive.tick)[0] > 0.0


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (Tyre, "grip", 0.0),
        (Tyre, "grip", math.nan),
        (RollingBall, "load_share", 1.0),
        (RollingBall, "behind_m", 3.0),
    ]
    + [(Disturbance, "force_n", 50.0), (Disturbance, "period_s", 0.0), (Disturbance, "sine_torque_nm", -0.1)]
    + [(Chassis, "stiction_ratio", 0.5)],
)
def test_impossible_disturbances_are_refused_by_name(kind, field, value):
    with pytest.raises(ValueError, match=f"{field} must be .* to .*, got"):
        kind(**{field: value})
