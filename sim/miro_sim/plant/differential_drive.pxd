cimport cython
from miro_robot.parts.lm629 cimport Lm629Part
from miro_robot.parts.part cimport Part
from miro_robot.plant cimport Plant

cdef long long NEVER_TICK
cdef int _PINS, _LEFT_A, _RIGHT_A
cdef unsigned int _HALF


cdef class DrivePart(Part):
    cdef public Plant plant
    cdef Lm629Part left, right
    cdef int on

    @cython.locals(chips_tick='long long')
    cpdef advance(self, long long tick)
    cdef Lm629Part _chip_at(self, int pin)
    @cython.locals(side=int)
    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(levels='unsigned int', forward=int, backward=int)
    cdef int _put(self, int side, long long tick, int on) except -1
    cdef int _wait(self) noexcept
