cimport cython
from miro_host.eye cimport lens

cdef int _WIDTH, _HEIGHT, _CORNERS, _MARGIN_SPARE_UM
cdef long long _TOP_UM, _MOST


@cython.final
cdef class Rays:
    cdef int slope_x[77361]
    cdef int slope_y[77361]
    cdef int top_x[77361]
    cdef int top_y[77361]
    cdef int middle_x[76800]
    cdef int middle_y[76800]
    cdef int fall_x[76800]
    cdef int fall_y[76800]
    cdef readonly long long x_um, y_um, height_um, spread_um, longest_fall_um

    @cython.locals(drop='long long', x='long long', y='long long', exact_x=double, exact_y=double, i=int, j=int,
                   corner=int)
    cdef _cast(self, lens.Lens lens)
    @cython.locals(x='long long', y='long long', i=int, j=int, a=int, c=int, pixel=int)
    cdef _gather(self)
    @cython.locals(widest='long long', x='long long', y='long long', i=int, j=int, corner=int, at=int, pixel=int)
    cdef long long _spread(self) noexcept
    @cython.locals(longest='long long', pixel=int)
    cdef long long _longest_fall(self) noexcept
