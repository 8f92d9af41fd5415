cimport cython
from miro_exact cimport dmath

cdef double TICK_S, _ANGLES
cdef int SWEEPS

cdef class Body:
    cdef readonly double left_m_rad, right_m_rad, track_m, friction_nm
    cdef readonly double mass_ll, mass_lr, mass_rr, inverse_ll, inverse_lr, inverse_rr
    cdef public double left_rad_s, right_rad_s, x_m, y_m, theta_rad, left_brake_nm, right_brake_nm
    cdef readonly double turned_left_rad[16], turned_right_rad[16]

    cdef int _push(self, double left_nms, double right_nms, int ticks, int step) except -1
    @cython.final
    cdef inline void _slide(self, double left, double right, double most_left, double most_right) noexcept
    @cython.final
    cdef void _rub(self, double left, double right, double most_left, double most_right) noexcept
    cdef int _roll(self, int steps) except -1
    @cython.locals(v=double, w=double, half=double)
    cpdef tuple pose_after(self, long long ticks)
    cpdef tuple velocity(self)
