cimport cython

from miro_protocol.scan cimport Scanner
from miro_robot.board cimport Board
from miro_robot.event_log cimport EventLog
from miro_robot.harness.oracle cimport LiveOracle

cdef int _NO_FAULT, _LM629, _MOVES, _ACCEPTS, _ACTS, _STOPS, _OFF, _IN_TURN, _ANSWERS
cdef long long _ACTING, _ANSWER, _TOLERANCE, _TESTING, _NEVER, _CHARACTER, _TO_RI, _TO_TI
cdef long long _EDGE, _FRESH_AGAIN
cdef int _FRESH_STEPS
cdef int _SATURATION, _TEAM, _ASK, _SEQS, _SLOT_MASK, _ANSWER_SIZE
cdef int _RECEIVED, _SENT, _COMMAND, _FAULT
cdef int _RESET, _STT, _LTRJ, _COMMAND_ERROR
cdef int _WORD_OFF, _WORD_STOPS, _VELOCITY_MODE, _FORWARD, _HAS_ACCELERATION, _HAS_VELOCITY, _RELATIVE
cdef int _OFF_ORDER, _STOP_ORDER, _DRIVE_ORDER, _NO_WORD, _PAIRS


cdef class FastOracle(LiveOracle):
    cdef Board board
    cdef EventLog log
    cdef int slot, robots, payload
    cdef Scanner window, telemetry
    cdef object freshness
    cdef long long read
    cdef int decided
    cdef long long up_tick
    cdef int fresh_seq
    cdef readonly int pc
    cdef readonly int accepted
    cdef int control[2]
    cdef long long velocity[2]
    cdef int order[2]
    cdef long long speed[2]
    cdef long long fresh_tick, heard_tick, told_tick, wanted_tick
    cdef long long wanted[2]
    cdef long long pairs[128]
    cdef int pair_end
    cdef long long silence_tick[2]
    cdef long long silences[2]
    cdef long long asked_tick
    cdef int asked_seq, before_seq, allowed

    cpdef begin(self, long long tick)
    @cython.locals(side=int)
    cdef int _forget(self) except -1
    cpdef restarted(self, long long tick)
    cpdef bint waits(self) except -1
    @cython.locals(log=EventLog, place=int, at='long long', kind=int, word=int)
    cpdef look(self, long long tick)
    cdef void _found(self, int code, long long tick) noexcept
    cdef void _fault(self, long long tick, int kind, int pc) noexcept
    @cython.locals(what=int)
    cdef void _pass(self, long long tick) noexcept
    @cython.locals(latest='long long', due='long long')
    cdef void _pass_silence(self, int what, long long tick) noexcept
    @cython.locals(since='long long')
    cdef bint _is_over(self, int what, long long tick) noexcept
    cdef bint _fulfilled(self, int what, int side) noexcept
    cdef int _received(self, long long tick, int good_stop, int value) except -1
    @cython.locals(hdr=int, kind=int, seq=int, fresh=bint, team=bint)
    cdef int _frame(self, long long tick) except -1
    @cython.locals(since='long long', step=int)
    cdef void _ask_whether_decided(self, int seq, long long tick) noexcept
    @cython.locals(side=int)
    cdef bint _stops_already(self) noexcept
    @cython.locals(place=int, side=int, word=int)
    cdef bint _read_pair(self, bint fresh) noexcept
    @cython.locals(side=int, opcode=int, control=int, backward=bint)
    cdef void _command(self, long long tick, int code, int size, long long high, long long low) noexcept
    @cython.locals(control=int, at=int, value='long long', place=int)
    cdef void _load(self, int side, int size, long long high, long long low) noexcept
    @cython.locals(behind=int)
    cdef int _data(self, int size, long long high, long long low, int place) noexcept
    @cython.locals(stopping=bint, off=bint, silence=int, since='long long', was=bint)
    cdef void _order(self, long long tick, int side, int what, long long speed) noexcept
    cdef long long _told(self, int side) noexcept
    @cython.locals(tick='long long', left='long long', right='long long', place=int)
    cdef void _judge_pair(self) noexcept
    cdef int _sent(self, long long tick, int value) except -1
    @cython.locals(seq=int, slot=int)
    cdef int _answer(self, long long tick) except -1
