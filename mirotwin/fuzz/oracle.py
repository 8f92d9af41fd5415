"""Who has the last word on an input: it is played once more from power-on, without the machinery that found it.

input ──► Target.script ──► a World: ideal radio, carrier on, the robot of the target alone; or a bare processor
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
from mirotwin.fuzz.bare import BareTarget
from mirotwin.fuzz.target import RobotTarget, Target, TargetFailure
from mirotwin.runs.bare_case import BareRerun, after_ticks, rerun_bare
from mirotwin.runs.run import Run, robot_spec
from mirotwin.verify.bare.exchange import NEVER_SLEEPS, NO_FAULT, NamedCheck
from mirotwin.verify.checks.expect import ALWAYS_ON, CHECKS, struct_of

AFTER_TICKS = TICKS_PER_SECOND // 20
"""How long a world goes on after the input and the crash: an answer may take 30 ms, a frame 10 ms."""
_SETTLED_TICKS = TICKS_PER_SECOND // 100
SILENCES = ("failsafe_stop_ms", "motors_off_ms")

Expected = Mapping[str, Any]
"""Checks by name with their parameters, as the table `[expect]` of a scenario."""
OracleVerdict = Run | BareRerun
"""What an input did that was played again."""


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


class BareProcessorOracle:
    """Judges by a bare processor; `check` judges where it is asked to. Raises BadInput where the check fails itself."""

    def __init__(self, target: BareTarget, check: NamedCheck | None = None) -> None:
        self.target = target
        self.check = check

    def confirm(self, data: bytes, failure: TargetFailure) -> BareRerun:
        # a build that is slower, and no better, comes to its fault later
        later = after_ticks(self.target.line) if failure.check == NO_FAULT else 0
        return self._rerun(data, failure.check, failure.tick + later)

    def judged(self, data: bytes, expected: Expected) -> BareRerun:
        self.target.run(data)
        return self._rerun(data, next(iter(expected), NO_FAULT), self.target.end_tick())

    def _rerun(self, data: bytes, name: str, until_tick: int) -> BareRerun:
        target = self.target
        return rerun_bare(target.image, target.line, target.script(data), until_tick, name, self.check)


Oracle = RobotOracle | BareProcessorOracle


def oracle_of(target: Target, check: NamedCheck | None = None) -> Oracle:
    """The oracle for a target of the product's own. `check`: as of --check, for a bare processor."""
    if isinstance(target, BareTarget):
        return BareProcessorOracle(target, check)
    assert isinstance(target, RobotTarget)
    return RobotOracle(target)


def expected_of(check: str) -> dict[str, Any]:
    """The check that tells whether a failure of that name is one; the failsafe's with the fast oracle's tolerance."""
    if check == NEVER_SLEEPS:
        return {"acts_within_ms": True}
    if check in SILENCES:
        return {check: {"tolerance_ms": TOLERANCE_TICKS / 24_000}}
    return {check: True} if check in CHECKS.names() else {}


def _end_tick(script: Sequence[ScriptItem]) -> int:
    return max((one.end_tick if isinstance(one, Transmission) else one.tick for one in script), default=0)


def _questions(script: Sequence[ScriptItem], found_tick: int, robots: int, slot: int) -> list[Transmission]:
    """Two team frames after the input that ask the robot, so late that one of them at least is fresh.

    A robot that lives acts on it, and answers.
    """
    tick = max(found_tick, _end_tick(script)) + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    found: list[Transmission] = []
    for number in (1, 2):
        velocity = 256 * number
        frame = TeamFrame(FrameType.TEAM_ASK, slot + number * robots, ((velocity, velocity),) * robots)
        found.append(Transmission(tick, DOWN, encode(frame, robots)))
        tick = found[-1].end_tick + FRESH_AGAIN_TICKS + _SETTLED_TICKS
    return found
