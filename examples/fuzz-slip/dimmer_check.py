"""A check of the dimmer under any input, for `mirotwin fuzz --bare --expect lamps_as_told`."""

from typing import ClassVar

from slip_protocol import Damage, Slip

from mirotwin.verify.checks.interface import Check, Kind, Subject, SubjectKind
from mirotwin.verify.checks.serial import SerialMonitor

BRIGHT = 100
P1 = 0x90


class LampsAsTold(Check, frozen=True, kw_only=True, tag="lamps_as_told"):
    """Levels are 0..100, a lamp is on P1 if its level is not 0, and each answer is a good frame."""

    KIND: ClassVar[Kind] = "safety"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("board",)

    def monitor(self, subject: Subject) -> "LampsMonitor":
        return LampsMonitor(self, subject)


class LampsMonitor(SerialMonitor[LampsAsTold]):
    def end(self, tick: int) -> None:
        self.judged += 1
        wrong = self.wrong_lamp() or self.wrong_answer()
        if wrong:
            self.fail(tick, "", wrong)

    def wrong_lamp(self) -> str:
        memory = self.subject.memory
        for lamp, level in enumerate(memory["level"]):
            if level > BRIGHT:
                return f"lamp {lamp} has level {level}, of 0..{BRIGHT}"
            if bool(memory.sfr(P1) >> lamp & 1) != (level > 0):
                return f"lamp {lamp} has level {level} and is {'on' if level == 0 else 'off'}"
        return ""

    def wrong_answer(self) -> str:
        said = self.sent_since_reset
        for one in Slip().decode(said):
            if isinstance(one, Damage):
                return f"the answer {said[one.start : one.end].hex(' ')} is no frame: {one.reason}"
        return ""
