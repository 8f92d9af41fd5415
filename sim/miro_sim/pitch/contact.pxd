cimport cython
from libc cimport math
from miro_exact.dmath cimport sincos

cdef double ROBOT_HALF_M, CIRCLE_M
cdef long long NEVER_TICK, TICKS_PER_SECOND, _GRID_TICKS

@cython.locals(dx=double, dy=double)
cpdef bint touch(tuple first, tuple other) except -1
cdef bint _apart(double dx, double dy, double theta_rad, double reach) except -1
@cython.locals(dx=double, dy=double, wait='long long')
cpdef long long next_look(long long tick, tuple first, tuple other, double closing_m_s) except -1
