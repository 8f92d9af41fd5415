cdef long long _NEVER
cdef int RELEASED, MOST_PINS, LOW

cdef class Part:
    cdef readonly object keys, place
    cdef readonly str name
    cdef readonly long long crystal_hz
    cdef public long long next_tick, reach_tick
    cdef readonly int continuous, senses_drive
    cdef public unsigned int levels, outside, driven
    cdef public unsigned int pending, moved
    cdef unsigned int low_pins, high_pins
    cdef public unsigned char wanted[32]
    cdef public unsigned char drives[32]
    cdef public list faults

    cpdef int level(self, int pin) noexcept
    cpdef int others(self, int pin) noexcept
    cpdef int is_driven(self, int pin) noexcept
    cpdef int drive(self, int pin, int level) except -1
    cpdef fault(self, int kind, str detail, int order=*, int ago=*)
    cdef _named(self, int pin)
    cpdef long long ticks(self, double us) except? -1
    cpdef start(self, long long tick)
    cpdef supply(self, int on, long long tick)
    cpdef changed(self, unsigned int pins, long long tick)
    cpdef due(self, long long tick)
    cpdef advance(self, long long tick)
