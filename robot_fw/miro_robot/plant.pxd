# C layout of miro_robot.plant.
from miro_robot.lm629.chip cimport Lm629

cdef class Plant:
    cdef public Lm629 left
    cdef public Lm629 right
    cdef public long long next_tick

    cpdef void attach(self, Lm629 left, Lm629 right)
    cpdef void advance(self, long long tick)
    cpdef void set_bridge(self, long long tick, int side, int enable, int forward)
