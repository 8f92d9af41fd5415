# C layout of miro_robot.plant.
cimport cython

from miro_robot.lm629.buffers cimport signed_31
from miro_robot.lm629.chip cimport Lm629

cdef long long SAMPLE_TICKS

cdef class Plant:
    cdef public Lm629 left, right
    cdef public long long next_tick

    # A plant may be written in Python: `object` lets it raise, and costs less than asking for an exception.
    cpdef attach(self, Lm629 left, Lm629 right)
    cpdef advance(self, long long tick)
    cpdef int run_pulses(self, long long tick) except -1
    cpdef set_bridge(self, long long tick, int side, int enable, int forward)

cdef class IdealWheels(Plant):
    cdef public int stopped

    @cython.locals(chip=Lm629, side=int)
    cpdef advance(self, long long tick)
