"""Tries rules on an image: one world for each rule, run to the end of its trial.

Every trial ends at a tick that is known in advance, so firmware that never boots or sends endlessly costs the same
virtual time. A trial continues after a firmware fault and ends after a thousand. A fault in any trial breaks the rules
about faults.

On Linux with a second core, a second process tries every second rule. A trial depends on its rule, the image and the
seed alone, so the verdicts are those of one process, and they come in the same order. The second process does not know
the failures of the first, so it also tries rules that are then not judged. If it is killed, the first process tries the
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Future
from contextlib import nullcontext, suppress
from functools import partial
from itertools import islice

import msgspec

from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image import Image
from mirotwin.conform.probe import why_lost
from mirotwin.conform.rule import Rule
from mirotwin.conform.rule_monitor import ConformsTo
from mirotwin.conform.rules import presupposed, presupposed_first
from mirotwin.conform.trial import MOST_FAULTS, fault_count, run_trial, trial_of
from mirotwin.runs.run import Run, on_world
from mirotwin.runs.sanitized import sanitized
from mirotwin.shell.process_pool import spare_process
from mirotwin.shell.verdicts import Verdict, judge
from mirotwin.verify.cases.case import SUFFIX
from mirotwin.verify.checks.faults import NoFault
from mirotwin.verify.checks.interface import Failure

FAULTS_KEPT = 20
"""Largest number of saved faults of a robot in a trial."""


class Outcome(msgspec.Struct, frozen=True):
    """The result of a rule. `failures`: in the order of time, the first hundred. `faults`: (network, slot, fault) of
    its trial, the first twenty a robot; `fault_count` of all. `cases`: name and text of a file for each failure.
    `cause`: the failed rule because of which this one is not judged. `hint`: the firmware's wrong behaviour in words,
    if it is recognised. At a port, `unseen`: why answers cannot show it; `unsure`: why it is not judged. `sent`: the
    stream of a trial that the sanitizer watched.
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
    sent: str = ""

    @property
    def verdict(self) -> Verdict:
        reasons: dict[Verdict, object] = {
            "failed": self.failures,
            "not judged": self.cause or self.unsure,
            "not observable": self.unseen,
        }
        return judge(verdict for verdict, reason in reasons.items() if reason)

    @property
    def why(self) -> str:
        """Why a port does not judge it, or ""."""
        return self.unsure or self.unseen


def failure_text(failure: Failure) -> str:
    """A failure for people, without the name of the check."""
    return f"{failure}".partition(": ")[2]


def case_names(rule: Rule) -> tuple[str, str, str]:
    """Names of the files that a rule may leave: its failure, a firmware fault, and the sanitizer's trial."""
    return f"{rule.id}{SUFFIX}", f"{rule.id}-fault{SUFFIX}", f"{rule.id}-sanitized{SUFFIX}"


def try_rule(rule: Rule, image: Image, seed: int = 0, keep: bool = False) -> Outcome:
    """Runs the rule's trial on `image`; with `keep`, the outcome contains its failures as cases."""
    run = run_trial(trial_of(rule), ConformsTo(rule=rule.id), image, seed)
    world = run.world
    failures = [failure for failure in run.failures if not failure.fault]
    faults = tuple(
        (robot.network, robot.slot, fault)
        for robot in world.robots
        for fault in robot.board.faults[:FAULTS_KEPT]
    )
    if not failures and (not world.finished or run.verdict_on("conforms_to") != "passed"):
        wanted = "a trial that can be judged"
        reason = (
            "more events than the robot's log holds" if world.finished else f"{MOST_FAULTS} firmware faults"
        )
        first = world.robots[0]
        failures = [Failure("conforms_to", first.network, first.slot, world.tick, wanted, reason)]
    cases = _cases(rule, run, failures, faults) if keep else ()
    sent = run.stream() if keep and on_world.get() is not None else ""
    return Outcome(rule.id, tuple(failures), faults, fault_count(world), cases, sent=sent)


def _cases(
    rule: Rule,
    run: Run,
    failures: Sequence[Failure],
    faults: Sequence[tuple[int, int, FirmwareFault]],
) -> tuple[tuple[str, str], ...]:
    """Each of which `mirotwin replay` brings to the same verdict."""
    own, of_fault, _ = case_names(rule)
    cases = []
    if failures and run.world.finished:
        cases.append((own, run.stream({"conforms_to": rule.id}, str(failures[0]))))
    if faults:
        first = min(faults, key=lambda fault: fault[2].tick)
        verdict = _of_fault("no_fault", NoFault.WANTED, *first)
        cases.append((of_fault, run.stream({"no_fault": True}, str(verdict))))
    return tuple(cases)


def _of_fault(check: str, wanted: str, network: int, slot: int, fault: FirmwareFault) -> Failure:
    return Failure(check, network, slot, fault.tick, wanted, str(fault), True)


FEWEST = 10
"""Rules for which a process is worth starting."""


def try_all(
    rules: Sequence[Rule],
    image: Image,
    seed: int = 0,
    keep: bool = False,
    ahead: bool = False,
    everything: bool = False,
) -> Iterator[Outcome]:
    """Yields each outcome when it is known, presupposed rules first; see `with_faults`. `ahead`: use two processes. A
    rule is not judged if a rule of `rules` that it presupposes failed; its trial is then not run, unless `everything`
    is set.
    """
    forbidden = {kind: rule.id for rule in rules for kind in rule.faults}
    tried = partial(_try_and_explain, image=image, seed=seed, keep=keep, forbidden=forbidden)
    theirs: dict[str, Future[Outcome]] = {}

    def outcome_of(rule: Rule) -> Outcome:
        with suppress(BrokenExecutor):  # the process was killed
            if rule.id in theirs:
                return theirs[rule.id].result()
        return tried(rule)

    outcomes = in_order(rules, outcome_of, everything)
    # before the process is copied: the first trial loads what every trial needs
    yield from islice(outcomes, 1)
    _copied["tried"] = tried
    with spare_process() if ahead and len(rules) >= FEWEST else nullcontext() as pool:
        if pool is not None:
            theirs |= {rule.id: pool.submit(_try_in_copy, rule) for rule in presupposed_first(rules)[1::2]}
        yield from outcomes


_copied: dict[str, Callable[[Rule], Outcome]] = {}
"""The functions that try a rule in the copied process.

A job with the image would not fit into a pipe: if the process were killed, the thread that writes the job would wait
for ever (issue 94777 of CPython, before 3.12).
"""


def _try_in_copy(rule: Rule) -> Outcome:
    return _copied["tried"](rule)


def _try_and_explain(
    rule: Rule, image: Image, seed: int, keep: bool, forbidden: Mapping[FaultKind, str]
) -> Outcome:
    """The outcome of a rule, with a hint if it failed.

    The rule is not judged if the firmware first did something that another rule forbids (`forbidden`: kind of fault ->
    rule): the behaviour after such a fault proves nothing about this rule.
    """
    outcome = try_rule(rule, image, seed, keep)
    if not outcome.failures:
        return outcome
    first_tick = outcome.failures[0].tick
    before = [fault.kind for _, _, fault in outcome.faults if fault.tick <= first_tick]
    cause = next((forbidden[kind] for kind in before if kind in forbidden), "")
    if cause:
        return msgspec.structs.replace(outcome, failures=(), cases=outcome.cases[-1:], cause=cause)
    place = (outcome.failures[0].network, image, seed)
    with sanitized(False):  # findings are of trials
        hint = rule.probe(*place) if rule.probe is not None else why_lost(rule, *place)
    return msgspec.structs.replace(outcome, hint=hint)


def in_order(
    rules: Sequence[Rule], tried: Callable[[Rule], Outcome], everything: bool = False
) -> Iterator[Outcome]:
    """Tries presupposed rules first. A rule is not `tried` where one of `rules` that it presupposes failed, unless
    `everything` is.
    """
    causes: dict[str, str] = {}
    for rule in presupposed_first(rules):
        failed = () if everything else presupposed(rule)
        cause = next((causes[cause_of.id] for cause_of in failed if cause_of.id in causes), "")
        outcome = Outcome(rule.id, (), cause=cause) if cause else tried(rule)
        if outcome.failures or outcome.cause:
            causes[rule.id] = outcome.cause or rule.id
        yield outcome


def with_faults(outcomes: Sequence[Outcome], rules: Sequence[Rule]) -> list[Outcome]:
    """The outcomes in the order of `rules`; the firmware faults of all trials become failures of the rules that forbid
    them.
    """
    by_id = {outcome.rule: outcome for outcome in outcomes}
    judged = []
    for rule in rules:
        if rule.id in by_id:  # else a port was lost before
            forbidden = [
                _of_fault("conforms_to", f"no such fault (trial of {outcome.rule})", *fault)
                for outcome in outcomes
                for fault in outcome.faults
                if fault[2].kind in rule.faults
            ]
            outcome = by_id[rule.id]
            cause = "" if forbidden else outcome.cause
            failures = (*forbidden, *outcome.failures)
            judged.append(msgspec.structs.replace(outcome, failures=failures, cause=cause))
    return judged
