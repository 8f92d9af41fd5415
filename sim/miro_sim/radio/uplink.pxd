from miro_sim.radio.band cimport Band

cdef long long _STOP


cdef class Uplink:
    cdef readonly str name
    cdef readonly Band band
    cdef readonly long long now, start_tick, bit_errors
    cdef long long numerator, denominator
    cdef int before, bit, shift

    cpdef list receive(self, long long until_tick)
    cdef void hunt(self, long long until) except *
    cdef void sample(self, long long until, list symbols) except *
