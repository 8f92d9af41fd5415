cimport cython

from miro_robot.board cimport Board
from miro_robot.harness.oracle cimport LiveOracle
from miro_robot.harness.program cimport Program
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.line cimport Line

cdef long long _LEAD, _SETTLE, _AWAKE_TICKS, _AHEAD, _RESET_TICKS, _LOOK, _WAIT
cdef int _DONE, _STOPPED, _AWAKE, _BURST, _BAD_STOP, _RESET


cdef class Harness:
    cdef readonly object machine
    cdef readonly Board board
    cdef readonly Cpu cpu
    cdef readonly LiveOracle oracle
    cdef readonly long long bit_ticks, begin_tick, now_tick, end_tick
    cdef readonly int sleeps
    cdef object _flat
    cdef bytes _state

    cpdef back(self)
    cdef int _forget_records(self, Board board) except -1
    @cython.locals(tick='long long', pause='long long', place=int, flaws=int, waiting=int)
    cpdef int play(self, Program program) except -1
    @cython.locals(bit='long long', levels=int, place=int, rxd=Line)
    cdef int _character(self, int value, int bad_stop, long long tick) except -1
    cdef int _reset(self, long long tick) except -1
    cdef int _set_reset(self, int level) except -1
    cdef int _move(self, long long until) except -1
    @cython.locals(stopped=int)
    cdef int _run(self, long long until) except -1
    @cython.locals(latest='long long')
    cdef int _settle(self, long long tick) except -1
    cdef bint _falls_asleep(self, long long until) except -1
    cdef bint _faulted(self) noexcept
