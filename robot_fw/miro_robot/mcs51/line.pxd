cimport cython

cdef long long NEVER_TICK, _SIZE, _WAITING

@cython.final
cdef class Line:
    cdef public long long settled_tick
    cdef public bint unread
    cdef readonly bint full
    cdef long long[::1] _ticks
    cdef long long _mask
    cdef int _before
    cdef long long _first, _end, _cursor, _heard

    cpdef int append(self, long long tick, int level) except -1
    cdef int _change_last(self, long long tick, int level) except -1
    cdef int _make_room(self) except -1
    cdef int _resize(self, long long size) except -1
    cpdef int level_at(self, long long tick) noexcept
    cpdef long long next_edge(self, long long tick) noexcept
    cpdef long long edge_at(self, long long tick) noexcept
    cpdef int samples(self, long long tick, long long step, long long width, long long end, int most) noexcept
    cpdef void forget(self, long long tick) noexcept
    cpdef void hear(self, long long tick) noexcept
    cpdef long long full_tick(self) noexcept
    cpdef long long last_tick(self) noexcept
    cdef inline int _last_level(self) noexcept
    cdef void _seek(self, long long tick) noexcept
