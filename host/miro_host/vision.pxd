# C layout of miro_host.vision.
cimport cython
from libc cimport math
from miro_exact cimport dmath

cdef double _SIGMAS

cpdef double error_of(double normal, double bound) except? -7.5
@cython.locals(cells=double)
cpdef double to_grid(double x, double step) except? -7.5
@cython.locals(
    position_m=double, pixel_m=double, x_m=double, y_m=double, theta_rad=double, right=double, up=double, turn=double
)
cpdef measure(true, tuple normals, errors)


cdef class Vision:
    cdef readonly object errors, under_way
    cdef readonly int delay_frames

    cpdef frame(self, true, tuple normals)
