cimport cython

cdef long long _saturated(long long value) noexcept


@cython.final
cdef class Pid:
    cdef readonly int saturates, rounds_down
    cdef public long long kp, ki, kd, il, ds
    cdef public long long error_sum, previous, derivative, integral, phase

    cpdef void load(self, long long kp, long long ki, long long kd, long long il, long long ds) noexcept
    cpdef void open_loop(self) noexcept
    cpdef int step(self, long long position_error) noexcept
    cpdef int top_of_sum(self) noexcept
    cdef long long _top(self) noexcept
    cdef long long _narrow(self, long long value) noexcept
    cdef long long _limited(self, long long value) noexcept
