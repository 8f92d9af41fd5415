cimport cython
from libc cimport math
from miro_exact cimport dmath
from miro_exact.rng cimport Stream

cdef double _SIGMAS

cpdef double error_of(double normal, double bound) except? -7.5
cpdef double to_grid(double x, double step) except? -7.5
cpdef measure(true, tuple normals, errors)
@cython.locals(position_m=double, pixel_m=double)
cdef _measured(double x_m, double y_m, double theta_rad, double right, double up, double turn, errors)


cdef class Vision:
    cdef readonly object errors, under_way
    cdef readonly int delay_frames

    @cython.locals(x_m=double, y_m=double, theta_rad=double)
    cpdef expose(self, tuple true, Stream noise, long long frame)
    cpdef frame(self, true, tuple normals)
