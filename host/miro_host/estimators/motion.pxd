cimport cython
from miro_exact cimport dmath

cdef int _KEPT


@cython.final
cdef class Motion:
    cdef public double left_start_m_s[16], left_to_m_s[16], right_start_m_s[16], right_to_m_s[16]
    cdef readonly double track_m, slope_m_s2, doubt
    cdef readonly double x_m, y_m, theta_rad, left_m, right_m, left_m2, right_m2
    cdef readonly double x_by_theta, x_by_left, x_by_right, y_by_theta, y_by_left, y_by_right
    cdef readonly double theta_by_left, theta_by_right

    cpdef remember(self, double left_m_s, double right_m_s, double period_s)
    cdef double speed(self, double start_m_s, double to_m_s, double time_s) noexcept
    cpdef begin(self, double x_m, double y_m, double theta_rad)
    @cython.locals(index=int)
    cpdef run(self, double from_s, double to_s, double effect_s, double period_s, double left_factor,
              double right_factor)
    cdef int hold(self, int index, double begin_s, double end_s, double left_factor, double right_factor) except -1
    cdef int arc(self, double left_m, double right_m, double left_factor, double right_factor) except -1
