cimport cython

cdef long long NEVER_TICK

@cython.final
cdef class Ports:
    cdef int latches[4]
    cdef int outside[4]
    cdef readonly list pending
    cdef readonly long long next_cycle

    cpdef int push(self, int port, int levels, long long tick) except -1
    cpdef int apply(self, long long cycle) except -1
