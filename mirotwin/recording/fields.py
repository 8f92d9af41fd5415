"""The values of a control period by name: what a robot did, and what its PC made of it."""

from __future__ import annotations

from collections.abc import Iterator

from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_sim.periods import Axis, RobotPeriod

Value = int | float | str | None
Named = Iterator[tuple[str, Value]]
COUNTERS = ("firmware accepted", "firmware rejected", "firmware stale")
"""Absent where an image exports no such symbols: nothing is said about them then."""


def response(robot: RobotPeriod) -> Named:
    """What the robot did: its counters, LM629s, PWM and motion."""
    yield from zip(COUNTERS, (robot.accepted, robot.rejected, robot.stale), strict=True)
    for side, axis in (("left", robot.left), ("right", robot.right)):
        yield from _axis(side, axis)
    yield from _posture("truth", robot.truth)
    yield "truth v_m_s", robot.v_m_s
    yield "truth w_rad_s", robot.w_rad_s


def of_host(robot: RobotPeriod) -> Named:
    """What its PC measured and commanded, and where it should be."""
    yield from _posture("reference", robot.reference)
    seen = robot.measurement
    yield from _posture("measurement", seen)
    if isinstance(seen, Sighting):
        yield "measurement exposed_tick", seen.tick
        yield "measurement confidence", seen.confidence
    control = robot.control
    yield "control v_m_s", None if control is None else control.v_m_s
    yield "control w_rad_s", None if control is None else control.w_rad_s
    yield "control left", None if control is None else control.left
    yield "control right", None if control is None else control.right
    if control is not None:
        yield from ((f"control inner.{name}", value) for name, value in control.inner.items())
        yield from ((f"control estimate.{name}", value) for name, value in control.estimate.items())


def _axis(side: str, axis: Axis) -> Named:
    for name in ("real_position", "desired_position", "desired_velocity", "status"):
        yield f"lm629 {side} {name}", getattr(axis, name)
    yield f"pwm {side} sign", axis.pwm_sign
    yield f"pwm {side} magnitude", axis.pwm_magnitude


def _posture(name: str, at: Posture | None) -> Named:
    for field in ("x_m", "y_m", "theta_rad"):
        yield f"{name} {field}", None if at is None else getattr(at, field)
