# C types of miro_host.laws.yang_kim.
cimport cython
from miro_exact cimport dmath

cpdef double sign(double x) noexcept
cpdef double saturation(double x, double width) except? -7.5
cpdef double curvature_term(double v, double w, double rho, double sin_alpha) except? -7.5
cdef double _switch(double x, double width, bint smooth) except? -7.5
cpdef double guarded_inverse(double cos_alpha, double d) except? -7.5
@cython.locals(
    x=double, y=double, theta=double, rho=double, phi=double, sin_alpha=double, cos_alpha=double, rho_floor=double,
    rho_e=double, phi_e=double, theta_e=double, rho_e_rate=double, phi_e_rate=double, theta_e_rate=double,
    abs_phi_e_rate=double, side=double, s1=double, s2=double, braces=double, u1=double, u2=double, layer=double,
    smooth=cython.bint, gamma1=double, gamma2=double, v_dot=double,
)
cdef _control(g, r, measured, double v_m_s, double w_rad_s)
