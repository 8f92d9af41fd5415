cimport cython

from miro_robot.mcs51.line cimport Line
from miro_sim.rng cimport Stream

cdef long long _BIT, _CHARACTER


cdef class Listener:
    cdef readonly Line line
    cdef readonly long long bit_errors
    cdef Stream errors, noise
    cdef long long latency
    cdef unsigned long long threshold

    @cython.locals(slot='long long')
    cdef void hear_noise(self, long long tick, long long until) except *
    @cython.locals(number='long long', last='long long', begin='long long', place='long long', level=int)
    cdef void hear_data(self, long long tick, long long until, long long start, bytes data) except *


cdef class Downlink:
    cdef readonly object params
    cdef readonly object seed
    cdef readonly str name
    cdef readonly dict listeners
    cdef readonly list transmissions
    cdef readonly long long settled_tick, free_tick
    cdef long long latency, keyup
    cdef bint always_on, squelch

    @cython.locals(listener=Listener)
    cpdef settle(self, long long until_tick)
    @cython.locals(start='long long', data=bytes)
    cdef long long end(self, Py_ssize_t index) except? -1
    @cython.locals(index=Py_ssize_t, start='long long', data=bytes, stop='long long')
    cdef void fill(self, Listener listener, long long tick, long long until) except *
    cdef long long wait(self, Listener listener, long long tick, long long until) except? -1
