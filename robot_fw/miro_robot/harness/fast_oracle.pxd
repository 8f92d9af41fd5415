cimport cython

from miro_protocol.robot_rules cimport AnswerRule, DrivingRule, OriginRule, SilenceRule
from miro_protocol.scan cimport Scanner
from miro_robot.board cimport Board
from miro_robot.event_log cimport EventLog
from miro_robot.harness.harness cimport LiveOracle
from miro_robot.lm629.orders cimport WheelOrders

cdef int _NO_FAULT, _LM629, _MOVES, _ACCEPTS, _ACTS, _STOPS, _OFF, _IN_TURN, _ANSWERS
cdef long long _ACTING, _EDGE, _FRESH_AGAIN, _NEVER, _TO_RI, _TO_TI
cdef int _FRESH_STEPS, _SATURATION, _TEAM, _ASK, _SEQS, _SLOT_MASK
cdef int _RECEIVED, _SENT, _COMMAND, _FAULT, _COMMAND_ERROR, _OFF_ORDER


cdef class FastOracle(LiveOracle):
    cdef Board board
    cdef EventLog log
    cdef int slot, robots, payload
    cdef Scanner window, telemetry
    cdef object freshness
    cdef WheelOrders orders
    cdef DrivingRule driving
    cdef OriginRule origin
    cdef AnswerRule answers
    cdef SilenceRule stop, off
    cdef long long read, up_tick, fresh_tick, told_tick
    cdef int decided, fresh_seq, left, right
    cdef readonly int pc
    cdef readonly int accepted

    cpdef begin(self, long long tick)
    cdef int _forget(self) except -1
    cpdef restarted(self, long long tick)
    cpdef bint waits(self) except -1
    @cython.locals(log=EventLog, place=int, at='long long', kind=int, word=int)
    cpdef look(self, long long tick)
    cdef void _found(self, int code, long long tick) noexcept
    cdef void _fault(self, long long tick, int kind, int pc) noexcept
    @cython.locals(missed='long long')
    cdef int _pass(self, long long tick) except -1
    cdef void _pass_silence(self, int code, SilenceRule silence, long long tick) noexcept
    cdef bint _is_over(self, int code, int side) noexcept
    cdef int _received(self, long long tick, int good_stop, int value) except -1
    @cython.locals(hdr=int, kind=int, seq=int, fresh=bint, team=bint)
    cdef int _frame(self, long long tick) except -1
    @cython.locals(since='long long', step=int)
    cdef void _ask_whether_decided(self, int seq, long long tick) noexcept
    @cython.locals(side=int)
    cdef bint _stops_already(self) noexcept
    @cython.locals(place=int)
    cdef bint _read_pair(self) noexcept
    @cython.locals(word=int)
    cdef int _word(self, int place) noexcept
    @cython.locals(side=int, moved=bint, driven=bint)
    cdef int _command(self, long long tick, int code, int size, long long high, long long low) except -1
    cdef int _order(self, long long tick, int side, bint moved, bint driven) except -1
    cdef int _sent(self, long long tick, int value) except -1
    @cython.locals(seq=int, slot=int)
    cdef int _answer(self, long long tick) except -1
