cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int LOW, RELEASED, _SCL, _SDA, _SCL_BIT, _SDA_BIT, _IDLE, _ADDRESS, _RECEIVES, _SENDS


cdef class I2cTarget(Part):
    cdef readonly int low_ticks, high_ticks
    cdef public int powered, phase, bits, byte
    cdef public long long hold_tick, wake_tick, clock_tick, short_clocks

    cpdef int addressed(self, int byte, long long tick) except -1
    cpdef int received(self, int byte, long long tick) except -1
    cpdef int transmit(self, long long tick) except -1
    cpdef ended(self, long long tick)
    cpdef woken(self, long long tick)
    cpdef hold(self, long long until_tick)
    cpdef wake(self, long long tick)
    @cython.locals(is_high=int, least=int, is_whole=bint)
    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(is_one=int)
    cdef int _rose(self) except -1
    cdef int _fell(self, long long tick) except -1
    cdef int _acknowledge(self, long long tick) except -1
    cdef int _next_byte(self, long long tick) except -1
    cdef int _put_bit(self) except -1
