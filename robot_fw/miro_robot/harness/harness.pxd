cimport cython

from miro_robot.board cimport Board
from miro_robot.event_log cimport EventLog
from miro_robot.harness.program cimport Program
from miro_robot.mcs51.cpu cimport Cpu

cdef long long _LEAD, _SETTLE, _AWAKE_TICKS, _AHEAD, RESET_TICKS, _LOOK, _WAIT
cdef int _DONE, _STOPPED, _AWAKE, _BURST, _BAD_STOP, _RESET

cdef bytes _OPENING


cdef class LiveOracle:
    cdef public int code
    cdef public long long tick

    cpdef begin(self, long long tick)
    cpdef restarted(self, long long tick)
    cpdef look(self, long long tick)
    cpdef bint waits(self) except -1


cdef class Moment:
    cdef Cpu cpu
    cdef EventLog log
    cdef long long tick
    cdef object flat
    cdef bytes state
    cdef list events
    cdef int[::1] passed
    cdef int edge_before, edge_depth, highest_sp
    cdef int edge_outer[8]

    cdef int keep(self, long long tick, long long begun, bytes edges) except -1
    cdef int put(self) except -1
    cdef int tell(self) except -1


cdef class Harness:
    cdef readonly object machine
    cdef readonly Board board
    cdef readonly object device
    cdef readonly Cpu cpu
    cdef readonly LiveOracle oracle
    cdef readonly long long bit_ticks, begin_tick, now_tick, end_tick, after_ticks
    cdef readonly int sleeps
    cdef int puts
    cdef Moment _start, _opening
    cdef int _opening_mask

    cpdef back(self)
    cdef int _put(self, Moment moment) except -1
    cdef int _begin(self, Program program) except -1
    cdef bint _opens(self, Board board, Program program) except -1
    cdef int _open(self, EventLog log) except -1
    cpdef int play(self, Program program) except -1
    @cython.locals(number=int, tick='long long')
    cdef int _put_values(self, Program program, int place) except -1
    cdef int _character(self, int value, int bad_stop, long long tick) except -1
    cdef int _reset(self, long long tick) except -1
    cdef int _set_reset(self, int level) except -1
    cdef int _move(self, long long until) except -1
    cdef int _go_on(self, long long until) except -1
    cdef int _run(self, long long until) except -1
    @cython.locals(faulted=bint)
    cdef int _settle(self, long long tick) except -1
    cdef bint _falls_asleep(self, long long until) except -1
