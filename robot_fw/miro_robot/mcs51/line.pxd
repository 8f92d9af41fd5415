cimport cython

cdef long long _FAR
cdef long long _MASK
cdef long long _SIZE

@cython.final
cdef class Line:
    cdef public long long settled_tick
    cdef public bint unread
    cdef long long _ticks[4096]
    cdef int _before
    cdef long long _first
    cdef long long _end
    cdef long long _cursor

    @cython.locals(last='long long')
    cpdef append(self, long long tick, int level)
    cpdef int level_at(self, long long tick) noexcept
    cpdef long long next_edge(self, long long tick) noexcept
    cpdef void forget(self, long long tick) noexcept
    @cython.final
    cdef inline int _last_level(self) noexcept
    @cython.final
    @cython.locals(cursor='long long')
    cdef void _seek(self, long long tick) noexcept
