from miro_robot.parts.button cimport ButtonPart

cdef long long _NEVER
cdef int _COIL, RELEASED

cdef class RelayPart(ButtonPart):
    cdef readonly int active
    cdef readonly long long operate_ticks, release_ticks
    cdef public int energized, stuck
    cdef public long long armature_tick, bounce_tick

    cdef _energize(self, int energized, long long tick)
    cpdef int _is_closed(self) noexcept
