cimport cython
from miro_sim.pitch.contact cimport next_look, touch
from miro_sim.world.robot cimport Robot

cdef long long GRID_TICKS, NEVER_TICK


cdef class Bodies:
    cdef readonly list robots, pairs, looks
    cdef public list touching
    cdef list next_ticks
    cdef long long next_tick

    cpdef start_again(self, list touching)
    cpdef start_at(self, long long tick)
    @cython.locals(robot=Robot, first=Robot, other=Robot, index=Py_ssize_t, closing_m_s=double)
    cpdef begin(self, long long tick, long long until_tick)
    @cython.locals(first=Robot, other=Robot, index=Py_ssize_t, tick='long long', closing_m_s=double, known=bint)
    cpdef list look(self)


cdef tuple _noted(Robot robot, long long tick)
