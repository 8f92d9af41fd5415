cimport cython
from libc cimport math
from miro_exact cimport dmath
from miro_exact.rng cimport Stream

cdef double _SIGMAS

cpdef double error_of(double normal, double bound) except? -7.5
cpdef double to_grid(double x, double step) except? -7.5
@cython.locals(position_m=double, pixel_m=double)
cpdef measure(true, tuple normals, errors)


cdef class Vision:
    cdef readonly object errors, under_way
    cdef readonly int delay_frames

    cpdef expose(self, tuple true, Stream noise, long long frame)
