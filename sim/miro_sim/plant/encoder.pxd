cimport cython
from miro_sim.plant.dc_motor cimport DcMotorPart, OnShaft

cdef long long _NEVER
cdef int _SHAFT, _A, _B, LOW, RELEASED
cdef double _FAR

cdef class EncoderPart(OnShaft):
    cdef readonly double counts_per_turn
    cdef DcMotorPart motor
    cdef public int is_on, broken_a, broken_b
    cdef public long long count

    cdef DcMotorPart _motor(self)
    cpdef speed_changed(self, long long tick)
    cdef double _position_at(self, long long tick) noexcept
    @cython.locals(position=double, count='long long')
    cdef long long _count_at(self, long long tick) noexcept
    @cython.locals(last_tick='long long', pace=double, edge=double, ticks=double, at='long long')
    cdef _plan(self, long long tick)
    @cython.locals(quarter=int)
    cdef _show(self)
