cimport cython

cdef int _NONE, _READ_ACCESS, _WRITE_PULSE, _DATA_SETUP, _DATA_HOLD, _PS_SETUP, _PS_HOLD, _RECOVERY
cdef long long _LONG_AGO


@cython.final
cdef class BusTiming:
    cdef int least[9]
    cdef int writing, reading, ps, data, broken
    cdef public long long ticks
    cdef long long begin_tick, end_tick, written_tick, ps_tick, data_tick

    cpdef void rest(self, int writing, int reading, int ps, int data) noexcept
    @cython.locals(moved=cython.int)
    cpdef int pins(self, long long tick, int cs, int rd, int wr, int ps, int data) noexcept
    cpdef int sampled(self, long long tick) noexcept
    cdef void _strobe_ends(self, long long tick) noexcept
    cdef inline void _require(self, int limit, long long ticks) noexcept
