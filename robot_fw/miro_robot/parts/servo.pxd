cimport cython
from miro_robot.parts.part cimport Part

cdef double _HOLD_US

cdef class ServoPart(Part):
    cdef readonly long long shortest_ticks, longest_ticks, hold_ticks
    cdef readonly double low_us, deg_per_us, range_deg, deg_per_tick, way
    cdef public int is_high, has_risen
    cdef public long long rise_tick, pulse_ticks, frame_ticks, from_tick
    cdef public double angle_deg, target_deg

    cpdef double turned_deg(self, long long tick) noexcept
    @cython.locals(us=double)
    cdef _aim(self, long long tick)
    @cython.locals(reach=double)
    cdef double _angle(self, long long tick) noexcept
