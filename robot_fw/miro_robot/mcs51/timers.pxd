cimport cython

from miro_robot.mcs51.interrupts cimport Interrupts

cdef long long NEVER_TICK, _NONE
cdef int _TIMER0, _TIMER1, _TF0, _TF1, _TR0, _TR1

@cython.final
cdef class Timers:
    cdef Interrupts interrupts
    cdef readonly int tmod, control
    cdef unsigned char tl[2]
    cdef unsigned char th[2]
    cdef readonly int gates
    cdef long long edge_cycle[2]
    cdef readonly long long synced, overflows1
    cdef int counts_always, counts_by_tr0, counts_by_tr1, counting, on_pins, steady
    cdef long long start[3]
    cdef int top[3]
    cdef long long due

    cpdef void clear(self, long long cycle) noexcept
    cpdef void sync(self, long long cycle) noexcept
    cdef void _set_mode(self, int tmod) noexcept
    @cython.locals(split=int, stands=int, open0=int, open1=int)
    cdef void _note_gates(self) noexcept
    cdef void _note_counting(self) noexcept
    cdef inline void _begin(self, int part) noexcept
    cdef inline int mode(self, int timer) noexcept
    cdef inline int counts_pin(self, int timer) noexcept
    cdef inline int value(self, int part) noexcept
    cdef inline void _put(self, int part, int count) noexcept
    cdef inline int reload(self, int part) noexcept
    cdef int span(self, int part) noexcept
    cdef inline long long next_overflow(self, int part) noexcept
    cdef long long next_flag(self, int timers) noexcept
    cpdef void fall(self, int timer, long long cycle) noexcept
    cdef void set_gates(self, int levels) noexcept
    cdef int read(self, int number) noexcept
    cdef int write(self, int number, int value) noexcept
    cdef int write_mode(self, int value) noexcept
    cdef int write_control(self, int value, long long cycle) noexcept
    cpdef void taken(self, int timer, long long cycle) noexcept
    cdef void _pass(self, long long cycle) noexcept
    cdef void _pass_cycles(self, int part, long long cycle) noexcept
    cdef void _pass_fall(self, int part, long long cycle) noexcept
    cdef inline void _store(self, int timer) noexcept
    cpdef void store(self) noexcept
    cdef void _overflowed(self, int part, long long overflows, long long cycle) noexcept
