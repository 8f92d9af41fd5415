cimport cython

cdef long long NEVER_TICK

@cython.final
cdef class Interrupts:
    cdef public int ie, ip, in_service
    cdef long long since[6]
    cdef long long until[6]
    cdef int asked

    cpdef void clear(self) noexcept
    cpdef void ask(self, int source, long long cycle) noexcept
    cpdef void withdraw(self, int source, long long cycle) noexcept
    cdef void follow(self, int source, int flag, long long cycle) noexcept
    cdef inline int enabled(self) noexcept
    cdef inline int open(self) noexcept
    cpdef int choose(self, long long boundary) noexcept
    cpdef long long next_boundary(self, long long now) noexcept
    cpdef void enter(self, int source) noexcept
    cpdef void leave(self) noexcept

@cython.final
cdef class ExternalInterrupts:
    cdef Interrupts interrupts
    cdef readonly int control
    cdef public int levels

    cpdef void sample(self, int number, int level, long long cycle) noexcept
    cpdef void write(self, int value, long long cycle) noexcept
    cpdef void taken(self, int number, long long cycle) noexcept
    cdef void _follow(self, int number, long long cycle) noexcept
