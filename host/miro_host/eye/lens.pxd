cimport cython
from libc cimport math

cdef int _STEPS


@cython.final
cdef class Lens:
    cdef readonly object parameters
    cdef readonly double x_m, y_m, height_m, focal_u, focal_v, centre_u, centre_v, k1
    cdef readonly double xa, xb, xc, ya, yb, yc, za, zb, zc, out_x, out_y

    cpdef slopes(self, double u, double v)
    cpdef (double, double) ground(self, double u, double v, double z_m)
    cpdef (double, double) pixel(self, double x_m, double y_m, double z_m)
