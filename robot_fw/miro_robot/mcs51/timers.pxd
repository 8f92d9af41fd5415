cimport cython

from miro_robot.mcs51.interrupts cimport Interrupts

cdef long long _NEVER
cdef long long _NONE

@cython.final
cdef class Timers:
    cdef Interrupts interrupts
    cdef readonly int tmod
    cdef readonly int control
    cdef unsigned char tl[2]
    cdef unsigned char th[2]
    cdef readonly int gates
    cdef long long edge_cycle[2]
    cdef readonly long long synced
    cdef readonly long long overflows1
    cdef readonly int counting

    @cython.locals(timer=int)
    cpdef void clear(self, long long cycle) noexcept
    @cython.locals(counting=int)
    cpdef void sync(self, long long cycle) noexcept
    cdef inline void _note_counting(self) noexcept
    @cython.locals(split=int, gated=int)
    cdef inline int enabled(self, int part) noexcept
    cdef inline int mode(self, int timer) noexcept
    cdef inline int counts_pin(self, int part) noexcept
    @cython.locals(mode=int)
    cdef inline int value(self, int part) noexcept
    @cython.locals(mode=int)
    cdef inline int top(self, int part) noexcept
    cdef inline int reload(self, int part) noexcept
    @cython.locals(left=int)
    cpdef long long next_overflow(self, int part) noexcept
    @cython.locals(first='long long', second='long long')
    cdef long long quiet_until(self) noexcept
    cpdef long long next_flag(self, int timer) noexcept
    cpdef void fall(self, int timer, long long cycle) noexcept
    @cython.locals(changed=int, timer=int)
    cpdef void write_control(self, int value, long long cycle) noexcept
    cdef void write_mode(self, int value) noexcept
    cdef void set_gates(self, int levels) noexcept
    cpdef void taken(self, int timer, long long cycle) noexcept
    @cython.locals(first='long long', counts='long long', value='long long', left='long long', reload='long long', span='long long',
                   overflows='long long')
    cdef void _pass(self, int part, long long cycle) noexcept
    @cython.locals(mode=int)
    cdef inline void _store(self, int part, int value) noexcept
    @cython.locals(timer=int)
    cdef void _overflowed(self, int part, long long overflows, long long cycle) noexcept
