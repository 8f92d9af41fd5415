"""Confirms a failing input: plays it again from power-on, without the code that found it.

input ──► Target.script ──► a World: ideal radio, carrier on, the robot of the target alone; or a board alone
                                  │ checks: the one that the crash names, and those that are always on
                                  ▼
                         failed: a case            passed: kept apart, as not confirmed
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.actions import ScriptItem
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.robot_rules import TOLERANCE_TICKS
from miro_protocol.table import FRESH_AGAIN_TICKS, FrameType
from miro_protocol.transmission import DOWN, Transmission
from mirotwin.fuzz.board_target import NO_FAULT, BoardTarget
from mirotwin.fuzz.target import NEVER_SLEEPS, RobotTarget, Target, TargetFailure
from mirotwin.runs.board_case import after_ticks, board_spec
from mirotwin.runs.run import Run, robot_spec
from mirotwin.verify.checks.expect import ALWAYS_ON, CHECKS, struct_of

AFTER_TICKS = TICKS_PER_SECOND // 20
"""Length of a run after the input and the crash: an answer may take 30 ms, a frame 10 ms."""
_SETTLED_TICKS = TICKS_PER_SECOND // 100
SILENCES = ("failsafe_stop_ms", "motors_off_ms")

Expected = Mapping[str, Any]
"""Checks by name with their parameters, as the table `[expect]` of a scenario."""


class RobotOracle:
    """Judges by a World with the robot of `target`."""

    def __init__(self, target: RobotTarget) -> None:
        self.target = target

    def confirm(self, data: bytes, failure: TargetFailure) -> Run:
        """Judges an input in which the target failed so."""
        return self._rerun(data, expected_of(failure.check), failure.tick, asks=failure.check == NEVER_SLEEPS)

    def judged(self, data: bytes, expected: Expected) -> Run:
        """Judges an input by these checks, and by those that are always on. Raises PluginError where one raises."""
        return self._rerun(data, expected, 0)

    def _rerun(self, data: bytes, expected: Expected, last_tick: int, asks: bool = False) -> Run:
        target = self.target
        script: list[ScriptItem] = [*target.script(data)]
        if asks or any(struct_of(name).KIND == "safety" for name in {*expected} - {*ALWAYS_ON}):
            # firmware that was mended, and does not what it must not, has to show that it lives
            script += _questions(script, last_tick, target.robots, target.slot)
        after_ticks = max(AFTER_TICKS, target.harness.after_ticks)
        until_tick = max(last_tick, _end_tick(script)) + after_ticks
        spec = robot_spec(target.image, target.robots, target.slot, script, expected, until_tick)
        return Run.traced(spec).play()


class BoardOracle:
    """Judges by a World with the board of `target` alone. `expected`: the checks of the campaign."""

    def __init__(self, target: BoardTarget, expected: Expected) -> None:
        self.target = target
        self.expected = expected

    def confirm(self, data: bytes, failure: TargetFailure) -> Run:
        """Judges an input in which the target failed so."""
        # a build that is slower, and no better, comes to its fault later
        later = after_ticks(self.target.scenario) if failure.check == NO_FAULT else 0
        expected = {failure.check: self.expected.get(failure.check, True)}
        return self.rerun(data, expected, failure.tick + later)

    def judged(self, data: bytes, expected: Expected) -> Run:
        """Judges an input by these checks, and by no_fault. Raises PluginError where one raises."""
        self.target.run(data)
        return self.rerun(data, expected, self.target.end_tick())

    def rerun(self, data: bytes, expected: Expected, until_tick: int) -> Run:
        """An input from power-on to `until_tick`."""
        target = self.target
        script = [*target.machine.script, *target.script(data)]
        spec = board_spec(target.image, target.scenario, script, expected, until_tick)
        return Run.traced(spec).play()


Oracle = RobotOracle | BoardOracle


def oracle_of(target: Target, expected: Expected) -> Oracle:
    """The oracle for a target of the product's own, in a campaign with these checks."""
    if isinstance(target, BoardTarget):
        return BoardOracle(target, expected)
    assert isinstance(target, RobotTarget)
    return RobotOracle(target)


def expected_of(check: str) -> dict[str, Any]:
    """The check that confirms a failure of that name; the failsafe's with the fast oracle's tolerance."""
    if check == NEVER_SLEEPS:
        return {"acts_within_ms": True}
    if check in SILENCES:
        return {check: {"tolerance_ms": TOLERANCE_TICKS / 24_000}}
    return {check: True} if check in CHECKS.names() else {}


def _end_tick(script: Sequence[ScriptItem]) -> int:
    return max((item.end_tick if isinstance(item, Transmission) else item.tick for item in script), default=0)


def _questions(script: Sequence[ScriptItem], found_tick: int, robots: int, slot: int) -> list[Transmission]:
    """Two team frames after the input that ask the robot, so late that one of them at least is fresh.

    A robot that lives acts on it, and answers.
    """
    tick = max(found_tick, _end_tick(script)) + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    transmissions: list[Transmission] = []
    for number in (1, 2):
        velocity = 256 * number
        frame = TeamFrame(FrameType.TEAM_ASK, slot + number * robots, ((velocity, velocity),) * robots)
        transmissions.append(Transmission(tick, DOWN, encode(frame, robots)))
        tick = transmissions[-1].end_tick + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    return transmissions
