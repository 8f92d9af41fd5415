cimport cython
from miro_host.eye.regions cimport Regions

cdef int _MARGIN, _LEAST, _MOST, _SHIFT


@cython.final
cdef class Unmixing:
    cdef int gain_cb[2]
    cdef int gain_cr[2]
    cdef readonly int out_weight[2]
    cdef readonly int out_u[2]
    cdef readonly int out_v[2]
    cdef int rival[64]
    cdef int rivals

    cpdef tuple shares(self, int cb, int cr)
    @cython.locals(weight=int)
    cdef int share(self, int which, int cb, int cr) noexcept
    @cython.locals(index=int)
    cpdef centroids(self, bytearray pixels, Regions regions, int team, int identity, int rival_area)
    @cython.locals(total=int, total_u=int, total_v=int, left=int, right=int, row=int, column=int, at=int, weight=int)
    cdef void weigh(self, int which, bytearray pixels, Regions regions, int index) noexcept
    @cython.locals(own=int, place=int)
    cdef bint nearest(self, Regions regions, int index, int column, int row) noexcept
    @cython.locals(along=int, down=int)
    cdef int distance(self, Regions regions, int index, int column, int row) noexcept
