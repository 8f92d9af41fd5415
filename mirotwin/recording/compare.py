"""Compares two runs, period by period; the rule sets the strictness.

rule       compared                                                                  tolerance
bits       all that a robot did: counters, LM629s, PWM, motion, commands, answers    none
bytes      the characters that the PC received from robots, and their order           in time
commands   the commands of each LM629: opcode, data, order; not what they read       in time
wheels     each LM629's positions and desired velocity once a control period         in counts

The rule `answers`, for robots at a port and their twin, is in `mirotwin.desk.compare`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Literal, get_args

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, NEVER_TICK, TICKS_PER_SECOND
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_sim.periods import Axis, Period, RobotId, RobotPeriod
from mirotwin.recording import sequences
from mirotwin.recording.difference import DIGEST, Difference
from mirotwin.recording.sequences import LogEntry

Kind = Literal["bits", "bytes", "commands", "wheels", "answers"]
KINDS: tuple[Kind, ...] = get_args(Kind)
WITHIN_TICKS = 12_000
"""Default tolerance in time, 0.5 ms: half of the failsafe's unit, five bits of the robot's serial port."""
WITHIN_COUNTS = 20
"""Default tolerance of positions: 0.15 mm at the wheel, or a sample's way at 0.45 m/s."""
WITHIN_COUNTS_PER_SAMPLE = 0.25
"""Default tolerance of desired velocities, 5.6 mm/s: the change at 6 m/s^2 in 0.9 ms."""
_VELOCITY_UNIT = 65536.0


class CompareRule(msgspec.Struct, frozen=True):
    """The rule of a comparison. Differences at ticks from `from_tick` to before `to_tick` (None: the end) count.

    `within_ticks`: of bytes and commands; `within_counts`, `within_counts_per_sample`: of wheels. `host`: compare the
    PCs, too; `digests`: compare the digests of the states, too (both for `bits` only). `clock`: ticks per second;
    `period_ticks`: ticks of a control period.
    """

    kind: Kind = "bits"
    within_ticks: int = WITHIN_TICKS
    within_counts: int = WITHIN_COUNTS
    within_counts_per_sample: float = WITHIN_COUNTS_PER_SAMPLE
    from_tick: int = 0
    to_tick: int | None = None
    host: bool = False
    digests: bool = False
    clock: int = TICKS_PER_SECOND
    period_ticks: int = CONTROL_PERIOD_TICKS

    def compared(self, periods: Sequence[Period]) -> int:
        """Number of control periods that overlap the window."""
        to_tick = NEVER_TICK if self.to_tick is None else self.to_tick
        return sum(
            self.from_tick < period.tick + self.period_ticks and period.tick < to_tick for period in periods
        )


EXACT = CompareRule()


def robots_of(periods: Sequence[Period]) -> list[RobotId]:
    """Network and slot of each robot, in the order of the world."""
    return [(robot.network, robot.slot) for robot in periods[0].robots] if periods else []


def only_robots(periods: Sequence[Period], robots: Sequence[RobotId]) -> Sequence[Period]:
    """The periods with these of their robots, in this order."""
    if robots_of(periods) == list(robots):
        return periods
    by_place = ({(robot.network, robot.slot): robot for robot in period.robots} for period in periods)
    return [
        msgspec.structs.replace(period, robots=tuple(places[robot] for robot in robots))
        for period, places in zip(periods, by_place, strict=True)
    ]


def differences(
    recorded: Sequence[Period], replayed: Sequence[Period], rule: CompareRule = EXACT
) -> list[Difference]:
    """All differences of two runs under a rule, in the order of time, up to the end of the shorter one. Both runs must
    have the same robots, in the same order. Commands and characters unfinished at that end are not compared.
    """
    periods = min(len(recorded), len(replayed))
    if not periods:
        return []
    first, second = recorded[:periods], replayed[:periods]
    ordered = sorted(_all(first, second, rule), key=attrgetter("tick"))
    to_tick = NEVER_TICK if rule.to_tick is None else rule.to_tick
    return [difference for difference in ordered if rule.from_tick <= difference.tick < to_tick]


def _all(run: Sequence[Period], other: Sequence[Period], rule: CompareRule) -> Iterator[Difference]:
    """Causes before effects: at one tick the first is reported first."""
    if rule.kind in ("bits", "commands"):
        yield from _commands(run, other, rule)
    if rule.kind in ("bits", "bytes"):
        yield from _air(run, other, rule)
    if rule.kind in ("bits", "wheels"):
        for here, there in zip(run, other, strict=True):
            for robot, twin in zip(here.robots, there.robots, strict=True):
                compare = _wheels(robot, twin, rule) if rule.kind == "wheels" else _values(robot, twin, rule)
                for name, recorded, replayed in compare:
                    place = here.tick, here.index, robot.network, robot.slot
                    yield Difference(*place, name, recorded, replayed)
    if rule.kind == "bits":
        yield from _parts(run, other)
    if rule.digests and rule.kind == "bits":
        for here, there in zip(run, other, strict=True):
            if here.digest != there.digest:
                end_tick = here.tick + rule.period_ticks
                yield Difference(end_tick, here.index, -1, -1, DIGEST, here.digest, there.digest)


Value = int | float | str | None
NamedValues = Iterator[tuple[str, Value]]
COUNTERS = ("firmware accepted", "firmware rejected", "firmware stale")
"""Absent where an image exports no such symbols: they are not compared then."""
Named = Iterator[tuple[str, Value, Value]]


def _values(robot: RobotPeriod, twin: RobotPeriod, rule: CompareRule) -> Named:
    """Every value that is not the same."""
    theirs = dict(_response(twin))
    for name, value in _response(robot):
        unknown = name in COUNTERS and (value is None or theirs[name] is None)
        if value != theirs[name] and not unknown:
            yield name, value, theirs[name]
    if rule.host:
        mine, theirs = dict(_of_host(robot)), dict(_of_host(twin))
        for name in {**mine, **theirs}:
            if mine.get(name) != theirs.get(name):
                yield name, mine.get(name), theirs.get(name)


def _parts(run: Sequence[Period], other: Sequence[Period]) -> Iterator[Difference]:
    """The values of parts of boards, where both runs have them."""
    for here, there in zip(run, other, strict=True):
        for parts, twins in zip(here.values, there.values, strict=False):
            place = parts.tick, here.index, parts.network, -1
            for path, value in parts.values.items():
                if value != twins.values.get(path, value):
                    yield Difference(*place, f"values {path}", value, twins.values[path])


def _wheels(robot: RobotPeriod, twin: RobotPeriod, rule: CompareRule) -> Named:
    for side, axis, other in (("left", robot.left, twin.left), ("right", robot.right, twin.right)):
        for name in ("real_position", "desired_position"):
            expected, actual = getattr(axis, name), getattr(other, name)
            if abs(expected - actual) > rule.within_counts:
                yield f"lm629 {side} {name}", expected, actual
        velocity, twins = axis.desired_velocity, other.desired_velocity
        if abs(velocity - twins) > rule.within_counts_per_sample * _VELOCITY_UNIT:
            yield f"lm629 {side} desired_velocity", velocity, twins


def _commands(
    recorded: Sequence[Period], replayed: Sequence[Period], rule: CompareRule
) -> Iterator[Difference]:
    """Differences of commands, up to the last exposure: a command after it may not have been recorded in one of the
    runs.
    """
    exact = rule.kind == "bits"
    within_ticks = 0 if exact else rule.within_ticks
    known_tick = NEVER_TICK if exact else recorded[-1].tick - within_ticks
    for index, robot in enumerate(recorded[0].robots):
        for side in ("left", "right"):
            here, there = (sequences.commands(run, index, side, exact) for run in (recorded, replayed))
            place = robot.network, robot.slot, f"lm629 {side} command"
            yield from _unlike(here, there, within_ticks, known_tick, place, rule.period_ticks)


def _air(recorded: Sequence[Period], replayed: Sequence[Period], rule: CompareRule) -> Iterator[Difference]:
    """Differences of characters; a character is known when its stop bit was sampled."""
    within_ticks = rule.within_ticks if rule.kind == "bytes" else 0
    end_tick = recorded[-1].tick + rule.period_ticks
    robots = {robot.network for robot in recorded[0].robots}
    for network in sorted(robots or {0}):  # 0: the wire of a board alone
        if rule.kind == "bytes":
            known_tick = end_tick - within_ticks - HOST_CHARACTER_TICKS
            here, there = sequences.characters(recorded, network), sequences.characters(replayed, network)
            yield from _unlike(
                here, there, within_ticks, known_tick, (network, -1, "wire"), rule.period_ticks
            )
            continue
        for name, sent in (("wire", False), *([("wire sent", True)] if rule.host else [])):
            here = sequences.transmissions(recorded, network, sent)
            there = sequences.transmissions(replayed, network, sent)
            yield from _unlike(here, there, 0, NEVER_TICK, (network, -1, name), rule.period_ticks)
        if rule.host:
            done, there = sequences.actions(recorded, network), sequences.actions(replayed, network)
            yield from _unlike(done, there, 0, NEVER_TICK, (network, -1, "actions"), rule.period_ticks)


def _unlike(
    recorded: Sequence[LogEntry],
    replayed: Sequence[LogEntry],
    within_ticks: int,
    known_tick: int,
    place: tuple[int, int, str],
    period_ticks: int,
) -> Iterator[Difference]:
    for here, there in sequences.unlike(recorded, replayed, within_ticks):
        tick = min(each.tick for each in (here, there) if each is not None)
        if tick < known_tick or (here is not None and there is not None):
            texts = (None if here is None else str(here), None if there is None else str(there))
            yield Difference(tick, tick // period_ticks, *place, *texts)


def _response(robot: RobotPeriod) -> NamedValues:
    """Values of the robot: its counters, LM629s, PWM and motion."""
    yield from zip(COUNTERS, (robot.accepted, robot.rejected, robot.stale), strict=True)
    for side, axis in (("left", robot.left), ("right", robot.right)):
        yield from _axis(side, axis)
    yield from _posture("truth", robot.truth)
    yield "truth v_m_s", robot.v_m_s
    yield "truth w_rad_s", robot.w_rad_s


def _of_host(robot: RobotPeriod) -> NamedValues:
    """Values of its PC: the measurement, the command, and the reference."""
    yield from _posture("reference", robot.reference)
    measured = robot.measurement
    yield from _posture("measurement", measured)
    if isinstance(measured, Sighting):
        yield "measurement exposed_tick", measured.tick
        yield "measurement confidence", measured.confidence
    control = robot.control
    for name in ("v_m_s", "w_rad_s", "left", "right"):
        yield f"control {name}", getattr(control, name, None)
    if control is not None:
        yield from ((f"control inner.{name}", value) for name, value in control.inner.items())
        yield from ((f"control estimate.{name}", value) for name, value in control.estimate.items())


def _axis(side: str, axis: Axis) -> NamedValues:
    for name in ("real_position", "desired_position", "desired_velocity", "status"):
        yield f"lm629 {side} {name}", getattr(axis, name)
    yield f"pwm {side} sign", axis.pwm_sign
    yield f"pwm {side} magnitude", axis.pwm_magnitude


def _posture(name: str, posture: Posture | None) -> NamedValues:
    for field in ("x_m", "y_m", "theta_rad"):
        yield f"{name} {field}", None if posture is None else getattr(posture, field)
