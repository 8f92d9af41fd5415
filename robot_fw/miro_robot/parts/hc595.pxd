cimport cython
from miro_robot.parts.part cimport Part

cdef int _SER, _SRCLK, _RCLK, _OE, _SRCLR, _Q0, _Q7S, RELEASED

cdef class Hc595Part(Part):
    cdef public int outputs, shifted
    cdef public long long stores, late_bits

    @cython.locals(rises='unsigned int')
    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(is_off=int, bit=int)
    cdef _show(self)
