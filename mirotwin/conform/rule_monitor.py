"""The check `conforms_to`: the robot keeps a rule, in the trial of that rule.

The monitor records events and judges each expectation at the end, except those that end after the run. If a host
departs from the script of the rule's trial, nothing is judged: the check is for trials only.
"""

from __future__ import annotations

from operator import itemgetter
from typing import ClassVar

from miro_exact.bad_input import BadInput
from miro_robot.faults import FirmwareFault
from miro_sim.periods import RobotPeriod
from miro_sim.world.events import Event
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import Rule
from mirotwin.conform.trial import trial_of
from mirotwin.verify.checks.interface import C_co, Check, Kind, Monitor, Subject


class ConformsTo(Check, frozen=True, kw_only=True, tag="conforms_to"):
    """A robot keeps a rule of the conformance page, in the trial of that rule."""

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "rule"

    rule: str

    def __post_init__(self) -> None:
        self.the_rule()

    def the_rule(self) -> Rule:
        """ValueError for a rule that there is not."""
        from mirotwin.conform.rules import find  # the rules are read when one is requested

        try:
            return find(self.rule)
        except BadInput as error:
            raise ValueError(f"{error.what}; {error.remedy}") from None

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return RuleMonitor(self, subject)


class ObservingMonitor(Monitor[C_co]):
    """Records all of one robot and its host that rules and timelines need."""

    EVENTS: tuple[str, ...] = ("sent", "received", "frame", "command", "heard", "answer", "reset", "power")

    def __init__(self, check: C_co, subject: Subject) -> None:
        super().__init__(check, subject)
        self.observed = Observed(subject.robots, subject.slot)

    def event(self, event: Event) -> None:
        self.observed.take(event)

    def restarted(self, tick: int) -> None:
        self.observed.restarted(tick)

    def period(self, record: RobotPeriod, tick: int) -> None:
        self.observed.take_period(tick, record, self.subject.robot.board)

    def end(self, tick: int) -> None:
        self.observed.end_tick = tick


class RuleMonitor(ObservingMonitor[ConformsTo]):
    """`off_script`: the host of this network left the trial's script; `remaining`: what it still sends."""

    EVENTS = ("command", "heard", "answer", "sent")

    def __init__(self, check: ConformsTo, subject: Subject) -> None:
        super().__init__(check, subject)
        self.rule = check.the_rule()
        self.trial = trial_of(self.rule)
        self.off_script = subject.network >= len(self.trial.expected)
        self.remaining = self.trial.transmissions_of(subject.network)[::-1]  # so that the next one is popped

    def event(self, event: Event) -> None:
        super().event(event)
        if event.what == "sent":
            scripted = self.remaining.pop() if self.remaining else None
            if scripted is None or (scripted.tick, scripted.data) != (event.tick, event.data):
                self.off_script = True

    def fault(self, fault: FirmwareFault) -> None:
        if fault.kind in self.rule.faults:
            self.fail(fault.tick, "no such firmware fault", str(fault), fault=True)

    def end(self, tick: int) -> None:
        super().end(tick)
        if self.off_script or (self.remaining and self.remaining[-1].tick < tick):
            self.failures.clear()
            self.failed = 0
            return
        judged = [expected for expected in self.trial.expected_of(self.subject) if expected.tick < tick]
        self.judged += len(judged)
        failures = [
            (expected.wanted, *failure)
            for expected in judged
            if (failure := expected.found(self.observed)) is not None
        ]
        for wanted, failed_tick, text in sorted(failures, key=itemgetter(1)):
            self.fail(failed_tick, wanted, text)
