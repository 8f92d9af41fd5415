cimport cython
from miro_robot.parts.part cimport Part

cdef int _MOST_DIGITS

cdef class SevenSegmentPart(Part):
    cdef readonly int count
    cdef readonly unsigned int turned, there
    cdef readonly long long window_ticks
    cdef public int segments, digits
    cdef public long long last_tick
    cdef public long long lit[64]
    cdef public unsigned char seen[8]

    @cython.locals(on='unsigned int')
    cdef _look(self)
    @cython.locals(since='long long', digit=int, segment=int)
    cdef _gather(self, long long tick)
    @cython.locals(least='long long', place=int, digit=int, segment=int, seen=int)
    cpdef due(self, long long tick)
