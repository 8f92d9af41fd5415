cimport cython
from libc cimport math
from miro_exact.dmath cimport wrap_pi

cdef double TICKS_PER_SECOND, MOST_SPEED_M_S, REACH_M, LONGEST_GAP_S, LONGEST_AHEAD_S


@cython.final
cdef class Track:
    cdef public long long seen, tick, before_tick
    cdef public double x_m, y_m, theta_rad, before_x_m, before_y_m, before_theta_rad

    @cython.locals(tick='long long')
    cpdef remember(self, sighting)
    cdef double unseen_s(self, long long tick) noexcept
    cdef double reach_m(self, long long tick) noexcept
    cpdef (double, double, double) predicted(self, long long tick)
