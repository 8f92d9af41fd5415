"""The check that a robot reacts at all to frames that reach it: dead, deaf and lame robots fail every run.

It demands little, so that firmware which is merely different passes: of several consecutive frames that request another
speed of a wheel, one must be followed by an STT to that wheel; and a wheel that is requested to turn must have its
motor driven or its encoder counting. It does not use the robot's serial port, which dead firmware never starts: a frame
counts if it is fresh as sent, the radio inverted none of its bits, and the robot is supplied and intact (a robot with a
lost encoder must not drive).

Firmware that restarts again and again (a watchdog, a jump to its start) obeys frames in between. The LM629s reveal it:
they are reset a second time after an order to turn, although nothing reset the processor.
"""

from __future__ import annotations

from typing import ClassVar

from miro_exact.bad_input import amount
from miro_exact.clock import HOST_CHARACTER_TICKS
from miro_protocol.decoder import Decoder, Received
from miro_protocol.robot_receiver import Freshness
from miro_protocol.table import downlink
from miro_robot.lm629.commands import BY_NAME
from miro_sim.periods import Axis, RobotPeriod
from miro_sim.radio.params import ONE, UP, Radio, threshold
from miro_sim.world.events import Event
from mirotwin.verify.checks.failsafe import ACTING_MS
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, ms_ticks
from mirotwin.verify.checks.reception import words_of

FRAMES = 5
"""Frames in a row without any effect."""
SLOWEST = 256
"""A speed of one count per LM629 sample (22 mm/s): 500 counts between two frames."""
FURTHEST_PPM = 10_000
"""Largest error of the PC's clock beside the robots'; further off a UART may lose characters."""
UNLIKELY = 1e-12
MOST_FRAMES = 10_000
_STT = BY_NAME["STT"].opcode
Waiting = tuple[int, int, tuple[int, int]]


class ActsAtAll(Check, frozen=True, kw_only=True, tag="acts_at_all"):
    """Of 5 fresh frames in a row that reach the robot undisturbed and ask for other speeds, it acts on one: it tells
    the wheels to turn, and their motors are driven. It does not reset unexpectedly.
    """

    KIND: ClassVar[Kind] = "liveness"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return AliveMonitor(self, subject)


def frames_needed(params: Radio, characters: int) -> int:
    """Number of consecutive frames of which a radio like this does not lose all; 0: no such number is known."""
    if abs(params.baud_offset_ppm - params.crystal_offset_ppm) > FURTHEST_PPM:
        return 0
    arrives = 1.0 - threshold(params.lost_frames) / ONE
    for _ in range(characters):
        arrives *= 1.0 - threshold(params.lost_character_rate) / ONE
    all_lost = 1.0
    for frames in range(1, MOST_FRAMES):
        all_lost *= 1.0 - arrives
        if frames >= FRAMES and all_lost <= UNLIKELY:
            return frames
    return 0


class _Wheel:
    """One wheel. `requested`: the speed of the last frame at the last order to it; None while unknown.

    The counts: frames since that order, and since its motor was driven. `ordered`: in the last control period.
    """

    def __init__(self) -> None:
        self.requested: int | None = 0
        self.unordered = 0
        self.undriven = 0
        self.ordered = self.driven = False
        self.position: int | None = None

    def look(self, axis: Axis, word: int | None) -> None:
        self.ordered = False
        for _, opcode, _ in axis.commands:
            if opcode == _STT:
                self.ordered = True
                break
        position = axis.real_position
        self.driven = axis.pwm_magnitude != 0 or (position != self.position and self.position is not None)
        if self.ordered:
            self.requested = word
            self.unordered = 0
        if self.driven:
            self.undriven = 0
        self.position = position

    def ask(self, word: int) -> None:
        if self.requested is None:
            self.requested = word
        if abs(word) >= SLOWEST:
            self.unordered += word != self.requested
            self.undriven += 1


class AliveMonitor(Monitor[ActsAtAll]):
    """`waiting`: (end, air before, velocities) of frames not yet counted.

    `counted`: frames that requested a speed; `shown`: frames to a robot that had just acted. These are not decoded,
    which would take a tenth of the loop's time.
    """

    EVENTS = ("sent",)
    LATER = True

    def __init__(self, check: ActsAtAll, subject: Subject) -> None:
        super().__init__(check, subject)
        self.acting_ticks = ms_ticks(ACTING_MS)
        radio = subject.radio
        self.needed = 0 if radio is None else frames_needed(radio.params, downlink(subject.robots).wire_size)
        self.decoder = Decoder(subject.robots)
        self.freshness = Freshness()
        self.board = subject.robot.board
        self.listener = None if radio is None else radio.listeners[subject.slot]
        self.unjudged: list[tuple[int, int, bool]] = []
        """At the end of each period not yet judged: air, tick of the last reset, True if the robot is intact;
        in order.
        """
        self.counted = self.shown = 0
        self.begun_tick = -1
        self.chip = self.board.left
        self.reset_tick = self.chip.reset_tick
        self.resets: list[int] = []  # of the LM629s, that are not judged yet
        self.period_over()
        self.air = self.before = self.unjudged.pop()[0]
        self._begin()

    def _begin(self) -> None:
        self.waiting: list[Waiting] = []
        self.left, self.right = _Wheel(), _Wheel()
        self.turned = False  # a wheel was ordered to turn since the processor began
        self.words: tuple[int | None, int | None] = (0, 0)

    def period_over(self) -> None:
        board, listener, air = self.board, self.listener, -1
        whole = self.subject.robot.is_whole() and (listener is None or not listener.rxd_state)
        if whole and listener is not None and board.powered and not board.held and listener.link_state == UP:
            air = listener.bit_errors
        self.unjudged.append((air, self.chip.reset_tick, whole))

    def restarted(self, tick: int) -> None:
        self.begun_tick = tick
        self._begin()

    def event(self, event: Event) -> None:
        if not self.needed or not event.good_stop:
            return
        left, right = self.left, self.right
        if left.ordered and left.driven and right.ordered and right.driven:
            self.words = (None, None)  # alive: the requested velocities need not be known
            self.shown += 1
            self.judged = int(self.shown >= FRAMES)
            return
        self.decoder.gap()
        for reception in self.decoder.feed(event.data, event.tick):
            words = words_of(reception, self.subject) if isinstance(reception, Received) else None
            if isinstance(reception, Received) and self.freshness.judge(reception.seq, reception.last_tick):
                if words is not None:
                    end_tick = reception.last_tick + HOST_CHARACTER_TICKS
                    self.waiting.append((end_tick, self.before, words))

    def period(self, record: RobotPeriod, tick: int) -> None:
        air, reset_tick, whole = self.unjudged.pop(0)
        if reset_tick != self.reset_tick:
            self.reset_tick = reset_tick
            if whole:
                self.resets.append(reset_tick)
        if self.resets or not self.turned:
            self._look_at_resets(record, tick)
        if not self.needed:
            return
        self.before, self.air = self.air, air
        due = self._due(tick) if self.waiting else []
        left, right = self.words
        self.left.look(record.left, left)
        self.right.look(record.right, right)
        for _, air, words in due:
            if 0 <= air == self.air:
                self.counted += any(abs(word) >= SLOWEST for word in words)
                self.judged = max(self.judged, int(self.counted >= self.needed))
                self.left.ask(words[0])
                self.right.ask(words[1])
        if due:
            self._judge(record, tick)

    def _look_at_resets(self, record: RobotPeriod, now: int) -> None:
        """Processes resets in the order of time.

        The board may be ahead; its resets after `now` wait for the next call.
        """
        due = [reset for reset in self.resets if reset <= now]
        del self.resets[: len(due)]
        commands = (*record.left.commands, *record.right.commands)
        turns = {tick for tick, opcode, _ in commands if opcode == _STT and tick > self.begun_tick}
        for tick in sorted(turns.union(due)):
            if tick in turns:
                self.turned = True
            elif self.turned:
                self.fail(tick, "a robot that does not reset unexpectedly", "the firmware reset the LM629s")
                self.turned = False

    def _due(self, tick: int) -> list[Waiting]:
        """The frames that should have had their effect by now; `words` become those of the last one that is over."""
        self.words = next((words for end, _, words in reversed(self.waiting) if end <= tick), self.words)
        due = [entry for entry in self.waiting if entry[0] + self.acting_ticks <= tick]
        del self.waiting[: len(due)]
        return due

    def _judge(self, record: RobotPeriod, tick: int) -> None:
        """Fails for a wheel that has now ignored the needed number of frames."""
        wheels = (("left", self.left), ("right", self.right))
        unordered = [side for side, wheel in wheels if wheel.unordered == self.needed]
        undriven = [
            side for side, wheel in wheels if wheel.undriven == self.needed and wheel.unordered < self.needed
        ]
        wanted = f"a robot that acts on one of {self.needed} frames that reached it"
        if unordered:
            accepted = (
                ""
                if record.accepted is None
                else f"; the firmware has accepted {amount(record.accepted, 'frame')}"
            )
            self.fail(tick, wanted, f"no command to turn the {' and the '.join(unordered)} wheel{accepted}")
        if undriven:
            self.fail(tick, wanted, f"the {' and the '.join(undriven)} wheel at rest, its motor not driven")
