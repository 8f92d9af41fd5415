"""A world run again from power-on under checks: the one way in which cases, crashes and failed tests are judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_protocol.actions import ScriptItem
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.world.world import World
from mirotwin.shell.verdicts import VERDICTS, Verdict
from mirotwin.verify.cases.case import Trace, case_of_checks, case_text
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks, Expected
from mirotwin.verify.rig_options import silent_scenario


class Rerun(msgspec.Struct, frozen=True):
    """What a world did. `tick`: where its checks ended; `periods`: those that ended by then."""

    world: World
    checks: Checks
    tick: int
    periods: list[Period]
    trace: Trace | None

    @property
    def failures(self) -> list[Failure]:
        return self.checks.failures

    @property
    def failure(self) -> Failure | None:
        """The first one."""
        return self.failures[0] if self.failures else None

    def verdict_on(self, name: str) -> Verdict:
        """That of one check."""
        return next(one.verdict for one in self.checks.verdicts() if one.name == name)

    def case(self) -> str:
        """The case of the first failure. Raises ValueError if nothing failed."""
        return case_of_checks(self.world, self._known_trace(), self.checks)

    def stream(self) -> str:
        """The same run as a stream that nothing is expected of."""
        return case_text(self.world, self._known_trace(), {}, "")

    def _known_trace(self) -> Trace:
        assert self.trace is not None, "the world began with what another one had saved"
        return self.trace


def rerun(
    world: World,
    until_tick: int | None = None,
    expected: Expected | None = None,
    progress: Callable[[int], object] = lambda tick: None,
    cut: bool = False,
) -> Rerun:
    """Runs `world`, which nobody has moved, to `until_tick`, perhaps beyond the end of its scenario.

    `until_tick` None: to that end. `expected`: the checks; by default those of its scenario. `progress` is told the
    tick. `cut`: it may be ended before it is over. Raises TransmissionError for a script that cannot be sent.
    """
    end_tick = world.periods * CONTROL_PERIOD_TICKS if until_tick is None else until_tick
    trace = None if world.tick else Trace(world)
    periods: list[Period] = []
    world.observers.append(periods.append)
    checks = Checks(world, expected, cut)
    while not world.stopped and world.tick < end_tick:
        world.run_to(min(end_tick, (world.index + 1) * CONTROL_PERIOD_TICKS))
        progress(world.tick)
    checks.finish()
    return Rerun(world, checks, world.tick, periods, trace)


def rerun_robot(
    image: Image,
    robots: int,
    slot: int,
    script: Sequence[ScriptItem],
    expect: Mapping[str, Any],
    until_tick: int,
) -> Rerun:
    """One robot of `robots` that stands hears `script`, over a radio without errors whose carrier is always on.

    `expect`: checks by name with their parameters, as in `[expect]`. It goes on to the end of the control period.
    """
    whole_s = -(-until_tick // TICKS_PER_SECOND)  # whole seconds, so that few texts are read
    settings = (
        f"network.robots={robots}",
        f"network.robot.slot={slot}",
        'network.radio.carrier="on"',
        f"duration_s={whole_s + 1}",
    )
    scenario = msgspec.structs.replace(silent_scenario(settings), expect=dict(expect))
    world = World(scenario, 0, image, sorted(script, key=lambda one: one.tick))
    return rerun(world, -(-until_tick // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS)


def case_of_expect(world: World, trace: Trace, expect: Mapping[str, Any]) -> str | None:
    """The case of a run by a check that it did not have: a new world with the same input is judged by `expect`.

    None where the check passes, or cannot be one: a wait for no time at all.
    """
    scenario = msgspec.structs.replace(world.scenario, expect=dict(expect))
    try:
        again = rerun(World(scenario, world.seed, world.image, trace.script()), world.tick)
    except BadInput:
        return None
    failure = next((one for one in again.failures if one.check in expect), None)
    return None if failure is None else case_text(world, trace, expect, str(failure))


class CaseVerdict(msgspec.Struct, frozen=True):
    """`lines`: for people; `failure`: the check that failed, as recorded or otherwise; `fault`: the first one."""

    verdict: Verdict
    lines: tuple[str, ...]
    failure: Failure | None = None
    fault: Failure | None = None

    @property
    def code(self) -> int:
        """The exit code."""
        return VERDICTS[self.verdict].code


def verdict_of(
    recorded: str,
    failures: Sequence[Failure],
    changed: bool,
    verdict: Verdict = "passed",
    why: Sequence[str] = (),
) -> CaseVerdict:
    """From the line that was recorded ("" for none). `changed`: other firmware or settings ran than those of the case;
    `verdict`: that of the checks it names, where none failed, and `why` they were not judged.
    """
    name = recorded.partition(":")[0]
    if failures:
        same = [one for one in failures if str(one) == recorded]
        first = (same or failures)[0]
        lines = [f"fails as recorded: {first}" if same else f"still fails, but not as recorded: {first}"]
        if not recorded:
            lines = [f"fails: {first}"]
        elif not same:
            lines.append(f"recorded: {recorded}")
        fault = next((one for one in failures if one.fault), None)
        if fault not in (None, first):
            lines.append(f"and a firmware fault: {fault}")
        return CaseVerdict("failed" if fault is None else "fault", tuple(lines), first, fault)
    if verdict != "passed":
        return CaseVerdict(verdict, (*why, *([f"recorded: {recorded}"] if recorded else [])))
    if not recorded:
        return CaseVerdict("passed", ("passes", *why))
    if changed:
        return CaseVerdict("passed", (f"cured: {name} passes; recorded: {recorded}", *why))
    return CaseVerdict("differs", (f"not reproduced: {name} passes; recorded: {recorded}", *why))
