cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _TRIG, _ECHO, _IDLE, _SENDING, _LISTENING, _NORMAL, _NONE, _LOW, _HIGH, HIGH, LOW
cdef double _TRIG_US, _BURST_US, _NO_ECHO_US, _US_PER_CM, _NEAREST_CM, _FARTHEST_CM

cdef class HcSr04Part(Part):
    cdef readonly int is_silent
    cdef readonly double noise_cm
    cdef public int phase, is_asked, echo
    cdef public long long rise_tick, pings
    cdef public double distance_cm

    @cython.locals(cm=double)
    cdef double _echo_us(self) except? -1
    cdef _answer(self, int level)
