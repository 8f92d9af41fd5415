# C layout of miro_sim.plant.encoder.
cimport cython
from miro_robot.lm629.chip cimport Lm629

@cython.final
cdef class Quadrature:
    cdef readonly double counts_per_radian
    cdef readonly long long counts_per_turn
    cdef readonly double position
    cdef readonly long long count

    @cython.locals(moved=double, start=double, last=cython.longlong, count=cython.longlong, ticks_per_count=double,
                   forward=cython.bint, boundary=cython.longlong, exact=double, after=cython.longlong)
    cpdef void turn(self, double radians, long long start_tick, int ticks, Lm629 chip) noexcept
    cpdef int after_load(self) except -1
    cpdef inline int a(self) noexcept
    cpdef inline int b(self) noexcept
    cpdef int index(self) noexcept
