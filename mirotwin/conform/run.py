"""Tries rules on an image: a world for each rule, run to the end of its trial.

Every trial ends at a tick that is known in advance, whatever the firmware does: one that never boots or sends without
end costs the same virtual time. Trials go on after a firmware fault, but end after a thousand. Faults break the rules
about them, whichever trial they came in.

A second process tries every second rule, where Linux has a core for it. A trial depends on its rule, the image and the
seed alone, so the verdicts are those of one process, and they come in the same order. The second process does not know
what fails in the first: it tries rules that are then not judged, too. What it does not tell, because it was ended, is
tried by the first.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

import msgspec

from miro_robot.faults import FirmwareFault
from miro_robot.image import Image
from miro_sim.periods import RobotId
from miro_sim.world.world import World
from mirotwin.conform.probe import why_lost
from mirotwin.conform.rule import Rule
from mirotwin.conform.rule_monitor import ConformsTo
from mirotwin.conform.rules import presupposed, presupposed_first
from mirotwin.conform.trial import MOST_FAULTS, fault_count, run_trial, trial_of
from mirotwin.shell.verdicts import Verdict
from mirotwin.verify.cases.case import SUFFIX, Trace, case_text
from mirotwin.verify.checks.faults import NoFault
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks

FAULTS_KEPT = 20
"""Of a robot in a trial."""


class Outcome(msgspec.Struct, frozen=True):
    """The result of a rule. `failures`: in the order of time, the first hundred. `faults`: (network, slot, fault) of
    its trial, the first twenty a robot; `fault_count` of all. `cases`: name and text of a file for each failure.
    `cause`: the rule is not judged, because this one failed. `hint`: what the firmware does instead, if that is known.
    At a port, `unseen`: why answers do not show it; `unsure`: why it is not judged.
    """

    rule: str
    failures: tuple[Failure, ...]
    faults: tuple[tuple[int, int, FirmwareFault], ...] = ()
    fault_count: int = 0
    cases: tuple[tuple[str, str], ...] = ()
    cause: str = ""
    hint: str = ""
    unseen: str = ""
    unsure: str = ""

    @property
    def verdict(self) -> Verdict:
        if self.failures:
            return "failed"
        return "not judged" if self.cause or self.unsure else "not observable" if self.unseen else "passed"

    @property
    def why(self) -> str:
        """Why a port does not judge it, or ""."""
        return self.unsure or self.unseen


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
    checks = Checks(world, {place: [ConformsTo(rule=rule.id)] for place in _robots(world)})
    run_trial(world)
    checks.finish()
    failures = [one for one in checks.failures if not one.fault]
    faults = tuple(
        (robot.network, robot.slot, fault)
        for robot in world.robots
        for fault in robot.board.faults[:FAULTS_KEPT]
    )
    if not failures and (not world.finished or checks.verdicts()[0].verdict != "passed"):
        wanted = "a trial that can be judged"
        found = (
            "more events than the robot's log holds" if world.finished else f"{MOST_FAULTS} firmware faults"
        )
        failures = [Failure("conforms_to", *_robots(world)[0], world.tick, wanted, found)]
    cases = _cases(rule, world, trace, failures, faults) if keep else ()
    return Outcome(rule.id, tuple(failures), faults, fault_count(world), cases)


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
        first = min(faults, key=lambda one: one[2].tick)
        verdict = _of_fault("no_fault", NoFault.WANTED, *first)
        found.append((of_fault, case_text(world, trace, {"no_fault": True}, str(verdict))))
    return tuple(found)


def _of_fault(check: str, wanted: str, network: int, slot: int, fault: FirmwareFault) -> Failure:
    return Failure(check, network, slot, fault.tick, wanted, str(fault), True)


def _robots(world: World) -> list[RobotId]:
    return [(robot.network, robot.slot) for robot in world.robots]


def try_all(
    rules: Sequence[Rule], image: Image, seed: int = 0, keep: bool = False, ahead: bool = False
) -> Iterator[Outcome]:
    """Each as soon as it is known, those that others presuppose first; see `with_faults`. `ahead`: by two processes.

    A rule is not judged where one of `rules` failed that it presupposes: then its trial is not run. Nor is it where the
    firmware did, before it failed, what another of `rules` forbids: what comes after that says nothing of the rule.
    """
    forbidden = {kind: rule.id for rule in rules for kind in rule.faults}

    def tried(rule: Rule) -> Outcome:
        outcome = try_rule(rule, image, seed, keep)
        if not outcome.failures:
            return outcome
        first_tick = outcome.failures[0].tick
        before = [fault.kind for _, _, fault in outcome.faults if fault.tick <= first_tick]
        cause = next((forbidden[kind] for kind in before if kind in forbidden), "")
        if cause:
            return msgspec.structs.replace(outcome, failures=(), cases=outcome.cases[-1:], cause=cause)
        place = (outcome.failures[0].network, image, seed)
        hint = rule.probe(*place) if rule.probe is not None else why_lost(rule, *place)
        return msgspec.structs.replace(outcome, hint=hint)

    with tried_ahead(presupposed_first(rules) if ahead else (), tried) as found:
        yield from in_order(rules, found)


def in_order(rules: Sequence[Rule], tried: Callable[[Rule], Outcome]) -> Iterator[Outcome]:
    """Those that others presuppose first. Where one of `rules` failed that a rule presupposes, it is not `tried`."""
    causes: dict[str, str] = {}
    for rule in presupposed_first(rules):
        cause = next((causes[one.id] for one in presupposed(rule) if one.id in causes), "")
        outcome = Outcome(rule.id, (), cause=cause) if cause else tried(rule)
        if outcome.failures or outcome.cause:
            causes[rule.id] = outcome.cause or rule.id
        yield outcome


def with_faults(outcomes: Sequence[Outcome], rules: Sequence[Rule]) -> list[Outcome]:
    """The outcomes in the order of `rules`, with all trials' firmware faults held against those that forbid them."""
    by_id = {outcome.rule: outcome for outcome in outcomes}
    found = []
    for rule in rules:
        if rule.id in by_id:  # else a port was lost before
            forbidden = [
                _of_fault("conforms_to", f"no such fault (trial of {one.rule})", *told)
                for one in outcomes
                for told in one.faults
                if told[2].kind in rule.faults
            ]
            outcome = by_id[rule.id]
            cause = "" if forbidden else outcome.cause
            failures = (*forbidden, *outcome.failures)
            found.append(msgspec.structs.replace(outcome, failures=failures, cause=cause))
    return found


FEWEST = 10
"""Rules for which a process is worth starting."""


def has_core() -> bool:
    """Whether a second process would have one. A process with threads is not forked: their locks would stay locked."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return cores > 1 and threading.active_count() == 1


@contextmanager
def tried_ahead(
    rules: Sequence[Rule], tried: Callable[[Rule], Outcome]
) -> Iterator[Callable[[Rule], Outcome]]:
    """`tried`, for all or some of `rules` in this order; a second process does every second of them."""
    if len(rules) < FEWEST or not has_core():
        yield tried
        return
    theirs = rules[::2]
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        _tell(theirs, tried, reading, writing)
    os.close(writing)
    ids = {rule.id for rule in theirs}

    def taken(rule: Rule) -> Outcome:
        try:
            while rule.id in ids:
                outcome: Outcome = pickle.load(told)
                if outcome.rule == rule.id:
                    return outcome
        except (EOFError, pickle.UnpicklingError):
            ids.clear()
        return tried(rule)

    try:
        with open(reading, "rb") as told:
            yield taken
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def _tell(rules: Sequence[Rule], tried: Callable[[Rule], Outcome], reading: int, writing: int) -> NoReturn:
    """The second process. It ends when its outcomes have no reader, as after a signal that the first one got."""
    try:
        os.close(reading)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        with open(writing, "wb") as pipe:
            for rule in rules:
                pickle.dump(tried(rule), pipe)
                pipe.flush()
    finally:
        os._exit(0)
