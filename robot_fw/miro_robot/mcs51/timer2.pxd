cimport cython

from miro_robot.mcs51.interrupts cimport Interrupts

cdef long long NEVER_TICK, _NONE
cdef int _TIMER2, _FELL, _STATES, _T2OE, _DCEN
cdef int _TF2, _EXF2, _RCLK, _TCLK, _EXEN2, _TR2, _C_T2, _CP_RL2

@cython.final
cdef class Timer2:
    cdef Interrupts interrupts
    cdef readonly int control, t2mod
    cdef public int count, capture, up
    cdef long long edge_cycle
    cdef readonly int clock_out
    cdef readonly long long synced
    cdef readonly int sleeps

    cpdef void clear(self, long long cycle) noexcept
    cpdef int drives_pin(self) noexcept
    cdef int silent(self) noexcept
    cdef int up_down(self) noexcept
    cdef int down(self) noexcept
    cdef int rate(self) noexcept
    cdef int left(self) noexcept
    @cython.locals(captures=int)
    cdef int span(self) noexcept
    cpdef void sync(self, long long cycle) noexcept
    cdef void _pass(self, long long counts, int rate, long long first) noexcept
    cdef void _overflowed(self, long long overflows, long long cycle) noexcept
    cpdef long long next_flag(self) noexcept
    cpdef long long next_overflow_tick(self) noexcept
    @cython.locals(first='long long')
    cpdef int out_at(self, long long tick) noexcept
    @cython.locals(first='long long', period='long long')
    cpdef long long out_after(self, long long tick) noexcept
    cdef int counts_pin(self) noexcept
    @cython.locals(waiting=int)
    cdef long long next_pin_overflow(self) noexcept
    cpdef void fall(self, long long cycle) noexcept
    cpdef void sample_external(self, int level) noexcept
    cpdef int falls(self) noexcept
    cdef void _note_sleep(self) noexcept
    cdef void _external(self, long long cycle) noexcept
    cdef void write(self, int control, int t2mod, long long cycle) noexcept
