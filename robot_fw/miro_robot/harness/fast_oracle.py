"""What a MIRO must do with what its serial port received, judged from the event log while it runs.

A find counts once the check of the same name fails for it in a world (`mirotwin.verify.checks`, which this follows in
a shorter form: one frame and one question wait at a time).

    RECEIVED --> window of the decoder --> fresh? --> what the wheels have to be told, and until when
    COMMAND of an LM629 --> order to a wheel -----> compared with it
    SENT --> window of telemetry --> an answer that was asked for
    FAULT --> a fault

Times are those of the checks, from the start bit of a frame's last character, of the failsafe from its end.

Long because all rules look at one stream of events and share what was heard and told; a compiled class is one file.
"""

from __future__ import annotations

from miro_exact.clock import HOST_CHARACTER_TICKS, NEVER_TICK
from miro_protocol.freshness import Freshness
from miro_protocol.scan import Scanner
from miro_protocol.table import (
    FAILSAFE_OFF_TICKS,
    FAILSAFE_STOP_TICKS,
    FRESH_AGAIN_TICKS,
    FRESH_STEPS,
    ROBOT_BIT_TICKS,
    SEQ_MODULUS,
    SLOT_MASK,
    TELEMETRY,
    TICKS_PER_MS,
    VELOCITY_SATURATION,
    FrameType,
    downlink,
)
from miro_robot import event_log
from miro_robot.board import Board
from miro_robot.harness.oracle import LiveOracle
from miro_robot.lm629.commands import BY_NAME
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
ACTING_TICKS = 10 * TICKS_PER_MS
ANSWER_TICKS = 30 * TICKS_PER_MS
TOLERANCE_TICKS = TICKS_PER_MS // 2
"""Of the failsafe's times, as in the checks of a run."""
TESTING_TICKS = 2 * TICKS_PER_MS
EDGE_TICKS = TICKS_PER_MS // 5

_NO_FAULT, _LM629, _MOVES, _ACCEPTS, _ACTS, _STOPS, _OFF, _IN_TURN, _ANSWERS = range(1, 10)
_ACTING, _ANSWER, _TOLERANCE, _TESTING = ACTING_TICKS, ANSWER_TICKS, TOLERANCE_TICKS, TESTING_TICKS
_EDGE, _FRESH_AGAIN, _FRESH_STEPS = EDGE_TICKS, FRESH_AGAIN_TICKS, FRESH_STEPS
_SILENCES = (FAILSAFE_STOP_TICKS, FAILSAFE_OFF_TICKS)
_NEVER = NEVER_TICK
_CHARACTER = HOST_CHARACTER_TICKS
_TO_RI = 9 * ROBOT_BIT_TICKS + ROBOT_BIT_TICKS * 10 // 16 + ROBOT_BIT_TICKS // 32
_TO_TI = 9 * ROBOT_BIT_TICKS
_SATURATION = VELOCITY_SATURATION
_TEAM, _ASK = FrameType.TEAM, FrameType.TEAM_ASK
_SEQS = SEQ_MODULUS
_SLOT_MASK = SLOT_MASK
_ANSWER_SIZE = TELEMETRY.wire_size
_RECEIVED, _SENT, _COMMAND, _FAULT = event_log.RECEIVED, event_log.SENT, event_log.COMMAND, event_log.FAULT
_RESET, _STT, _LTRJ = (BY_NAME[name].opcode for name in ("RESET", "STT", "LTRJ"))
_COMMAND_ERROR = COMMAND_ERROR
_WORD_OFF, _WORD_STOPS, _VELOCITY_MODE, _FORWARD = 0x0100, 0x0600, 0x0800, 0x1000  # of LTRJ's control word
_HAS_ACCELERATION, _HAS_VELOCITY, _RELATIVE = 0x20, 0x08, 0x04
_OFF_ORDER, _STOP_ORDER, _DRIVE_ORDER = range(3)
_NO_WORD = 1 << 30
_PAIRS = 64


class FastOracle(LiveOracle):
    """Of robot `slot` of `robots`, whose board is `board`. `accepted`: fresh frames of the run; `pc`: of a fault."""

    NOT_STATE: tuple[str, ...] = (
        *LiveOracle.NOT_STATE,
        *("board", "slot", "robots", "window", "telemetry", "freshness", "read", "pc", "accepted"),
        *(
            "decided",
            "up_tick",
            "fresh_tick",
            "fresh_seq",
            "heard_tick",
            "told_tick",
            "wanted_tick",
            "wanted",
        ),
        *("control", "velocity", "order", "speed", "pairs", "pair_end", "silence_tick", "silences"),
        *("asked_tick", "asked_seq", "allowed", "before_seq", "payload", "log"),
    )

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
        self.silences = list(_SILENCES)
        self.read = 0  # serial number of the next event
        self.decided = 1  # 0: it cannot be said any more what the robot must do
        self.up_tick = -1  # until when firmware that was reset may take to come up
        self.fresh_seq = 0
        self.pc = 0
        self.accepted = 0
        # Per side: what LTRJ loaded, and the order in force.
        self.control = [0] * 2
        self.velocity = [0] * 2
        self.order = [0] * 2
        self.speed = [0] * 2
        self.fresh_tick = -1  # of the last fresh frame
        self.heard_tick = -1  # of the last character
        self.told_tick = -1  # of an order to move whose pair is not judged yet
        self.wanted_tick = _NEVER  # until when the wheels have to be told `wanted`
        self.wanted = [0] * 2
        self.pairs = [0] * 128  # the velocities of the last valid team frames
        self.pair_end = 0
        self.silence_tick = [0] * 2  # from when stop and off are due; -1: they are not
        self.asked_tick = _NEVER
        self.asked_seq = -1
        self.before_seq = -1
        self.allowed = 0

    def begin(self, tick: int) -> None:
        self.code = 0
        self.tick = 0
        self.pc = 0
        self.accepted = 0
        self.read = self.log.end
        self.freshness.accepted = 0
        self.decided = 1
        self.up_tick = -1
        self._forget()
        self.pair_end = 0

    def _forget(self) -> None:
        """The processor begins anew: nothing was heard or told."""
        self.window.begin()
        self.telemetry.begin()
        self.freshness.last_seq = None
        self.fresh_tick = -1
        self.heard_tick = -1
        self.told_tick = -1
        self.wanted_tick = _NEVER
        self.asked_tick = _NEVER
        self.asked_seq = -1
        self.before_seq = -1
        self.allowed = 0
        for side in range(2):
            self.order[side] = _OFF_ORDER
            self.control[side] = 0
            self.velocity[side] = 0
            self.speed[side] = 0
            self.silence_tick[side] = -1

    def restarted(self, tick: int) -> None:
        """Pins that all went high at once may have told an LM629 nonsense, until firmware has reset it."""
        self.up_tick = tick + _ACTING
        self.look(tick)
        self._forget()
        self.decided = 1

    def waits(self) -> bool:
        return self.decided != 0 and (self.asked_tick != _NEVER or self.wanted_tick != _NEVER)

    def look(self, tick: int) -> None:
        """Judges what has happened before `tick`."""
        log = self.log
        if self.read < log.first:
            self.read = log.first
        while self.read < log.end and self.code == 0:
            place = self.read & 2047
            at = log._ticks[place]
            kind = log._kinds[place]
            if kind == _FAULT:
                self._fault(at, log._codes[place], log._low[place])
            else:
                self._pass(at)
                if kind == _RECEIVED:
                    self._received(at, log._codes[place], log._low[place])
                elif kind == _COMMAND:
                    self._command(at, log._codes[place], log._sizes[place], log._high[place], log._low[place])
                elif kind == _SENT:
                    self._sent(at, log._low[place])
            self.read += 1
        if self.code == 0:
            self._pass(tick)
            word = self.board.left.signals.word | self.board.right.signals.word
            if word & _COMMAND_ERROR and tick > self.up_tick:
                self._found(_LM629, tick)

    def _found(self, code: int, tick: int) -> None:
        if self.code == 0 and (self.decided or code == _NO_FAULT):
            self.code = code
            self.tick = tick

    def _fault(self, tick: int, kind: int, pc: int) -> None:
        self.pc = pc
        self._found(_NO_FAULT, tick)

    # ---- time ----------------------------------------------------------------------------------------------

    def _pass(self, tick: int) -> None:
        """What had to have happened before `tick`."""
        if self.told_tick >= 0 and tick > self.told_tick:
            self._judge_pair()
        if tick > self.wanted_tick:
            self._found(_ACTS, self.wanted_tick)
        if tick > self.asked_tick + _TO_TI:
            self._found(_ANSWERS, self.asked_tick)
        for what in range(2):
            if self.silence_tick[what] >= 0:
                self._pass_silence(what, tick)

    def _pass_silence(self, what: int, tick: int) -> None:
        """A robot that receives characters then may be testing a frame."""
        due = self.silence_tick[what] + self.silences[what]
        latest = due + _TOLERANCE
        if due - _TESTING <= self.heard_tick <= latest:
            latest += _TESTING
        if tick > latest:
            if not (self._fulfilled(what, 0) and self._fulfilled(what, 1)):
                self._found(_STOPS + what, latest)
            self.silence_tick[what] = -1

    def _is_over(self, what: int, tick: int) -> bool:
        """Whether a silence's time is over, though it is not judged: characters then put nothing off."""
        since = self.silence_tick[what]
        return since >= 0 and tick > since + self.silences[what] + _TOLERANCE

    def _fulfilled(self, what: int, side: int) -> bool:
        """Whether a wheel is as it has to be in silence: told to stop (0), off (1)."""
        if what:
            return self.order[side] == _OFF_ORDER
        return self.order[side] != _DRIVE_ORDER or self.speed[side] == 0

    # ---- what is heard -------------------------------------------------------------------------------------

    def _received(self, tick: int, good_stop: int, value: int) -> None:
        if not (self._is_over(0, tick) or self._is_over(1, tick)):
            self.heard_tick = tick
        if self.window.take(value, good_stop == 0, tick - _TO_RI):
            self._frame(tick - _TO_RI)

    def _frame(self, tick: int) -> None:
        """A valid frame, whose last character began at `tick`."""
        hdr = self.window.body_at(0)
        kind = hdr >> 6
        seq = hdr % _SEQS
        self._ask_whether_decided(seq, tick)
        fresh = self.freshness.judge(seq, tick)
        team = kind in (_TEAM, _ASK) and self._read_pair(fresh)
        if fresh:
            self.accepted += 1
            self.fresh_tick = tick
            self.fresh_seq = seq
            self.silence_tick[0] = tick + _CHARACTER
            self.silence_tick[1] = tick + _CHARACTER
            if team:
                self.wanted_tick = _NEVER if self._stops_already() else tick + _ACTING
            if kind == _ASK and seq % self.robots == self.slot:
                if self.asked_tick == _NEVER:
                    self.asked_tick = tick + _ANSWER
                self.before_seq = self.asked_seq
                self.asked_seq = seq
                self.allowed = _ANSWER_SIZE

    def _ask_whether_decided(self, seq: int, tick: int) -> None:
        """Firmware tells 150 ms to within 0.1 ms: what it makes of a frame right at that edge, nobody can say."""
        since = tick - self.fresh_tick - _FRESH_AGAIN
        if self.fresh_tick >= 0 and -_EDGE <= since <= _EDGE:
            step = (seq - self.fresh_seq) % _SEQS
            if step == 0 or step > _FRESH_STEPS:
                self.decided = 0

    def _stops_already(self) -> bool:
        """Whether velocity 0 is wanted, and both wheels are told so with their loops closed."""
        for side in range(2):
            if self.wanted[side] != 0 or self.order[side] == _OFF_ORDER or not self._fulfilled(0, side):
                return False
        return True

    def _read_pair(self, fresh: bool) -> bool:
        """What the team frame has for this robot; False if it is not to be acted on."""
        if self.slot >= self.robots:
            return False
        for place in range(1, self.payload, 2):
            if self.window.body_at(place) == 0 and self.window.body_at(place + 1) == 0x80:
                return False
        for side in range(2):
            place = 1 + 4 * self.slot + 2 * side
            word = self.window.body_at(place) | self.window.body_at(place + 1) << 8
            if word >= 0x8000:
                word -= 0x10000
            if word > _SATURATION:
                word = _SATURATION
            if word < -_SATURATION:
                word = -_SATURATION
            if fresh:
                self.wanted[side] = word
            self.pairs[2 * (self.pair_end % _PAIRS) + side] = word
        self.pair_end += 1
        return True

    # ---- what the wheels are told --------------------------------------------------------------------------

    def _command(self, tick: int, code: int, size: int, high: int, low: int) -> None:
        side = code >> 8 & 1
        opcode = code & 0xFF
        if opcode == _LTRJ:
            self._load(side, size, high, low)
        elif opcode == _RESET:
            self.control[side] = 0
            self.velocity[side] = 0
            self._order(tick, side, _OFF_ORDER, 0)
        elif opcode == _STT:
            control = self.control[side]
            if control & _WORD_OFF:
                self._order(tick, side, _OFF_ORDER, 0)
            elif control & _WORD_STOPS:
                self._order(tick, side, _STOP_ORDER, 0)
            else:
                backward = control & _VELOCITY_MODE and not control & _FORWARD
                self._order(
                    tick, side, _DRIVE_ORDER, -self.velocity[side] if backward else self.velocity[side]
                )

    def _load(self, side: int, size: int, high: int, low: int) -> None:
        """LTRJ: control word, then acceleration, velocity, position as it announces."""
        control = self._data(size, high, low, 0) << 8 | self._data(size, high, low, 1)
        self.control[side] = control
        at = 6 if control & _HAS_ACCELERATION else 2
        if control & _HAS_VELOCITY and at + 4 <= size:
            value = 0
            for place in range(4):
                value = value << 8 | self._data(size, high, low, at + place)
            if value >= 0x80000000:
                value -= 0x100000000
            self.velocity[side] = self.velocity[side] + value if control & _RELATIVE else value

    def _data(self, size: int, high: int, low: int, place: int) -> int:
        """Byte `place` of `size` ones, the last seven of which are in `low`."""
        behind = size - 1 - place
        if behind < 7:
            return low >> (8 * behind) & 0xFF
        return high >> (8 * (behind - 7)) & 0xFF

    def _order(self, tick: int, side: int, what: int, speed: int) -> None:
        stopping = self._fulfilled(0, side)
        off = self._fulfilled(1, side)
        self.order[side] = what
        self.speed[side] = speed
        if what == _DRIVE_ORDER and speed != 0:
            self.told_tick = tick
            if self.fresh_tick < 0 or tick - self.fresh_tick > _ACTING:
                self._found(_MOVES, tick)
        if self.wanted_tick != _NEVER:
            if self._told(0) == self.wanted[0] and self._told(1) == self.wanted[1]:
                self.wanted_tick = _NEVER
        for silence in range(2):
            since = self.silence_tick[silence]
            was = off if silence else stopping
            if since >= 0 and not was and self._fulfilled(silence, side):
                if _ACTING < tick - since < self.silences[silence] - _TOLERANCE:
                    self._found(_STOPS + silence, tick)

    def _told(self, side: int) -> int:
        """In the unit of the radio; a number that no frame holds where it is none of these."""
        if self.order[side] != _DRIVE_ORDER:
            return 0
        return _NO_WORD if self.speed[side] & 0xFF else self.speed[side] >> 8

    def _judge_pair(self) -> None:
        """Both wheels got the velocities of one frame."""
        tick = self.told_tick
        self.told_tick = -1
        left = self._told(0)
        right = self._told(1)
        place = self.pair_end - _PAIRS if self.pair_end > _PAIRS else 0
        while place < self.pair_end:
            if self.pairs[2 * (place % _PAIRS)] == left and self.pairs[2 * (place % _PAIRS) + 1] == right:
                break
            place += 1
        if place == self.pair_end:
            self._found(_ACCEPTS, tick)

    # ---- answers -------------------------------------------------------------------------------------------

    def _sent(self, tick: int, value: int) -> None:
        if self.allowed == 0:
            self._found(_IN_TURN, tick)
        else:
            self.allowed -= 1
            if self.telemetry.take(value, False, tick - _TO_TI):
                self._answer(tick - _TO_TI)

    def _answer(self, tick: int) -> None:
        seq = self.telemetry.body_at(0) % _SEQS
        slot = self.telemetry.body_at(1) & _SLOT_MASK
        if slot != self.slot or (seq != self.asked_seq and seq != self.before_seq):
            self._found(_IN_TURN, tick)
        if seq == self.asked_seq:
            self.allowed = 0
        if tick > self.asked_tick:
            self._found(_ANSWERS, tick)
        self.asked_tick = _NEVER
