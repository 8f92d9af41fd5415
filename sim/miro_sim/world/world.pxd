cimport cython
from miro_sim.world.network cimport Network

cdef long long CONTROL_PERIOD_TICKS


cdef class World:
    cdef readonly object scenario, seed, image, periods
    cdef readonly list networks
    cdef public long long tick, index
    cdef public object in_period, stopped, chain, last, bodies, waits, _state, _own, _opened
    cdef public list observers

    cpdef step(self)
    cpdef run_to(self, tick)
    cdef int _run_to(self, long long tick) except -1
    @cython.locals(network=Network)
    cpdef begin_period(self)
    @cython.locals(network=Network, next_tick=cython.longlong, action_tick=cython.longlong)
    cpdef long long rendezvous(self, long long tick) except -1
    @cython.locals(network=Network)
    cpdef run_piece(self, long long tick)
    @cython.locals(network=Network)
    cpdef end_period(self)
