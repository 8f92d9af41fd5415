cpdef double clamp(double x, double limit) noexcept
cdef double _near(double before, double wanted, double most) noexcept


cdef class Integrator:
    cdef readonly object limits
    cdef readonly double period_s
    cdef public double v_m_s, w_rad_s

    cpdef step(self, double v_dot_m_s2, double w_dot_rad_s2)
    cpdef go_to(self, double v_m_s, double w_rad_s)


cdef class AdamsBashforth(Integrator):
    cdef public double last_v_dot, last_w_dot
    cdef public int begun

