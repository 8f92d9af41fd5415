cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _COAST, _BRAKE, _FORWARD, _BACKWARD, _EN_A, _EN_B, _OUT_1, _OUT_3, _ALL, RELEASED

cdef class Channel:
    cdef readonly long long longest_ticks
    cdef public int direction, steady
    cdef public long long edge_tick, driven_ticks, last_ticks, last_driven, still_tick
    cdef public long long begun_ticks[2]
    cdef public long long begun_driven[2]

    cpdef settle(self, int direction)
    @cython.locals(wait='long long')
    cdef void turn(self, int direction, long long tick) noexcept
    cdef void _begin_period(self, int way, long long tick) noexcept
    cpdef double duty(self) except? -1

cdef class L298Part(Part):
    cdef public int is_on
    cdef readonly list channels
    cdef int modes[16]

    @cython.locals(channel=int)
    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(mode=int, direction=int, bridge=Channel, number=int, level=int)
    cdef int _follow(self, int channel, long long tick) except -1
    @cython.locals(inputs=int, number=int)
    cdef int _mode(self, int channel) noexcept
    @cython.locals(channel=int, bridge=Channel)
    cpdef due(self, long long tick)
    @cython.locals(a=Channel, b=Channel)
    cdef void _plan(self, long long latest) noexcept
