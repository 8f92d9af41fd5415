cimport cython

cdef long long _CHARACTER


cdef class Sender:
    cdef readonly list transmissions
    cdef readonly long long numerator, denominator, latency, keyup
    cdef readonly bint always_on

    cdef long long begin(self, long long start, long long number) except? -1
    cdef long long back(self, long long start, long long number) except? -1
    cdef long long number(self, long long since) except? -1
    cdef long long end(self, long long start, long long count) except? -1
    cdef int levels(self, bytes data, bytes stops, long long number) except -1
    cdef bint bad_stop(self, bytes stops, long long number) except -1
    @cython.locals(start='long long')
    cdef int level(self, long long tick) except? -2
    cpdef forget(self, long long until)
