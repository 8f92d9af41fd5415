cimport cython
from libc cimport math

cdef double _FAR, _NO_LENGTH, _EDGE, _BEAM_TAN, _GRAZING_COS, _SAME

cdef class Plane:
    cdef double walls[4096]
    cdef double lines[4096]
    cdef int walls_end, lines_end
    cdef double half_cm, cell_cm
    cdef list rows

    cpdef double room_cm(self, double x, double y) noexcept
    @cython.locals(at=int, least=double, a_x=double, a_y=double, d_x=double, d_y=double, length2=double, share=double)
    cdef double _nearest(self, double *ends, int end, double x, double y) noexcept
    @cython.locals(away=double)
    cpdef double edge_cm(self, double x, double y) except? -7.5
    cdef bint _is_dark(self, double x, double y) except -1
    @cython.locals(at=int, a_x=double, a_y=double, d_x=double, d_y=double, ahead=double, left=double, more=double, aside=double, middle=double, nearest=double, beyond=double)
    cpdef double echo_cm(self, double x, double y, double cosine, double sine) noexcept
    @cython.locals(first=double, last=double, side=double, inside=double, change=double, length2=double, share=double, normal_cm=double, distance=double)
    cdef double _beam_cm(self, double ahead, double left, double more, double aside) noexcept
