"""What a scenario file that failed leaves in its folder: its report, the scenario as a whole, the case of its failure.

report.txt        the lines of the verdict, and the command that gives it again
scenario.toml     the whole scenario with all that was set: `mirotwin run` gives the verdict again
case.stream       what was sent and done, with the check that failed: `mirotwin replay` does; not where no check can
                  judge it, as for pins, wheels and addresses in the program: there sent.stream
"""

from __future__ import annotations

from miro_sim.world.world import World
from mirotwin.verify.cases.case import case_of_checks
from mirotwin.verify.cases.rerun import case_of_expect
from mirotwin.verify.cases.trace import Trace
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.steps.keys import HoldStep, NeverStep, WaitStep
from mirotwin.verify.steps.player import Player

SCENARIO = "scenario.toml"


def case_of_step(player: Player, trace: Trace) -> str | None:
    """The case of the step that has just failed; None where no check can judge it."""
    failure = player.failure
    if failure is None or failure.tick <= failure.begun_tick:
        return None
    step = player.steps[failure.number - 1]
    if isinstance(step, HoldStep) or not isinstance(step, WaitStep | NeverStep):
        return None
    if isinstance(step, WaitStep) and not failure.timed_out:
        return None
    name = "happens" if isinstance(step, WaitStep) else "never_happens"
    until_tick = max(failure.tick, player.world.tick)
    expect = expect_of(name, step.condition, failure.begun_tick, until_tick)
    return None if expect is None else case_of_expect(player.world, trace, expect)


def case_of_run(world: World, trace: Trace, checks: Checks) -> str | None:
    """The case of the first of the run's checks that failed; None where none did."""
    return case_of_checks(world, trace, checks) if checks.failures else None
