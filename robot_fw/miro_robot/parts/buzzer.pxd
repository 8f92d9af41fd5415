cimport cython
from miro_robot.parts.part cimport Part

cdef int _SLOWEST_HZ

cdef class BuzzerPart(Part):
    cdef readonly int is_passive, flow_level
    cdef readonly long long longest_ticks
    cdef public int flows, has_flowed
    cdef public long long flowed_tick, period_ticks, sounded_ticks

    @cython.locals(flows=int, period_ticks='long long')
    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(since='long long')
    cpdef long long _since(self, long long tick) noexcept
