cimport cython

cdef int _INTERRUPTS


@cython.final
cdef class Signals:
    cdef readonly int level, reset_raises, reset_leaves
    cdef public int word, mask, outlives

    cpdef void clear(self, int kept) noexcept
    cpdef void after_reset(self) noexcept
    cpdef void raise_flags(self, int flags) noexcept
    cpdef void reset_interrupts(self, int keep) noexcept
    cpdef void mask_interrupts(self, int mask) noexcept
    cdef inline void _follow(self) noexcept
