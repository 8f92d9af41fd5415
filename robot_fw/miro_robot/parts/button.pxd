from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _MOST_BOUNCES, LOW, HIGH, RELEASED

cdef class ButtonPart(Part):
    cdef readonly int made, rest
    cdef readonly long long bounce_ticks
    cdef public int pressed, closed, bounces
    cdef public long long changes, settles_tick

    cdef _press(self, int pressed, long long tick)
    cdef _contact(self, int closed)
    cdef _bounce_on(self, long long tick)
