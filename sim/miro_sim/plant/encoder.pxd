# C layout of miro_sim.plant.encoder.
cimport cython
from miro_robot.lm629.chip cimport Lm629

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
    cpdef inline void show(self) noexcept
    @cython.locals(tick=cython.longlong)
    cpdef void report(self, Lm629 chip) noexcept
    @cython.locals(forward=cython.bint, boundary=cython.longlong, exact=double, after=cython.longlong)
    cdef inline void _aim(self) noexcept
    cpdef inline int a(self) noexcept
    cpdef inline int b(self) noexcept
    cpdef int index(self) noexcept
