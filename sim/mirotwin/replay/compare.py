"""The first place where a replayed run answers otherwise than the recorded one.

What belongs here: the comparison of two control periods. What does not: what is sent again (`script.py`), the command
(`cli/replay.py`), and reading files.

The host's control is not computed again; a robot's response is its counters, LM629s, PWM, motion and telemetry.
"""

from collections.abc import Callable
from typing import Any

import msgspec

from miro_exact.clock import seconds
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Axis, Period, RobotPeriod
from mirotwin.recording.topics import WIRE, robot_topic, wire_topic


class Difference(msgspec.Struct, frozen=True):
    """The first value that a replay has otherwise. `slot` -1: on the wire of a network."""

    tick: int
    network: int
    slot: int
    channel: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        of_robot = self.slot >= 0
        topic = robot_topic(self.network, self.slot, self.channel) if of_robot else wire_topic(self.network)
        place = f"tick {self.tick} ({seconds(self.tick):.6f} s), {topic}"
        return f"{place}: recorded {self.recorded}, replayed {self.replayed}"


ROBOT_FIELDS: tuple[tuple[str, Callable[[RobotPeriod], Any]], ...] = (
    ("firmware accepted", lambda robot: robot.accepted),
    ("firmware rejected", lambda robot: robot.rejected),
    ("firmware stale", lambda robot: robot.stale),
)
AXIS_FIELDS: tuple[tuple[str, Callable[[Axis], Any]], ...] = (
    ("lm629 {side} real_position", lambda axis: axis.real_position),
    ("lm629 {side} desired_position", lambda axis: axis.desired_position),
    ("lm629 {side} desired_velocity", lambda axis: axis.desired_velocity),
    ("lm629 {side} status", lambda axis: axis.status),
    ("pwm {side} sign", lambda axis: axis.pwm_sign),
    ("pwm {side} magnitude", lambda axis: axis.pwm_magnitude),
)
MOTION_FIELDS: tuple[tuple[str, Callable[[RobotPeriod], Any]], ...] = (
    ("truth", lambda robot: robot.truth),
    ("truth v_m_s", lambda robot: robot.v_m_s),
    ("truth w_rad_s", lambda robot: robot.w_rad_s),
)


def compare(recorded: Period, replayed: Period) -> Difference | None:
    """The first difference between a recorded period and the one that replays it, robots in recorded order."""
    for one, other in zip(recorded.robots, replayed.robots, strict=True):
        found = _compare_robot(recorded.tick, one, other)
        if found is not None:
            return found
    return _compare_telemetry(recorded, replayed)


def _compare_robot(tick: int, one: RobotPeriod, other: RobotPeriod) -> Difference | None:
    def differs(at: int, channel: str, recorded: object, replayed: object) -> Difference:
        return Difference(at, one.network, one.slot, channel, _shown(recorded), _shown(replayed))

    for side, axis, twin in (("left", one.left, other.left), ("right", one.right, other.right)):
        command = _first_command(axis, twin)
        if command is not None:
            at = min(when[0] for when in command if when is not None)
            return differs(at, f"lm629 {side} command", *command)
    for name, value in ROBOT_FIELDS:
        known = value(one) is not None and value(other) is not None  # other firmware may export no counters
        if known and value(one) != value(other):
            return differs(tick, name, value(one), value(other))
    for side, axis, twin in (("left", one.left, other.left), ("right", one.right, other.right)):
        for name, register in AXIS_FIELDS:
            if register(axis) != register(twin):
                return differs(tick, name.format(side=side), register(axis), register(twin))
    for name, motion in MOTION_FIELDS:
        if motion(one) != motion(other):
            return differs(tick, name, motion(one), motion(other))
    return None


def _first_command(axis: Axis, twin: Axis) -> tuple[Any, Any] | None:
    """The first pair of commands that differ; None stands where one side has no more."""
    for index in range(max(len(axis.commands), len(twin.commands))):
        one = axis.commands[index] if index < len(axis.commands) else None
        other = twin.commands[index] if index < len(twin.commands) else None
        if one != other:
            return one, other
    return None


def _compare_telemetry(recorded: Period, replayed: Period) -> Difference | None:
    one, other = _answers(recorded), _answers(replayed)
    for index in range(max(len(one), len(other))):
        heard = one[index] if index < len(one) else None
        twin = other[index] if index < len(other) else None
        if heard != twin:
            place = heard or twin
            assert place is not None
            return Difference(place.tick, place.network, -1, WIRE, _shown(heard), _shown(twin))
    return None


def _answers(period: Period) -> list[Transmission]:
    return [heard for heard in period.wire if heard.direction != DOWN]


def _shown(value: Any) -> str:
    """A value in the words of the recording."""
    if value is None:
        return "nothing"
    if isinstance(value, Transmission):
        bad = f", bad stop bits at {', '.join(map(str, value.bad_stop))}" if value.bad_stop else ""
        return f"{value.data.hex(' ')} at tick {value.tick}{bad}"
    if isinstance(value, tuple):
        tick, opcode, data = value
        return f"{opcode:02X}h {data} at tick {tick}".replace("  ", " ")
    return str(value)
