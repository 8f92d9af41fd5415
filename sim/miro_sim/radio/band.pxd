cimport cython

from miro_robot.mcs51.line cimport Line
from miro_sim.radio.chain cimport Chain
from miro_exact.rng cimport Stream

cdef long long _NEVER, _BIT, _HOLD
cdef int _UP, _DOWN, _NOISE


@cython.final
cdef class Transmitter:
    cdef readonly Line line
    cdef Chain bursts, dropouts
    cdef long long last_edge


cdef class Band:
    cdef readonly object params, seed
    cdef readonly str name
    cdef Stream errors, noise
    cdef public int link_state
    cdef long long latency
    cdef unsigned long long threshold, burst_threshold
    cdef bint chained
    cdef Transmitter alone
    cdef int known
    cdef long long alone_until, change_tick
    cdef readonly list transmitters

    @cython.locals(transmitter=Transmitter, limit='long long')
    cpdef long long limit(self) except? -1
    cdef int level(self, long long tick) except -1
    @cython.locals(transmitter=Transmitter, line=Line, level=int, wrong=cython.bint, change='long long',
                   own_edge='long long', one_alone=cython.bint)
    cdef int _look(self, long long sent) except -1
    @cython.locals(transmitter=Transmitter)
    cpdef hear(self, long long tick)
    @cython.locals(transmitter=Transmitter, tick='long long')
    cpdef long long full_tick(self) except? -1
