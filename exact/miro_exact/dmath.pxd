# C types of miro_exact.dmath.
cimport cython
from libc cimport math

cdef double _INV_PIO2, _PIO2_1, _PIO2_1T, _PIO2_2, _PIO2_2T, _PIO2_3, _PIO2_3T, _TWO_PI_1, _TWO_PI_2
cdef double _TWO_PI_2T, _S1, _S2, _S3, _S4, _S5, _S6, _C1, _C2, _C3, _C4, _C5, _C6, _A0, _A1, _A2, _A3, _A4
cdef double _A5, _A6, _A7, _A8, _A9, _A10, _PI_LO, _LN2_HI, _LN2_LO, _INV_LN2, _E1, _E2, _E3, _E4, _E5
cdef double _EXP_MAX, _EXP_MIN, _L1, _L2, _L3, _L4, _L5, _L6, _L7, _SQRT2, _LARGEST, _PI, _LIMIT

cpdef double sin(double x) except? -7.5
cpdef double cos(double x) except? -7.5
cpdef (double, double) sincos(double x)
@cython.locals(n=cython.longlong, quadrant=cython.int)
cdef (double, double) sincos_within(double x) noexcept
cpdef double atan(double x) except? -7.5
cdef double _atan(double a, double more, bint supplement) except? -7.5
cdef double _lost(double q, double y, double x) except? -7.5
cpdef double atan2(double y, double x) except? -7.5
cpdef double wrap_pi(double x) except? -7.5
cpdef double exp(double x) except? -7.5
@cython.locals(k=cython.int)
cdef double exp_within(double x) noexcept
cdef double _scaled(double y, int k) noexcept
cpdef double log(double x) except? -7.5
cdef double log_within(double x) noexcept
