cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _TRIG, _ECHO, _BODY, _HORN, _IDLE, _SENDING, _LISTENING, _NORMAL, _NONE, _LOW, _HIGH, HIGH, LOW
cdef double _TRIG_US, _BURST_US, _NO_ECHO_US, _US_PER_CM, _NEAREST_CM, _FARTHEST_CM

cdef class HcSr04Part(Part):
    cdef readonly int is_silent
    cdef readonly double noise_cm
    cdef public int phase, is_asked, echo
    cdef public long long rise_tick, pings
    cdef public double distance_cm

    cdef double _obstacle_cm(self, long long tick) except? -1
    @cython.locals(cm=double)
    cdef double _echo_us(self, double cm) except? -1
    cdef _answer(self, int level)

cdef class HcSr04OnCar(HcSr04Part):
    cdef readonly double ahead_cm, left_cm, turned_deg
    cdef object car, servo
    cdef public int sees_walls

    @cython.locals(turned_deg=double, cm=double)
    cdef double _obstacle_cm(self, long long tick) except? -1
