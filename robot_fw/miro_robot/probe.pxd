cdef class Probe:
    cpdef moved(self, long long tick)
    cpdef hi_fell(self, long long tick)
    cpdef passed(self, long long tick)
