cimport cython

cdef double _PER_TURN

cpdef nearest(double x)
cdef double _units_per_m_s(double radius_m) except? -1.0
@cython.locals(step=int)
cdef _counts(double speed_m_s, double limit_m_s, double units_per_m_s, int word_bits)
@cython.locals(limit_m_s=double, half=double, bits=int)
cpdef wheel_command(wheels, double v_m_s, double w_rad_s, double left_factor=*, double right_factor=*)
