"""A stand-in for the world: periods that look like a run, made by plain arithmetic.

For tests of what reads periods (recording, summary, figure, command line); the world has tests of its own.
"""

import hashlib

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_host.posture import Posture
from miro_protocol.transmission import Transmission
from miro_sim.periods import Axis, Control, Period, RobotPeriod


def axis(index, side):
    commands = ((index * CONTROL_PERIOD_TICKS + 5 + side, 0x1F, "1800002a"),) if index % 2 else ()
    return Axis(
        desired_position=100 * index + side,
        real_position=100 * index - 3,
        desired_velocity=-(index << 16),
        status=0x80 | side,
        pwm_sign=side,
        pwm_magnitude=index % 128,
        commands=commands,
    )


def robot(index, slot=0, network=0, error=None):
    """A robot on the line along +X at 0.2 m/s, off by `error`."""
    at = Posture(0.2 * index * CONTROL_PERIOD_TICKS / 24e6, 0.0, 0.0)
    off = error if error is not None else Posture(0.07 * 0.9**index, 0.017 * 0.9**index, -0.38 * 0.9**index)
    truth = Posture(at.x_m + off.x_m, at.y_m + off.y_m, at.theta_rad + off.theta_rad)
    return RobotPeriod(
        network=network,
        slot=slot,
        reference=at,
        truth=truth,
        v_m_s=0.1 + 0.2,
        w_rad_s=-1e-300,
        measurement=None if index == 0 else truth,
        control=None
        if index == 0
        else Control(0.2, -0.1, 300, -300, {"u1": 0.5, "u2": 0.25, "s1": 1e-9, "s2": -2.0}),
        accepted=index,
        rejected=0,
        stale=0,
        left=axis(index, 0),
        right=axis(index, 1),
    )


def periods(count, robots=((0, 0),)):
    """`count` periods of the robots given as (network, slot)."""
    chain = b""
    for index in range(count):
        tick = index * CONTROL_PERIOD_TICKS
        chain = hashlib.sha256(chain + index.to_bytes(8, "little")).digest()
        down = Transmission(tick + 96_000, ">", bytes(range(23)))
        up = Transmission(tick + 300_000, "<", bytes(range(19)), 0, (3, 18))
        seen = tuple(robot(index, slot, network) for network, slot in robots)
        yield Period(index, tick, seen, (down, up), chain.hex())
