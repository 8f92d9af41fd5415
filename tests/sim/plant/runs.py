"""What the drive's tests do with a drive: PWM as the board gives it, and a script that any engine can run."""

from miro_exact.state import Flat
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import Chassis, Disturbance, DriveParams, RollingBall, Tyre
from miro_sim.plant.rough import RoughBody

PERIOD = 2048


def kinetic_energy_j(body):
    """Energy of translation, rotation and both rotors."""
    left, right = body.left_rad_s, body.right_rad_s
    if not isinstance(body, RoughBody):
        return 0.5 * (
            body.mass_ll * left * left + 2.0 * body.mass_lr * left * right + body.mass_rr * right * right
        )
    moving = body.mass_kg * (body.v_m_s * body.v_m_s + body.u_m_s * body.u_m_s)
    return 0.5 * (
        body.rotor_kg_m2 * (left * left + right * right)
        + moving
        + body.yaw_kg_m2 * body.w_rad_s * body.w_rad_s
    )


def pwm(drive, left, right, periods):
    """Runs PWM periods with magnitudes -128..128 (16 ticks each), both phases starting at the period."""
    tick = drive.tick
    for _ in range(periods):
        for side, value in enumerate((left, right)):
            drive.set_bridge(tick, side, 1 if value else 0, 1 if value >= 0 else 0)
        for on, side, value in sorted(
            (16 * abs(value), side, value) for side, value in enumerate((left, right))
        ):
            if 0 < on < PERIOD:
                drive.advance(tick + on)
                drive.set_bridge(tick + on, side, 0, 1 if value >= 0 else 0)
        tick += PERIOD
        drive.advance(tick)


PATTERN = ((60, 70), (127, 128), (-128, 20), (0, 0), (3, -3), (-40, -50), (90, -90), (0, 0), (9, 9))


TRACED = {
    "plain": DriveParams(),
    "rough": DriveParams(
        tyre=Tyre(grip=0.25),
        ball=RollingBall(friction=0.3),
        chassis=Chassis(
            stiction_ratio=1.5, left_radius_factor=0.985, gear_backlash_rad=0.02, gear_load_friction=0.2
        ),
        disturbance=Disturbance(force_n=0.1, sine_torque_nm=0.01, noise_force_n=0.2, period_s=0.05),
    ),
}


def trace(name):
    """Every state (floats as hex) of a drive after each stretch of the pattern."""
    drive, lines = DifferentialDrive(TRACED[name], 0.1, 0.2, -1.0), []
    for left, right in PATTERN:
        pwm(drive, left, right, 60)
        state = Flat(drive)
        lines += [f"{path} {float(number).hex()}" for path, number in state.decode(state.save()).items()]
    return lines
