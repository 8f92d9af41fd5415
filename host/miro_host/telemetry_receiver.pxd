cimport cython
from miro_protocol.decoder cimport Scanner


cdef long long _TURN, _HALF_TURN

cpdef long long unwrapped(long long low, long long before) noexcept


cdef class TelemetryReceiver:
    cdef readonly int robots
    cdef readonly Scanner decoder
    cdef public list last

    cpdef list receive(self, symbols)
    @cython.locals(left='long long', right='long long')
    cdef _take(self, event)
