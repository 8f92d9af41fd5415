"""Runs a robot again on the bytes that were sent to it, and finds the first place where it answers otherwise.

What belongs here: the script of a recording or a stream file, and the comparison of two periods. What does
not: the command (`cli.replay`), decoding for people (`frame_list`), reading the files (`recording_reader`,
`miro_protocol.stream`).

The bytes go in before the radio: with the recorded seed it disturbs them as it did then. The host's control
is not computed again; a robot's response is its counters, LM629s, PWM, motion and telemetry.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import msgspec
from miro_protocol.events import Received
from miro_protocol.stream import DOWN, Transmission

from miro_sim.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND, seconds
from miro_sim.records import Axis, Period, RobotPeriod, WireRun
from miro_sim.scenario import Network, Scenario
from miro_sim.scenario_file import load
from miro_sim.scenario_radio import Radio

ScriptRun = tuple[int, int, bytes]
DEFAULT_SCENARIO = "fig6"
AFTERMATH_TICKS = TICKS_PER_SECOND
LONGEST_TICKS = 86_400 * TICKS_PER_SECOND


class StreamContentError(ValueError):
    """A stream file whose lines are well formed but cannot have been sent: file, tick, what, remedy."""


class Difference(msgspec.Struct, frozen=True):
    """The first value that a replay has otherwise. `slot` -1: of a whole network."""

    tick: int
    network: int
    slot: int
    channel: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        robot = f"/robot{self.slot}" if self.slot >= 0 else ""
        place = f"tick {self.tick} ({seconds(self.tick):.6f} s), /net{self.network}{robot}/{self.channel}"
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


def script_of(periods: Iterable[Period]) -> list[ScriptRun]:
    """(tick, network, bytes) of everything the hosts of a recording sent."""
    return [
        (run.tick, run.network, run.data)
        for period in periods
        for run in period.wire
        if run.direction == DOWN
    ]


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
        run = one[index] if index < len(one) else None
        twin = other[index] if index < len(other) else None
        if run != twin:
            place = run or twin
            assert place is not None
            return Difference(place.tick, place.network, place.slot, "wire", _shown(run), _shown(twin))
    return None


def _answers(period: Period) -> list[WireRun]:
    return [run for run in period.wire if run.direction != DOWN]


def _shown(value: Any) -> str:
    """A value in the words of the recording."""
    if value is None:
        return "nothing"
    if isinstance(value, WireRun):
        return f"{value.data.hex(' ')} at tick {value.tick}"
    if isinstance(value, tuple):
        tick, opcode, data = value
        return f"{opcode:02X}h {data} at tick {tick}".replace("  ", " ")
    return str(value)


def robots_of_stream(sent: Sequence[Transmission]) -> int:
    """3 or 5: the layout in which more of the stream's frames can be read."""
    counts = {robots: _frames(sent, robots) for robots in (3, 5)}
    return 5 if counts[5] > counts[3] else 3


def _frames(sent: Sequence[Transmission], robots: int) -> int:
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoder = Decoder(robots)
    events = [event for one in sent if one.direction == DOWN for event in decoder.feed(one.data, one.tick)]
    return len([event for event in events if isinstance(event, Received)])


def scenario_of_stream(sent: Sequence[Transmission], path: str) -> Scenario:
    """The default scenario with an ideal link, and its robot in every slot of the stream's layout, all at one start.

    Runs for a second longer than the stream, so that the failsafe is seen. Raises StreamContentError for a
    stream with nothing to send, for transmissions that overlap, and for one that takes more than a day.
    """
    down = [one for one in sent if one.direction == DOWN]
    if not down:
        raise StreamContentError(f"{path}: no line from host to robot; nothing can be replayed")
    for before, after in pairwise(down):
        end_tick = before.tick + len(before.data) * HOST_CHARACTER_TICKS
        if after.tick < end_tick:
            what = f"starts before the transmission of tick {before.tick} has ended (tick {end_tick})"
            raise StreamContentError(f"{path}: tick {after.tick}: {what}; move it back")
    end_tick = down[-1].tick + len(down[-1].data) * HOST_CHARACTER_TICKS + AFTERMATH_TICKS
    if end_tick > LONGEST_TICKS:
        raise StreamContentError(
            f"{path}: tick {down[-1].tick}: more than a day; let the stream start near tick 0"
        )
    base = load(DEFAULT_SCENARIO).scenario
    first = base.networks[0].robot[0]
    standing = msgspec.structs.replace(first.reference, drive_s=0.0)  # nothing steers by it
    model = msgspec.structs.replace(first, wheel_radius_mismatch=0.0, reference=standing)
    robots = robots_of_stream(sent)
    network = Network(
        robots=5 if robots == 5 else 3,
        radio=Radio(bit_error_rate=0.0, carrier="on", squelch=True),
        robot=tuple(msgspec.structs.replace(model, slot=slot) for slot in range(robots)),
    )
    periods = -(-end_tick // CONTROL_PERIOD_TICKS)
    duration_s = seconds(periods * CONTROL_PERIOD_TICKS)
    return msgspec.structs.replace(base, name="stream", duration_s=duration_s, networks=(network,))


def script_of_stream(sent: Sequence[Transmission]) -> list[ScriptRun]:
    """(tick, network 0, bytes) of everything the stream's host sends."""
    return [(one.tick, 0, one.data) for one in sent if one.direction == DOWN]
