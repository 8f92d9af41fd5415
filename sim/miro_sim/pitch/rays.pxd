cimport cython
from miro_host.eye cimport lens

cdef int _WIDTH, _HEIGHT, _CORNERS, _MARGIN_SPARE_UM
cdef long long _TOP_UM, _HALF_UM, _MOST


cpdef bint enters(long long u, long long v, long long fall_u, long long fall_v) noexcept
cpdef long long entry(long long u, long long v, long long fall_u, long long fall_v) noexcept


@cython.final
cdef class Rays:
    cdef int[::1] slope_x, slope_y, top_x, top_y, middle_x, middle_y, fall_x, fall_y
    cdef readonly long long x_um, y_um, height_um, spread_um, stride_um

    @cython.locals(x='long long', y='long long')
    cdef _cast(self, lens.Lens lens)
    @cython.locals(x='long long', y='long long', spread='long long', stride='long long')
    cdef _gather(self)
