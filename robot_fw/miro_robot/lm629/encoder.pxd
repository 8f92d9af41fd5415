cimport cython

cdef long long NEVER_TICK


@cython.final
cdef class InputFilter:
    cdef readonly int direct
    cdef readonly long long wait
    cdef public int level, run_level, pin
    cdef public long long run_tick, pin_tick, due

    cpdef void take(self, int level, long long tick=*) noexcept
    cpdef inline void set(self, long long tick, int level) noexcept
    cpdef inline void accept(self) noexcept


@cython.final
cdef class Encoder:
    cdef readonly InputFilter quadrature, index
    cdef readonly long long spacing
    cdef int steps[4]
    cdef public int seen, armed, caught
    cdef public long long counts, caught_counts

    cpdef void clear(self, int disarm=*) noexcept
    cpdef void set_phases(self, long long tick, int a, int b) noexcept
    cdef void set_place(self, long long tick, int place) noexcept
    @cython.locals(waits=cython.bint)
    cdef int set_run(self, long long first_tick, long long before_tick, long long last_tick, long long edges, long long step,
                     long long count) noexcept
    cpdef void set_index(self, long long tick, int level) noexcept
    cpdef void arm(self, long long tick) noexcept
    cpdef void settle(self, long long tick) noexcept
    cdef inline void _count(self) noexcept
    cdef void _watch(self) noexcept
