# C layout of miro_sim.plant.encoder.
cimport cython

cdef long long _NEVER

@cython.final
cdef class Quadrature:
    cdef readonly double counts_per_radian
    cdef readonly long long counts_per_turn
    cdef readonly double position
    cdef readonly long long count, edge_tick
    cdef double _start, _ticks_per_count
    cdef long long _start_tick, _ticks, _last

    @cython.locals(moved=double, last=cython.longlong)
    cpdef void turn(self, double radians, long long start_tick, int ticks) noexcept
    cpdef int after_load(self) except -1
    cpdef void show(self) noexcept
    @cython.locals(forward=cython.bint, boundary=cython.longlong, exact=double, after=cython.longlong)
    cdef void _aim(self) noexcept
    cpdef int a(self) noexcept
    cpdef int b(self) noexcept
    cpdef int index(self) noexcept
