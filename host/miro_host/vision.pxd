# C layout of miro_host.vision.
from miro_exact cimport dmath

cdef double _SIGMAS

cpdef double error_of(double normal, double bound) except? -7.5
cpdef double to_grid(double x, double step) except? -7.5
cpdef measure(true, tuple normals, errors)


cdef class Vision:
    cdef readonly object errors, under_way
    cdef readonly int delay_frames

    cpdef frame(self, true, tuple normals)
