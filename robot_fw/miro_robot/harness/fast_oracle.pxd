cimport cython

from miro_protocol.robot_rules cimport AnswerRule, DrivingRule, OriginRule, SilenceRule
from miro_protocol.decoder cimport Scanner
from miro_robot.board cimport Board
from miro_robot.event_log cimport EventLog
from miro_robot.harness.harness cimport LiveOracle
from miro_robot.lm629.orders cimport WheelOrder

cdef int _NO_FAULT, _LM629, _MOVES, _ACCEPTS, _ACTS, _STOPS, _OFF, _IN_TURN, _ANSWERS
cdef long long ACTING_TICKS, EDGE_TICKS, FRESH_AGAIN_TICKS, NEVER_TICK, TO_RI_TICKS, TO_TI_TICKS
cdef int FRESH_STEPS, VELOCITY_SATURATION, _TEAM, _ASK, SEQ_MODULUS, SLOT_MASK
cdef int RECEIVED, SENT, COMMAND, FAULT, COMMAND_ERROR


cdef class FastOracle(LiveOracle):
    cdef Board board
    cdef EventLog log
    cdef int slot, robots, payload
    cdef Scanner window, telemetry
    cdef object freshness
    cdef WheelOrder left_order, right_order
    cdef DrivingRule driving
    cdef OriginRule origin
    cdef AnswerRule answers
    cdef SilenceRule stop, off
    cdef long long read, up_tick, fresh_tick, told_tick
    cdef int decided, fresh_seq, left, right
    cdef readonly int pc, accepted

    cdef int _forget(self) except -1
    cdef void _found(self, int code, long long tick) noexcept
    cdef int _pass(self, long long tick) except -1
    cdef int _pass_silence(self, int code, SilenceRule silence, long long tick) except -1
    cdef bint _is_over(self, int code, WheelOrder order) except -1
    cdef int _received(self, long long tick, int good_stop, int value) except -1
    @cython.locals(fresh=bint)
    cdef int _frame(self, long long tick) except -1
    cdef void _ask_whether_decided(self, int seq, long long tick) noexcept
    cdef bint _stops_already(self) except -1
    cdef bint _read_pair(self) noexcept
    cdef int _word(self, int place) noexcept
    @cython.locals(driven=bint)
    cdef int _command(self, long long tick, int code, bytes data) except -1
    cdef int _sent(self, long long tick, int value) except -1
