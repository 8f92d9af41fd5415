cimport cython
from miro_exact cimport dmath
from miro_exact.rng cimport Stream

cdef double TURN, TICKS_PER_S

@cython.final
cdef class DisturbingForce:
    cdef readonly Stream stream
    cdef readonly long long period_ticks
    cdef readonly double constant_n, constant_nm, sine_n, sine_nm, noise_n, noise_nm
    cdef readonly bint is_on, varies
    cdef readonly double force_n, torque_nm

    cpdef void at(self, long long tick) except *
