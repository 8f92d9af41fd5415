cimport cython

from miro_robot.mcs51.line cimport Line
from miro_sim.radio.chain cimport Chain
from miro_exact.rng cimport Stream

cdef long long _NEVER, _BIT, _HOLD
cdef int _DOWN, _NOISE


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
    cdef bint slotted
    cdef readonly list transmitters

    cpdef add(self, long long robot, Line line)
    @cython.locals(transmitter=Transmitter, limit='long long')
    cpdef long long limit(self) except? -1
    @cython.locals(
        transmitter=Transmitter, sent='long long', slot='long long', edge='long long', level=int, carrier=int,
        threshold='unsigned long long',
    )
    cpdef int level(self, long long tick) except -1
    @cython.locals(transmitter=Transmitter, sent='long long', change='long long')
    cpdef long long next_change(self, long long tick) except? -1
    @cython.locals(transmitter=Transmitter)
    cpdef hear(self, long long tick)
    @cython.locals(transmitter=Transmitter, tick='long long')
    cpdef long long full_tick(self) except? -1
