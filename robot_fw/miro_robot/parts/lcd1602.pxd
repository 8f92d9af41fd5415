cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int RELEASED, _RS, _SELECT, _RW, _E, _DATA, _D0, _D7


cdef class Lcd1602Part(Part):
    cdef readonly int rows, columns
    cdef readonly long long reset_ticks, short_ticks, long_ticks, count_ticks
    cdef readonly long long width_ticks, cycle_ticks, select_ticks, data_ticks
    cdef public int powered, entry, display, function, in_cgram, address, old_address, shift, data, upper, half
    cdef public long long busy_tick, count_tick, rise_tick, select_tick, data_tick, lost, short_pulses
    cdef public unsigned char ddram[128]
    cdef public unsigned char cgram[64]

    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(pin=int, first=int, value=int)
    cdef _answer(self, long long tick)
    @cython.locals(late=bint)
    cdef int _rose(self, unsigned int pins, long long tick) except -1
    @cython.locals(before='unsigned int', byte=int, is_read=bint, late=bint)
    cdef _fell(self, unsigned int pins, long long tick)
    @cython.locals(step=int, place=int)
    cdef int _execute(self, int byte, long long tick) except -1
    cdef int _go_to(self, int in_cgram, int address) except -1
    cdef int _load(self) except -1
    cdef int _store(self, int byte) except -1
    cdef int _count(self, long long tick) except -1
    @cython.locals(last=int)
    cdef int _next(self, int step) noexcept
    cdef inline int _line(self) noexcept
    cdef int _scroll(self, int step) except -1
