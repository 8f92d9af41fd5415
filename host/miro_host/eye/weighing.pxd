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

    cpdef tuple weights(self, int cb, int cr)
    @cython.locals(weight=int)
    cdef int weight(self, int which, int cb, int cr) noexcept
    @cython.locals(index=int)
    cpdef centroids(self, bytearray pixels, Regions regions, int team, int identity, int rival_area)
    cdef void place(self, int rival, Regions regions, int index) noexcept
    @cython.locals(total=int, total_u=int, total_v=int, own_u=int, own_v=int, left=int, right=int, top=int, bottom=int,
                   data='unsigned char *', row=int, column=int, at=int, weight=int, u=int, v=int)
    cdef void weigh(self, int which, bytearray pixels, Regions regions, int index) noexcept
    @cython.locals(rival=int, along=int, down=int)
    cdef bint nearest(self, int u, int v, int own) noexcept
    cpdef (double, double) centroid(self, int which)
