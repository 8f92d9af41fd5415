cimport cython

cdef long long CAPACITY
cdef long long _MASK


@cython.final
cdef class EventLog:
    cdef readonly long long end, first
    cdef long long _ticks[2048]
    cdef int _kinds[2048]
    cdef long long _codes[2048]
    cdef int _sizes[2048]
    cdef long long _high[2048]
    cdef long long _low[2048]

    cpdef void note(self, int kind, long long tick, long long code, long long value) noexcept
    cpdef void note_long(self, int kind, long long tick, long long code, int size, long long high, long long low) noexcept
    cpdef void copy(self, EventLog other, long long serial) noexcept
    cpdef cut(self, long long serial)
