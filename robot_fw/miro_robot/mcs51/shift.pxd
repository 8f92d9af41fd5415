cimport cython

from miro_robot.mcs51.line cimport Line
from miro_robot.mcs51.uart cimport Uart

cdef int _REN, _TI, _RI, _SAMPLE, _CLOCK_FALLS, _CLOCK_RISES
cdef long long NEVER_TICK

@cython.final
cdef class Shift:
    cdef Uart uart
    cdef readonly Line data
    cdef readonly int flag
    cdef int value, number
    cdef long long cycle

    cpdef int check_times(self, long long cycle) except -1
    cdef void send(self, int value, long long cycle) noexcept
    cdef void begin_reception(self, long long cycle) noexcept
    cdef void _begin(self, int flag, int value, long long cycle) noexcept
    cdef int sync(self, long long tick) except -1
    cdef int _bit(self, long long tick) except -1
    cdef int _finish(self) except -1
    cdef int abort(self, long long tick) except -1
    @cython.locals(since='long long', clock=int)
    cpdef int levels_at(self, long long tick) noexcept
    @cython.locals(first='long long', phase='long long')
    cpdef long long edge_after(self, long long tick) noexcept
    cpdef long long flag_tick(self) noexcept
