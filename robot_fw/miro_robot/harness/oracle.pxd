cdef class LiveOracle:
    cdef public int code
    cdef public long long tick

    cpdef begin(self, long long tick)
    cpdef restarted(self, long long tick)
    cpdef look(self, long long tick)
    cpdef bint waits(self) except -1
