"""Judges a MIRO's reaction to the characters it received, from the event log while it runs.

A crash counts once the check of the same name fails for it in a world (`mirotwin.verify.checks`). Both judge by the
same rules, `miro_protocol.robot_rules`; this oracle takes the frames that the robot received for those that the host
sent.

    RECEIVED --> window of the decoder --> fresh? --> what the wheels have to be told, and until when
    COMMAND of an LM629 --> order to a wheel -----> compared with it
    SENT --> window of telemetry --> an answer that was asked for
    FAULT --> a fault
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK, TICKS_PER_SECOND
from miro_protocol.decoder import Scanner
from miro_protocol.robot_receiver import Freshness
from miro_protocol.robot_rules import (
    ACTING_TICKS,
    TO_RI_TICKS,
    TO_TI_TICKS,
    AnswerRule,
    DrivingRule,
    OriginRule,
    SilenceRule,
)
from miro_protocol.table import (
    FAILSAFE_OFF_TICKS,
    FAILSAFE_STOP_TICKS,
    FRESH_AGAIN_TICKS,
    FRESH_STEPS,
    SEQ_MODULUS,
    SLOT_MASK,
    TELEMETRY,
    TICKS_PER_MS,
    VELOCITY_SATURATION,
    FrameType,
    downlink,
)
from miro_robot.board import Board
from miro_robot.event_log import COMMAND, FAULT, RECEIVED, SENT
from miro_robot.harness.harness import LiveOracle
from miro_robot.lm629.orders import WheelOrder
from miro_robot.lm629.signals import COMMAND_ERROR

NAMES = (
    "",
    "no_fault",
    "lm629_protocol",
    "moves_only_when_fresh",
    "accepts_only_sent",
    "acts_within_ms",
    "failsafe_stop_ms",
    "motors_off_ms",
    "answers_only_in_turn",
    "answers_within_ms",
)
"""The checks, by `code`."""
EDGE_TICKS = TICKS_PER_MS // 5
"""Within this distance of 150 ms a frame may be fresh or not: firmware measures the time to within 0.1 ms."""

_NO_FAULT, _LM629, _MOVES, _ACCEPTS, _ACTS, _STOPS, _OFF, _IN_TURN, _ANSWERS = range(1, 10)
_TEAM, _ASK = FrameType.TEAM, FrameType.TEAM_ASK


class FastOracle(LiveOracle):
    """The oracle of robot `slot` of `robots`, on `board`. `accepted`: fresh frames of the run; `pc`: of a fault."""

    NOT_STATE: tuple[str, ...] = ("*",)

    def __init__(self, board: Board, slot: int, robots: int) -> None:
        LiveOracle.__init__(self)
        form = downlink(robots)
        self.board = board
        self.log = board.log
        self.slot = slot
        self.robots = robots
        self.payload = form.payload_size
        self.window = Scanner(form)
        self.telemetry = Scanner(TELEMETRY)
        self.freshness = Freshness()
        self.left_order = WheelOrder()
        self.right_order = WheelOrder()
        self.driving = DrivingRule()
        self.origin = OriginRule(TICKS_PER_SECOND)
        self.answers = AnswerRule()
        self.stop = SilenceRule(FAILSAFE_STOP_TICKS)
        self.off = SilenceRule(FAILSAFE_OFF_TICKS)
        self.fresh_seq = 0
        self.left = 0  # the velocities of the last valid team frame
        self.right = 0
        self.begin(0)

    def begin(self, tick: int) -> None:
        LiveOracle.begin(self, tick)
        self.pc = 0
        self.accepted = 0
        self.read = self.log.end  # serial number of the next event
        self.freshness.accepted = 0
        self.decided = 1  # 0: it cannot be said any more what the robot must do
        self.up_tick = -1  # until when firmware that was reset may take to come up
        self._forget()
        self.origin.frames.clear()

    def _forget(self) -> None:
        """Resets the memory when the processor restarts: nothing received, nothing ordered."""
        self.window.begin()
        self.telemetry.begin()
        self.freshness.last_seq = None
        self.fresh_tick = -1  # of the last fresh frame
        self.told_tick = -1  # of an order to move whose pair is not judged yet
        self.left_order.begin()
        self.right_order.begin()
        self.driving.begin()
        self.answers.begin()
        self.stop.last_tick = -1
        self.off.last_tick = -1

    def restarted(self, tick: int) -> None:
        """Handles a restart: pins that all went high at once may have sent nonsense to an LM629, until firmware resets
        it.
        """
        self.up_tick = tick + ACTING_TICKS
        self.look(tick)
        self._forget()
        self.decided = 1

    def waits(self) -> bool:
        due = self.answers.asked_tick != NEVER_TICK or self.driving.deadline != NEVER_TICK
        return self.decided != 0 and due

    def look(self, tick: int) -> None:
        """Judges what has happened before `tick`."""
        log = self.log
        if self.read < log.first:
            self.read = log.first
        while self.read < log.end and self.code == 0:
            place = self.read & 2047
            at = log._ticks[place]
            kind = log._kinds[place]
            if kind == FAULT:
                self.pc = log._values[place]
                self._found(_NO_FAULT, at)
            else:
                self._pass(at)
                if kind == RECEIVED:
                    self._received(at, log._codes[place], log._values[place])
                elif kind == COMMAND:
                    self._command(at, log._codes[place], log._data[place])
                elif kind == SENT:
                    self._sent(at, log._values[place])
            self.read += 1
        if self.code == 0:
            self._pass(tick)
            word = self.board.left.signals.word | self.board.right.signals.word
            if word & COMMAND_ERROR and tick > self.up_tick:
                self._found(_LM629, tick)

    def _found(self, code: int, tick: int) -> None:
        if self.code == 0 and (self.decided or code == _NO_FAULT):
            self.code = code
            self.tick = tick

    def _pass(self, tick: int) -> None:
        """Checks what must have happened before `tick`."""
        if self.told_tick >= 0 and tick > self.told_tick:
            if not self.origin.allows(self.told_tick, self.left_order.word(), self.right_order.word()):
                self._found(_ACCEPTS, self.told_tick)
            self.told_tick = -1
        if tick > self.driving.deadline:
            self._found(_ACTS, self.driving.deadline)
        missed = self.answers.missed(tick)
        if missed >= 0:
            self._found(_ANSWERS, missed)
        self._pass_silence(_STOPS, self.stop, tick)
        self._pass_silence(_OFF, self.off, tick)

    def _pass_silence(self, code: int, silence: SilenceRule, tick: int) -> None:
        if silence.is_over(tick):
            if not (self._is_over(code, self.left_order) and self._is_over(code, self.right_order)):
                self._found(code, silence.deadline())
            silence.last_tick = -1

    def _is_over(self, code: int, order: WheelOrder) -> bool:
        """True if a wheel is as it has to be in silence: stopped or off."""
        return order.what == "off" if code == _OFF else not order.moves()

    # ---- what is received ----------------------------------------------------------------------------------

    def _received(self, tick: int, good_stop: int, value: int) -> None:
        self.stop.received(tick)
        self.off.received(tick)
        if self.window.take(value, good_stop == 0, tick - TO_RI_TICKS):
            self._frame(tick - TO_RI_TICKS)

    def _frame(self, tick: int) -> None:
        """A valid frame, whose last character began at `tick`."""
        hdr = self.window.body[0]
        kind = hdr >> 6
        seq = hdr % SEQ_MODULUS
        self._ask_whether_decided(seq, tick)
        fresh = self.freshness.judge(seq, tick)
        team = kind in (_TEAM, _ASK) and self._read_pair()
        if team:
            self.origin.team(tick, self.left, self.right)
        if fresh:
            self.accepted += 1
            self.fresh_tick = tick
            self.fresh_seq = seq
            self.driving.fresh_tick = tick
            self.stop.last_tick = tick
            self.off.last_tick = tick
            if team and not self._stops_already():
                self.driving.team(tick, self.left, self.right)
            if kind == _ASK and seq % self.robots == self.slot:
                self.answers.question(tick, seq)

    def _ask_whether_decided(self, seq: int, tick: int) -> None:
        since = tick - self.fresh_tick - FRESH_AGAIN_TICKS
        if self.fresh_tick >= 0 and -EDGE_TICKS <= since <= EDGE_TICKS:
            step = (seq - self.fresh_seq) % SEQ_MODULUS
            if step == 0 or step > FRESH_STEPS:
                self.decided = 0

    def _stops_already(self) -> bool:
        """True if velocity 0 is required and both wheels are ordered to it with their loops closed."""
        if self.left_order.what == "off" or self.right_order.what == "off":
            return False
        told = self.left_order.moves() or self.right_order.moves()
        return not told and self.left == 0 and self.right == 0

    def _read_pair(self) -> bool:
        """Reads this robot's velocities from the team frame; False if they must not be acted on."""
        if self.slot >= self.robots:
            return False
        for place in range(1, self.payload, 2):
            if self.window.body[place] == 0 and self.window.body[place + 1] == 0x80:
                return False
        self.left = self._word(1 + 4 * self.slot)
        self.right = self._word(3 + 4 * self.slot)
        return True

    def _word(self, place: int) -> int:
        word = self.window.body[place] | self.window.body[place + 1] << 8
        if word >= 0x8000:
            word -= 0x10000
        return max(-VELOCITY_SATURATION, min(VELOCITY_SATURATION, word))

    # ---- what the wheels are told, and what is sent --------------------------------------------------------

    def _command(self, tick: int, code: int, data: bytes) -> None:
        order = self.right_order if code >> 8 & 1 else self.left_order
        moved, driven = order.moves(), order.what != "off"
        if order.take(code & 0xFF, data):
            if order.moves():
                self.told_tick = tick
                if not self.driving.may_move(tick):
                    self._found(_MOVES, tick)
            elif moved and self.stop.is_early(tick):
                self._found(_STOPS, tick)
            if driven and order.what == "off" and self.off.is_early(tick):
                self._found(_OFF, tick)
            self.driving.told(self.left_order.word(), self.right_order.word())

    def _sent(self, tick: int, value: int) -> None:
        if not self.answers.character():
            self._found(_IN_TURN, tick)
        elif self.telemetry.take(value, False, tick - TO_TI_TICKS):
            tick -= TO_TI_TICKS
            seq = self.telemetry.body[0] % SEQ_MODULUS
            slot = self.telemetry.body[1] & SLOT_MASK
            if not self.answers.in_turn(seq) or slot != self.slot:
                self._found(_IN_TURN, tick)
            if self.answers.late(tick, seq):
                self._found(_ANSWERS, tick)
