# C layout of miro_robot.plant.

cdef class Plant:
    cdef public object left
    cdef public object right
    cdef public long long next_tick

    cpdef void attach(self, object left, object right)
    cpdef void advance(self, long long tick)
    cpdef void set_bridge(self, long long tick, int side, int enable, int forward)
