cdef class Outbox:
    cdef public list waiting
    cdef public long long dropped
    cdef readonly long long lead_ticks
    cdef public long long character_ticks
    cdef readonly int network

    cpdef bint post(self, sent, long long free_tick) except -1
    cpdef list due(self, long long until_tick)
