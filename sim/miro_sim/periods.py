"""The records of one control period of the world, for recording, summary, figure and replay.

One period is one camera frame, 800800 ticks of 24 MHz. Everything in a `RobotPeriod` is taken at the tick of the
period's exposure, before the host acts on it, except `control`, which is the host's output for it.
"""

import msgspec

from miro_host.posture import Posture
from miro_protocol.actions import Action
from miro_protocol.transmission import Transmission

CommandRecord = tuple[int, int, str]
"""A complete LM629 command: (tick of its last byte, opcode, data bytes in hex)."""

RobotId = tuple[int, int]
"""Network and slot of a robot."""


class Axis(msgspec.Struct, frozen=True, gc=False):
    """One LM629 as an observer sees it, in the chip's own units.

    `desired_position` and `real_position` in counts (the desired one rounded down), `desired_velocity` in
    counts per sample with 16 fraction bits, `status` as read by RDSTAT, `pwm_magnitude` 0..127 with
    `pwm_sign` 1 for negative torque. `commands` holds those completed since the period before.
    """

    desired_position: int
    real_position: int
    desired_velocity: int
    status: int
    pwm_sign: int
    pwm_magnitude: int
    commands: tuple[CommandRecord, ...] = ()


class Control(msgspec.Struct, frozen=True, gc=False):
    """The controller's output for one measurement: z_cmd after its limits, the wheel split, and the law's inner values.

    `left`, `right` in 1/256 count per LM629 sample, before the control noise of the scenario; `inner` by name, as the
    law declares them (`u1` in m/s^2, `u2` in rad/s^2, `s1` in m/s, `s2` in rad/s of equations (13), (16)); `estimate`
    likewise by the estimator.
    """

    v_m_s: float
    w_rad_s: float
    left: int
    right: int
    inner: dict[str, float]
    estimate: dict[str, float] = {}


class RobotPeriod(msgspec.Struct, frozen=True, gc=False):
    """One robot in one control period.

    `truth` has an unwrapped heading. `measurement` is None while the vision delay still fills or a frame
    was missed, `control` is None when the host sent nothing for this robot. The counters are those of the
    firmware (modulo 2^16), None where the image exports no such symbols.
    """

    network: int
    slot: int
    reference: Posture
    truth: Posture
    v_m_s: float
    w_rad_s: float
    measurement: Posture | None
    control: Control | None
    accepted: int | None
    rejected: int | None
    stale: int | None
    left: Axis
    right: Axis


class PartValues(msgspec.Struct, frozen=True, gc=False):
    """The values of the parts of a board at `tick`, by path (`eyes.distance_cm`)."""

    network: int
    slot: int
    tick: int
    values: dict[str, float | int | bool | str]


class Period(msgspec.Struct, frozen=True, gc=False):
    """Control period `index`, which begins at `tick`; `digest` (hex) chains the states up to its end.

    `actions`: what was done to robots, radios and parts meanwhile, as a script or a caller wanted it. `values`: of
    boards with parts, at its end.
    """

    index: int
    tick: int
    robots: tuple[RobotPeriod, ...]
    wire: tuple[Transmission, ...]
    digest: str
    actions: tuple[Action, ...] = ()
    values: tuple[PartValues, ...] = ()
