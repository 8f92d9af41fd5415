"""A crash played in a World, whose checks have the last word.

input ──► Target.script ──► World: ideal radio, carrier on, the robot of the target alone
                                  │ checks: the one that the crash names, and those that are always on
                                  ▼
                         failed: a case            passed: kept apart, as not confirmed
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds
from miro_protocol.actions import ScriptItem
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.robot_rules import TOLERANCE_TICKS
from miro_protocol.table import FRESH_AGAIN_TICKS, FrameType
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import Image
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.fuzz.target import Target, TargetFailure
from mirotwin.verify.bare.case import NEVER_SLEEPS
from mirotwin.verify.cases.case import case_of_checks, case_text
from mirotwin.verify.cases.trace import Trace
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.registry import CHECKS
from mirotwin.verify.checks.watching import Checks
from mirotwin.verify.wanted import silent_scenario

AFTER_TICKS = TICKS_PER_SECOND // 20
"""How long a world goes on after the input and the crash: an answer may take 30 ms, a frame 10 ms."""
_SETTLED_TICKS = TICKS_PER_SECOND // 100

Expected = Mapping[str, Any]
"""Checks by name with their parameters, as the table `[expect]` of a scenario."""


class Place(msgspec.Struct, frozen=True):
    """What is fuzzed: the image, and the robot's slot in a network of so many."""

    image: Image
    robots: int = 3
    slot: int = 0


class OracleVerdict(msgspec.Struct, frozen=True):
    """What a world made of an input. `failure`: the first check that failed, None if none did; `case`: its text."""

    failure: Failure | None
    case: str = ""


class Oracle(Protocol):
    """Who has the last word on an input."""

    def confirm(self, target: Target, data: bytes, failure: TargetFailure) -> OracleVerdict:
        """Judges an input in which a target found that."""
        ...

    def judged(self, target: Target, data: bytes, expected: Expected) -> OracleVerdict:
        """Judges an input by these checks, and by those that are always on. Raises PluginError where one raises."""
        ...

    def stream(self, target: Target, data: bytes) -> str:
        """The input as a stream file that nothing is expected of."""
        ...


class WorldOracle:
    """A World with the robot of `place`."""

    def __init__(self, place: Place) -> None:
        self.place = place

    def confirm(self, target: Target, data: bytes, failure: TargetFailure) -> OracleVerdict:
        heard = target.script(data)
        if failure.check == NEVER_SLEEPS:
            heard = [*heard, *_questions(heard, failure.tick, self.place.robots)]
        return judge(self.place, heard, expected_of(failure.check), failure.tick)

    def judged(self, target: Target, data: bytes, expected: Expected) -> OracleVerdict:
        return judge(self.place, target.script(data), expected)

    def stream(self, target: Target, data: bytes) -> str:
        return stream_of(self.place, target.script(data))


SILENCES = ("failsafe_stop_ms", "motors_off_ms")


def expected_of(check: str) -> dict[str, Any]:
    """The check that tells whether a failure of that name is one; the failsafe's with the fast oracle's tolerance."""
    if check == NEVER_SLEEPS:
        return {"acts_within_ms": True}
    if check in SILENCES:
        return {check: {"tolerance_ms": TOLERANCE_TICKS / 24_000}}
    return {check: True} if check in CHECKS.names() else {}


def judge(place: Place, heard: Sequence[ScriptItem], expected: Expected, last_tick: int = 0) -> OracleVerdict:
    """What the checks say of a robot that hears this from power-on. `last_tick`: the run goes on beyond it at least.

    Raises PluginError where a check raises.
    """
    world, trace, checks = _played(place, heard, expected, last_tick)
    if not checks.failures:
        return OracleVerdict(None)
    return OracleVerdict(checks.failures[0], case_of_checks(world, trace, checks))


def stream_of(place: Place, heard: Sequence[ScriptItem]) -> str:
    """The same as a stream file that nothing is expected of, for `mirotwin replay` and `mirotwin fw`."""
    world, trace, _ = _played(place, heard, {}, 0)
    return case_text(world, trace, {}, "")


def _played(
    place: Place, heard: Sequence[ScriptItem], expected: Expected, last_tick: int
) -> tuple[World, Trace, Checks]:
    script = sorted(heard, key=lambda one: one.tick)
    ends = [one.end_tick if isinstance(one, Transmission) else one.tick for one in script]
    end_tick = max([last_tick, *ends]) + AFTER_TICKS
    scenario = msgspec.structs.replace(_scenario(place, end_tick), expect=dict(expected))
    world = World(scenario, 0, place.image, script)
    trace, checks = Trace(world), Checks(world)
    world.run_to(-(-end_tick // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS)
    checks.finish()
    return world, trace, checks


def _scenario(place: Place, end_tick: int) -> Scenario:
    """One robot that stands, behind a radio without errors whose carrier is always on."""
    whole_s = -(-end_tick // TICKS_PER_SECOND)  # whole seconds, so that few texts are read
    return silent_scenario(
        (
            f"network.robots={place.robots}",
            f"network.robot.slot={place.slot}",
            'network.radio.carrier="on"',
            f"duration_s={seconds((whole_s + 1) * TICKS_PER_SECOND)}",
        )
    )


def _questions(heard: Sequence[ScriptItem], found_tick: int, robots: int) -> list[Transmission]:
    """Two team frames after the input, so late that one of them at least is fresh: a robot that lives acts on it."""
    ends = [one.end_tick if isinstance(one, Transmission) else one.tick for one in heard]
    tick = max([found_tick, *ends]) + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    found: list[Transmission] = []
    for seq in (1, 2):
        frame = TeamFrame(FrameType.TEAM, seq, ((256 * seq, 256 * seq),) * robots)
        found.append(Transmission(tick, DOWN, encode(frame, robots)))
        tick = found[-1].end_tick + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    return found
