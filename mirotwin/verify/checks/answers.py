"""Checks of a robot's answers: it answers each question in time, and never sends without a question.

A question is a fresh frame of type 3 whose number mod N is the robot's slot (protocol/README.md, "Turns").
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_protocol.decoder import Received, TelemetryDecoder
from miro_protocol.frames import ContentError, TelemetryFrame
from miro_protocol.robot_rules import ANSWER_TICKS, TO_TI_TICKS, AnswerRule
from miro_protocol.table import TICKS_PER_MS, FrameType
from miro_sim.world.events import Event
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, SubjectKind, in_ms, ms_ticks
from mirotwin.verify.checks.signals import AnswersMonitor


class AnswersWithin(Check, frozen=True, kw_only=True, tag="answers_within_ms"):
    """A question is answered: the answer's last character begins within so long of the question's last character.

    Of a board alone: the first character of the answer is sent so soon after the last one that it received.
    """

    KIND: ClassVar[Kind] = "liveness"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("robot", "board")
    MAIN: ClassVar[str] = "within_ms"

    within_ms: Annotated[float, Meta(gt=0.0, le=60_000.0)] = ANSWER_TICKS / TICKS_PER_MS

    def monitor(self, subject: Subject) -> Monitor[Check]:
        if subject.alone:
            return AnswersMonitor(self, subject, self.within_ms)
        return WithinMonitor(self, subject)


class AnswersOnlyInTurn(Check, frozen=True, kw_only=True, tag="answers_only_in_turn"):
    """The robot sends nothing but one answer a question, with its own slot and the question's number."""

    KIND: ClassVar[Kind] = "safety"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return TurnMonitor(self, subject)


class _AnswerMonitor(Monitor[Check]):
    """Records questions and answers. `decoder`: of the robot's characters."""

    EVENTS = ("frame", "transmitted")

    def __init__(self, check: Check, subject: Subject, rule: AnswerRule) -> None:
        super().__init__(check, subject)
        self.decoder = TelemetryDecoder()
        self.rule = rule

    def event(self, event: Event) -> None:
        self.until(event.tick)
        frame = event.frame
        if event.what == "transmitted":
            self.character(event.tick)
            for reception in self.decoder.feed_symbols([(event.value, True, event.tick - TO_TI_TICKS)]):
                if isinstance(reception, Received):
                    self.answer(reception)
        elif frame is not None and event.value and frame.type == FrameType.TEAM_ASK:
            if frame.seq % self.subject.robots == self.subject.slot:
                self.judged += 1
                self.rule.question(frame.last_tick, frame.seq)

    def restarted(self, tick: int) -> None:
        self.until(tick)
        self.decoder = TelemetryDecoder()
        self.rule.begin()

    def character(self, tick: int) -> None:
        """The robot sent a character."""

    def answer(self, frame: Received) -> None:
        raise NotImplementedError


class WithinMonitor(_AnswerMonitor):
    """Fails where the question that waits is answered too late, or not at all."""

    def __init__(self, check: AnswersWithin, subject: Subject) -> None:
        super().__init__(check, subject, AnswerRule(ms_ticks(check.within_ms)))
        self.wanted = f"an answer within {check.within_ms:g} ms of the question"

    def answer(self, frame: Received) -> None:
        late = self.rule.late(frame.last_tick, frame.seq)
        if late:
            self.fail(frame.last_tick, self.wanted, f"it after {in_ms(self.rule.within_ticks + late)}")

    def until(self, tick: int) -> None:
        deadline = self.rule.missed(tick)
        if deadline >= 0:
            self.fail(deadline, self.wanted, "none by then")


class TurnMonitor(_AnswerMonitor):
    """`babbling`: it has failed already for characters that follow each other."""

    def __init__(self, check: Check, subject: Subject) -> None:
        super().__init__(check, subject, AnswerRule())
        self.babbling = False

    def character(self, tick: int) -> None:
        if self.rule.character():
            self.babbling = False
        elif not self.babbling:
            self.babbling = True
            self.fail(tick, "silence of a robot that is not asked", "a character on TXD")

    def answer(self, frame: Received) -> None:
        seqs = [seq for seq in (self.rule.before_seq, self.rule.last_seq) if seq >= 0]
        allowed = " or ".join(map(str, seqs)) or "none"
        wanted = f"an answer of robot {self.subject.slot} to question {allowed}"
        in_turn = self.rule.in_turn(frame.seq)
        try:
            message = frame.message(self.subject.robots)
        except ContentError as error:
            self.fail(frame.last_tick, wanted, f"contents that cannot be read: {error}")
            return
        assert isinstance(message, TelemetryFrame)
        if message.slot != self.subject.slot or not in_turn:
            self.fail(frame.last_tick, wanted, f"one of robot {message.slot} to question {frame.seq}")
