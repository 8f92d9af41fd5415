"""A robot's obligations to its host: each rule once, as arithmetic over the ticks of events.

The checks of a run, the fuzzer's oracle and the trials of `mirotwin conform` use these rules with their own
observations and messages. `tests/naive/robot_rules.py` is a slow version over a whole history.

Ticks of a frame are those of the start bit of its last character, `last_tick`; it ends a character later. A wheel's
velocity is a word of the radio (1/256 count per sample).
"""

from __future__ import annotations

from collections import deque

from miro_exact.clock import HOST_CHARACTER_TICKS, NEVER_TICK
from miro_protocol.table import ROBOT_BIT_TICKS, TELEMETRY, TICKS_PER_MS

ACTING_TICKS = 10 * TICKS_PER_MS
"""Firmware has dealt with a frame so long after it; a fair third of a camera frame."""
ANSWER_TICKS = 30 * TICKS_PER_MS
"""From a question's last character to that of its answer, which alone takes 18.7 ms."""
TOLERANCE_TICKS = TICKS_PER_MS // 2
"""Tolerance of the failsafe's times: one and a half LM629 samples."""
TESTING_TICKS = 2 * TICKS_PER_MS
"""Longest delay of the failsafe by the test of a frame; the shipped firmware takes up to 1.5 ms for five robots."""
TO_RI_TICKS = 9 * ROBOT_BIT_TICKS + ROBOT_BIT_TICKS * 10 // 16 + ROBOT_BIT_TICKS // 32
"""From a character's start bit to RI: 9 10/16 bits, and half of the sixteenth by which the port may see it late."""
TO_TI_TICKS = 9 * ROBOT_BIT_TICKS
"""From a character's start bit to TI, which is set when its stop bit begins."""
NO_WORD = 1 << 30
"""A velocity that no frame can hold."""

_ACTING, _TESTING, _TO_TI = ACTING_TICKS, TESTING_TICKS, TO_TI_TICKS
_CHARACTER, _NEVER, _ANSWER_SIZE = HOST_CHARACTER_TICKS, NEVER_TICK, TELEMETRY.wire_size


class SilenceRule:
    """The failsafe: after a time without a fresh frame both wheels must be stopped, or off, within a tolerance.

    A robot may count from the start or from the end of the frame's last character. A robot that receives characters at
    that time may be testing a frame, which may be fresh: it has `TESTING_TICKS` more. `last_tick`, which the caller
    sets: of the last fresh frame, -1 before the first and once its silence is judged; `received_tick`: of the last
    character.
    """

    NOT_STATE = ("*",)

    def __init__(self, after_ticks: int, tolerance_ticks: int = TOLERANCE_TICKS) -> None:
        self.after_ticks = after_ticks
        self.tolerance_ticks = tolerance_ticks
        self.last_tick = -1
        self.received_tick = -1

    def end_tick(self) -> int:
        """The end of the last fresh frame."""
        return self.last_tick + _CHARACTER

    def earliest_tick(self) -> int:
        """Wheels that go over before this do so too early."""
        return self.last_tick + max(self.after_ticks - self.tolerance_ticks, 0)

    def latest_tick(self) -> int:
        """End of the tolerance for a robot that tests no frame."""
        return self.end_tick() + self.after_ticks + self.tolerance_ticks

    def received(self, tick: int) -> None:
        """A character came. Once the time is over it puts nothing off."""
        if self.last_tick < 0 or tick <= self.latest_tick():
            self.received_tick = tick

    def deadline(self) -> int:
        """End of the tolerance, including the test of a frame that may be under way."""
        latest = self.latest_tick()
        begun = latest - self.tolerance_ticks - _TESTING
        return latest + _TESTING if begun <= self.received_tick <= latest else latest

    def is_over(self, tick: int) -> bool:
        """True if at `tick` both wheels had to have gone over."""
        return self.last_tick >= 0 and tick > self.latest_tick() and tick > self.deadline()

    def is_judged(self, tick: int) -> bool:
        """True if a wheel that goes over at `tick` does so in silence: right after a frame it does what that says."""
        return self.last_tick >= 0 and tick - self.end_tick() > _ACTING

    def is_early(self, tick: int) -> bool:
        """True if a wheel that goes over at `tick` does so too early."""
        return self.is_judged(tick) and tick < self.earliest_tick()


class DrivingRule:
    """Wheels may be ordered to turn only within `within_ticks` of a fresh frame, and must get a fresh team frame's
    velocities in time.

    `fresh_tick`, set by the caller: of the last fresh frame of any type, -1 before the first; `deadline`: of the
    first team frame that waits.
    """

    NOT_STATE = ("*",)

    def __init__(self, within_ticks: int = ACTING_TICKS) -> None:
        self.within_ticks = within_ticks
        self.waiting: list[tuple[int, int, int]] = []
        self.begin()

    def begin(self) -> None:
        """Resets the rule: no frame has come yet."""
        self.fresh_tick = -1
        self.deadline = _NEVER
        self.waiting.clear()

    def may_move(self, tick: int) -> bool:
        """True if a wheel may be ordered to turn at `tick`."""
        return self.fresh_tick >= 0 and tick - self.fresh_tick <= self.within_ticks

    def team(self, tick: int, left: int, right: int) -> None:
        """Sets the velocities of a fresh team frame, which the wheels must be ordered to have."""
        self.waiting.append((tick + self.within_ticks, left, right))
        self.deadline = self.waiting[0][0]

    def told(self, left: int, right: int) -> None:
        """The wheels are ordered to these velocities now: their frame is obeyed, and earlier ones are done."""
        for place in range(len(self.waiting) - 1, -1, -1):
            if self.waiting[place][1:] == (left, right):
                del self.waiting[: place + 1]
                break
        self.deadline = self.waiting[0][0] if self.waiting else _NEVER

    def missed(self, tick: int) -> tuple[int, int, int] | None:
        """(deadline, left, right) of a frame that was not obeyed before `tick`; it waits no longer."""
        if tick <= self.deadline:
            return None
        overdue = self.waiting.pop(0)
        self.deadline = self.waiting[0][0] if self.waiting else _NEVER
        return overdue


class OriginRule:
    """Velocities are those of one of the team `frames` of the last `within_ticks`."""

    NOT_STATE = ("*",)

    def __init__(self, within_ticks: int) -> None:
        self.within_ticks = within_ticks
        self.frames: deque[tuple[int, int, int]] = deque()

    def team(self, tick: int, left: int, right: int) -> None:
        """A team frame, in the order of time."""
        self.frames.append((tick, left, right))

    def allows(self, tick: int, left: int, right: int) -> bool:
        """True if the wheels may be ordered to these velocities at `tick`, which must not decrease."""
        while self.frames and self.frames[0][0] < tick - self.within_ticks:
            self.frames.popleft()
        allowed = False
        for begun, sent_left, sent_right in self.frames:
            allowed = allowed or (begun <= tick and sent_left == left and sent_right == right)
        return allowed


class AnswerRule:
    """One answer a question, with its number and in time; without a question silence.

    `asked_tick`, `asked_seq`: the pending question; the tick is NEVER_TICK without one. A question that comes while one
    waits need not be answered. `last_seq`, `before_seq`: the last two questions, -1 for none; `allowed`: characters
    that may still be sent.
    """

    NOT_STATE = ("*",)

    def __init__(self, within_ticks: int = ANSWER_TICKS) -> None:
        self.within_ticks = within_ticks
        self.begin()

    def begin(self) -> None:
        """Resets the rule: no question has come yet."""
        self.asked_tick = _NEVER
        self.asked_seq = -1
        self.last_seq = -1
        self.before_seq = -1
        self.allowed = 0

    def question(self, tick: int, seq: int) -> None:
        """A fresh question to this robot."""
        if self.asked_tick == _NEVER:
            self.asked_tick = tick
            self.asked_seq = seq
        self.before_seq = self.last_seq
        self.last_seq = seq
        self.allowed = _ANSWER_SIZE

    def character(self) -> bool:
        """The robot sends a character: whether it may."""
        if self.allowed == 0:
            return False
        self.allowed -= 1
        return True

    def in_turn(self, seq: int) -> bool:
        """An answer with this number was sent: whether it answers a question. That to the last one is the last."""
        if seq == self.last_seq:
            self.allowed = 0
        return seq in (self.last_seq, self.before_seq)

    def late(self, tick: int, seq: int) -> int:
        """By how much the question that waited was answered too late, 0 if it was not by this answer or in time."""
        if self.asked_tick == _NEVER or seq != self.asked_seq:
            return 0
        late = tick - self.asked_tick - self.within_ticks
        self.asked_tick = _NEVER
        return late if late > 0 else 0

    def missed(self, tick: int) -> int:
        """Deadline of the pending question if it was before `tick`, and drops the question; else -1.

        An answer is known only when TI is set for its last character.
        """
        if self.asked_tick == _NEVER or tick <= self.asked_tick + self.within_ticks + _TO_TI:
            return -1
        deadline = self.asked_tick + self.within_ticks
        self.asked_tick = _NEVER
        return deadline
