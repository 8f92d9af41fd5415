"""What the drive's tests do with a drive: PWM as the board gives it, and a script that any engine can run."""

from miro_exact.state import Flat

PERIOD = 2048


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


def trace(make, periods):
    """Every state (floats as hex) after each stretch of the pattern."""
    drive = make()
    lines = []
    for left, right in PATTERN:
        pwm(drive, left, right, periods)
        state = Flat(drive)
        lines += [f"{path} {float(number).hex()}" for path, number in state.decode(state.save()).items()]
    return lines
