cimport cython
from miro_exact cimport dmath

cpdef double sign(double x) noexcept
cpdef double saturation(double x, double width) except? -7.5
cpdef double curvature_term(double v, double w, double rho, double sin_alpha) except? -7.5
cpdef double guarded_inverse(double cos_alpha, double d) except? -7.5


cdef class YangKimControl:
    cdef double gamma1, gamma2, q1, q2, p1, p2, layer_s1, layer_s2, layer_theta, cosine_guard, rho_floor
    cdef bint smooth, layer_derivative
    cdef readonly double rho_e_m, phi_e_rad, theta_e_rad, s1, s2, u1, u2

    @cython.locals(x=double, y=double, theta=double, rho=double, rho_floor=double, rho_e=double, rho_e_rate=double,
                   phi_e_rate=double, theta_e_rate=double, abs_phi_e_rate=double, s1=double, s2=double, braces=double,
                   u1=double, u2=double, rho_r=double, phi_r=double, theta_r=double, rho_r_rate=double,
                   phi_r_rate=double, w_r=double, v_r_dot=double, rho_r_accel=double)
    cpdef int work_out(self, r, measured, double v_m_s, double w_rad_s) except -1
    cdef double _switch(self, double x, double width) except? -7.5
