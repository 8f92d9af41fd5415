cimport cython


cdef long long _NEVER


@cython.final
cdef class InputFilter:
    cdef readonly int direct
    cdef readonly long long wait
    cdef public int level, run_level, pin
    cdef public long long run_tick, pin_tick, due

    cpdef void take(self, int level) noexcept
    @cython.locals(clock=cython.longlong)
    cpdef inline void set(self, long long tick, int level) noexcept
    cpdef inline void accept(self) noexcept


@cython.final
cdef class Encoder:
    cdef readonly InputFilter quadrature, index
    cdef readonly int double_step
    cdef public int seen, armed, caught
    cdef public long long counts, caught_counts

    cpdef void clear(self, int disarm=*) noexcept
    cpdef void set_phases(self, long long tick, int a, int b) noexcept
    @cython.locals(clock=cython.longlong)
    cdef void set_place(self, long long tick, int place) noexcept
    cpdef void set_index(self, long long tick, int level) noexcept
    cpdef void arm(self, long long tick) noexcept
    @cython.locals(now=cython.longlong)
    cpdef void settle(self, long long tick) noexcept
    @cython.locals(before=cython.int, step=cython.int)
    cdef inline void _count(self) noexcept
    cdef void _watch(self) noexcept
