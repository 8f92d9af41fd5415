cdef long long _BIT, _ONE
cdef int _TABLE, _STEP


cdef class Slicer:
    cdef readonly long long tick, mean
    cdef readonly int signal
    cdef long long gain, offset
    cdef unsigned long long table[513]

    cpdef hear(self, long long tick, int signal)
    cpdef unsigned long long threshold(self, int level) except? 1
