cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int LOW, RELEASED, _LAST_STEP, _MISSING, _SUM
cdef double _BEGIN_US

cdef class DhtPart(Part):
    cdef readonly int is_fine
    cdef readonly long long start_ticks, interval_ticks
    cdef readonly long long step_ticks[5]
    cdef public int step, broken
    cdef public long long bits, fall_tick, ready_tick, answers, refused
    cdef public double temperature_c, humidity_percent

    @cython.locals(step=int, bits='long long', is_one=int)
    cpdef due(self, long long tick)
    @cython.locals(scale=double, shift=int, humidity='long long', degrees='long long', check='long long')
    cdef _measure(self)
