cimport cython

cdef long long NEVER_TICK

@cython.final
cdef class Ports:
    cdef int latches[4]
    cdef int outside[4]
    cdef int stuck_low[4]
    cdef int stuck_high[4]
    cdef readonly list pending
    cdef readonly long long next_cycle

    cdef void hold(self, int port, int low, int high) noexcept
    @cython.locals(stuck=int, port=int)
    cpdef bint is_stuck(self) except -1
    cpdef int driven(self, int port) noexcept
    cdef inline int shorted(self, int port, int levels) noexcept
    cdef inline int pins(self, int port) noexcept
    cpdef int push(self, int port, int levels, long long tick) except -1
    cpdef int apply(self, long long cycle) except -1
