cimport cython
from miro_host.eye.regions cimport Regions

cdef int _MARGIN, _MOST, _SHIFT, _RIVALS


@cython.final
cdef class Weighing:
    cdef int gain_cb[2]
    cdef int gain_cr[2]
    cdef int least[2]
    cdef readonly int out_weight[2]
    cdef readonly int out_u[2]
    cdef readonly int out_v[2]
    cdef int rival_u[64]
    cdef int rival_v[64]
    cdef int rivals

    cpdef int weight(self, int which, int cb, int cr) noexcept
    cpdef centroids(self, bytearray pixels, Regions regions, int team, int identity, int rival_area)
    cdef void place(self, int rival, Regions regions, int index) noexcept
    @cython.locals(data='unsigned char *')
    cdef void weigh(self, int which, bytearray pixels, Regions regions, int index) noexcept
    cdef bint nearest(self, int u, int v, int own) noexcept
    cpdef (double, double) centroid(self, int which)
