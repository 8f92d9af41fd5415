"""Tries rules on an image: a world for each rule, run to the end of its trial.

What belongs here: one trial as a run, and what comes of it. What does not: rules (`rules/`), files and tables (`cli`).

Every trial ends at a tick that is known in advance, whatever the firmware does: one that never boots or sends without
end costs the same virtual time. Trials go on behind a firmware fault, but end behind a thousand. Faults break the rules
about them, whichever trial they came in.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_sim.world.world import World
from mirotwin.cases.case import SUFFIX, case_text
from mirotwin.cases.trace import Trace
from mirotwin.checks.expect import Place
from mirotwin.checks.faults import NoFault
from mirotwin.checks.interface import Failure
from mirotwin.checks.watching import Checks
from mirotwin.conform.judgement import ConformsTo
from mirotwin.conform.rule import Rule
from mirotwin.conform.trial import trial_of

MOST_FAULTS = 1000
FAULTS_KEPT = 20
"""Of a robot in a trial."""
LOOK_TICKS = 24_000
"""In the first control period faults are counted so often: a fault in each instruction makes 2000 a millisecond."""


class Outcome(msgspec.Struct, frozen=True):
    """What came of a rule. `failures`: in the order of time, the first hundred. `faults`: (network, slot, fault) of
    its trial, the first twenty a robot; `fault_count` of all. `cases`: name and text of a file for each failure.
    """

    rule: str
    failures: tuple[Failure, ...]
    faults: tuple[tuple[int, int, FirmwareFault], ...] = ()
    fault_count: int = 0
    cases: tuple[tuple[str, str], ...] = ()

    @property
    def passed(self) -> bool:
        return not self.failures


def failure_text(failure: Failure) -> str:
    """A failure for people, without the name of the check."""
    return f"{failure}".partition(": ")[2]


def case_names(rule: Rule) -> tuple[str, str]:
    """Files that a rule may leave: the rule's own failure, and a firmware fault in its trial."""
    return f"{rule.id}{SUFFIX}", f"{rule.id}-fault{SUFFIX}"


def try_rule(rule: Rule, image: Image, seed: int = 0, keep: bool = False) -> Outcome:
    """Runs the rule's trial on `image`; with `keep`, what failed is there as cases."""
    trial = trial_of(rule)
    world = World(trial.scenario, seed, image, trial.script)
    trace = Trace(world)
    checks = Checks(world, {place: [ConformsTo(rule=rule.id)] for place in _places(world)})
    while not world.finished and _fault_count(world) < MOST_FAULTS:
        world.run_to(world.tick + (LOOK_TICKS if world.tick < CONTROL_PERIOD_TICKS else CONTROL_PERIOD_TICKS))
    checks.finish()
    failures = [one for one in checks.failures if not one.fault]
    faults = tuple(
        (network.index, robot.slot, fault)
        for network in world.networks
        for robot in network.robots
        for fault in robot.board.faults[:FAULTS_KEPT]
    )
    if not failures and (not world.finished or checks.verdicts()[0].verdict != "passed"):
        wanted = "a trial that can be judged"
        found = (
            "more events than the robot's log holds" if world.finished else f"{MOST_FAULTS} firmware faults"
        )
        failures = [Failure("conforms_to", *_places(world)[0], world.tick, wanted, found)]
    cases = _cases(rule, world, trace, failures, faults) if keep else ()
    return Outcome(rule.id, tuple(failures), faults, _fault_count(world), cases)


def _cases(
    rule: Rule,
    world: World,
    trace: Trace,
    failures: Sequence[Failure],
    faults: Sequence[tuple[int, int, FirmwareFault]],
) -> tuple[tuple[str, str], ...]:
    """Each of which `mirotwin replay` brings to the same verdict."""
    own, of_fault = case_names(rule)
    found = []
    if failures and world.finished:
        found.append((own, case_text(world, trace, {"conforms_to": rule.id}, str(failures[0]))))
    if faults:
        network, slot, fault = min(faults, key=lambda one: one[2].tick)
        verdict = Failure("no_fault", network, slot, fault.tick, NoFault.WANTED, str(fault), True)
        found.append((of_fault, case_text(world, trace, {"no_fault": True}, str(verdict))))
    return tuple(found)


def _fault_count(world: World) -> int:
    count = 0
    for network in world.networks:
        for robot in network.robots:
            count += robot.board.fault_count
    return count


def _places(world: World) -> list[Place]:
    return [(network.index, robot.slot) for network in world.networks for robot in network.robots]


def try_all(rules: Sequence[Rule], image: Image, seed: int = 0, keep: bool = False) -> Iterator[Outcome]:
    """One after the other, as soon as each is known; see `with_faults`."""
    for rule in rules:
        yield try_rule(rule, image, seed, keep)


def with_faults(outcomes: Sequence[Outcome], rules: Sequence[Rule]) -> list[Outcome]:
    """The outcomes, with the firmware faults of all trials held against the rules that forbid them."""
    kinds = {rule.id: rule.faults for rule in rules}
    return [
        msgspec.structs.replace(
            outcome, failures=(*_forbidden(outcomes, kinds[outcome.rule]), *outcome.failures)
        )
        for outcome in outcomes
    ]


def _forbidden(outcomes: Sequence[Outcome], kinds: Sequence[FaultKind]) -> list[Failure]:
    """A failure for each fault of these kinds."""
    return [
        Failure(
            "conforms_to", network, slot, fault.tick, f"no such fault (trial of {one.rule})", f"{fault}", True
        )
        for one in outcomes
        for network, slot, fault in one.faults
        if fault.kind in kinds
    ]
