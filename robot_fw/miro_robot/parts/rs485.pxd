cimport cython
from miro_robot.parts.wire_part cimport WirePart

cdef int _DE, _CONTENTION


cdef class Rs485Part(WirePart):
    cdef public int driving, broken
    cdef public long long begun_tick, ended_tick
    cdef public list sent, switched, meetings
    cdef readonly list names
    cdef readonly int slot
    cdef readonly long long delay_ticks

    cpdef changed(self, unsigned int pins, long long tick)
    @cython.locals(driving=int)
    cdef _switch(self, long long tick)
    cdef _contend(self, long long ago)
