cimport cython
from miro_sim.world.medium cimport Medium

cdef class World:
    cdef readonly object scenario, seed, image, periods, clock
    cdef readonly list lines
    cdef readonly long long period_ticks
    cdef public long long tick, index
    cdef public object in_period, stopped, chain, last, bodies, waits, _state, _own, _opened
    cdef public list observers

    cpdef step(self)
    cpdef run_to(self, tick)
    cdef int _run_to(self, long long tick) except -1
    @cython.locals(line=Medium)
    cpdef begin_period(self)
    @cython.locals(line=Medium, next_tick=cython.longlong, action_tick=cython.longlong)
    cpdef long long rendezvous(self, long long tick) except -1
    @cython.locals(line=Medium)
    cpdef run_piece(self, long long tick)
    @cython.locals(line=Medium)
    cpdef end_period(self)
