cimport cython

cdef long long CAPACITY, _MASK
cdef int _COMMAND


@cython.final
cdef class EventLog:
    cdef readonly long long end, first
    cdef long long _ticks[2048]
    cdef int _kinds[2048]
    cdef long long _codes[2048]
    cdef long long _values[2048]
    cdef list _data

    cpdef void note(self, int kind, long long tick, long long code, long long value, bytes data=*) noexcept
    cpdef cut(self, long long serial)
