"""Checks of a robot's answers: each question to it is answered in time, and it never speaks unasked.

A question is a fresh frame of type 3 whose number mod N is the robot's slot (protocol/README.md, "Turns").
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_exact.clock import ROBOT_BIT_TICKS
from miro_protocol.decoder import Received, TelemetryDecoder
from miro_protocol.frames import ContentError, TelemetryFrame
from miro_protocol.table import TELEMETRY, FrameType
from miro_sim.world.events import Event
from mirotwin.verify.checks.interface import Check, Judge, Kind, Subject, in_ms, ms_ticks

TO_TI_TICKS = 9 * ROBOT_BIT_TICKS
"""From a character's start bit to TI, which is set when its stop bit begins."""


class AnswersWithin(Check, frozen=True, kw_only=True, tag="answers_within_ms"):
    """A question is answered: the answer's last character begins within so long of the question's last character.

    An answer alone takes 18.7 ms to its last character.
    """

    KIND: ClassVar[Kind] = "liveness"
    MAIN: ClassVar[str] = "within_ms"

    within_ms: Annotated[float, Meta(gt=0.0, le=60_000.0)] = 30.0

    def judge(self, subject: Subject) -> Judge[Check]:
        return WithinJudge(self, subject)


class AnswersOnlyInTurn(Check, frozen=True, kw_only=True, tag="answers_only_in_turn"):
    """The robot sends nothing but one answer a question, with its own slot and the question's number."""

    KIND: ClassVar[Kind] = "safety"

    def judge(self, subject: Subject) -> Judge[Check]:
        return TurnJudge(self, subject)


class _AnswerJudge(Judge[Check]):
    """Knows questions and answers. `decoder`: of what the robot sends."""

    HEARS = ("frame", "transmitted")

    def __init__(self, check: Check, subject: Subject) -> None:
        super().__init__(check, subject)
        self.decoder = TelemetryDecoder()

    def event(self, event: Event) -> None:
        self.until(event.tick)
        frame = event.frame
        if event.what == "transmitted":
            self.character(event.tick)
            for found in self.decoder.feed_symbols([(event.value, True, event.tick - TO_TI_TICKS)]):
                if isinstance(found, Received):
                    self.answer(found)
        elif frame is not None and event.value and frame.type == FrameType.TEAM_ASK:
            if frame.seq % self.subject.robots == self.subject.slot:
                self.question(frame)

    def restarted(self, tick: int) -> None:
        self.until(tick)
        self.decoder = TelemetryDecoder()

    def question(self, frame: Received) -> None:
        raise NotImplementedError

    def character(self, tick: int) -> None:
        """The robot sent a character."""

    def answer(self, frame: Received) -> None:
        raise NotImplementedError


class WithinJudge(_AnswerJudge):
    """`asked`: the question that waits for its answer. One that comes meanwhile need not be answered."""

    def __init__(self, check: AnswersWithin, subject: Subject) -> None:
        super().__init__(check, subject)
        self.asked: list[Received] = []
        self.within_ticks = ms_ticks(check.within_ms)
        self.wanted = f"an answer within {check.within_ms:g} ms of the question"

    def question(self, frame: Received) -> None:
        self.judged += 1
        if not self.asked:
            self.asked = [frame]

    def answer(self, frame: Received) -> None:
        for asked in self.asked:
            if asked.seq == frame.seq:
                self.asked.remove(asked)
                late = frame.last_tick - asked.last_tick
                if late > self.within_ticks:
                    self.fail(frame.last_tick, self.wanted, f"it after {in_ms(late)}")
                return

    def restarted(self, tick: int) -> None:
        super().restarted(tick)
        self.asked = []

    def until(self, tick: int) -> None:
        # an answer is known only when TI is set for its last character
        while self.asked and tick > self.asked[0].last_tick + self.within_ticks + TO_TI_TICKS:
            question = self.asked.pop(0)
            self.fail(question.last_tick + self.within_ticks, self.wanted, "none by then")


class TurnJudge(_AnswerJudge):
    """`allowed`: characters of answers to come; `seqs`: numbers of the questions that wait."""

    def __init__(self, check: Check, subject: Subject) -> None:
        super().__init__(check, subject)
        self.allowed = 0
        self.seqs: list[int] = []
        self.babbling = False

    def question(self, frame: Received) -> None:
        self.judged += 1
        self.allowed = TELEMETRY.wire_size
        self.seqs = [*self.seqs[-1:], frame.seq]

    def restarted(self, tick: int) -> None:
        super().restarted(tick)
        self.allowed = 0
        self.seqs = []

    def character(self, tick: int) -> None:
        if self.allowed:
            self.allowed -= 1
            self.babbling = False
        elif not self.babbling:
            self.babbling = True
            self.fail(tick, "silence of a robot that is not asked", "a character on TXD")

    def answer(self, frame: Received) -> None:
        if frame.seq in self.seqs[-1:]:
            self.allowed = 0
        wanted = (
            f"an answer of robot {self.subject.slot} to question {' or '.join(map(str, self.seqs)) or 'none'}"
        )
        try:
            message = frame.message(self.subject.robots)
        except ContentError as error:
            self.fail(frame.last_tick, wanted, f"contents that cannot be read: {error}")
            return
        assert isinstance(message, TelemetryFrame)
        if message.slot != self.subject.slot or frame.seq not in self.seqs:
            self.fail(frame.last_tick, wanted, f"one of robot {message.slot} to question {frame.seq}")
