cimport cython

from miro_exact.rng cimport Stream

cdef unsigned long long _ONE


cdef class Chain:
    cdef readonly Stream stream
    cdef unsigned long long enter, stay
    cdef long long first, slot
    cdef int before, answer

    @cython.locals(draw='unsigned long long')
    cpdef int bad(self, long long slot) except -1
