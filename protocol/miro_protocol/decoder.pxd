cimport cython

cdef int _BAD_STOP, _APART, _FRAME, _RUN, _NO_SYNC, _BAD_STOP_BIT, _BAD_SPACING, _BAD_CRC


cdef class Scanner:
    cdef readonly object format
    cdef bytes _sync, _lead, _white
    cdef unsigned short _table[256]
    cdef unsigned int _start, _intact
    cdef int _size, _run_limit
    cdef long long _step, _spacing, _tolerance
    cdef public long long valid, rejected
    cdef unsigned char _data[4160]
    cdef unsigned char _flaws[4160]
    cdef long long _ticks[4160]
    cdef int _count, _last_bad, _last_apart, _reason
    cdef long long _next_tick
    cdef bint _paused
    cdef unsigned char body[64]

    cpdef begin(self)
    cpdef bint take(self, int byte, bint bad_stop, long long tick) except -1
    cdef void _clear(self) noexcept

    @cython.locals(tick='long long', view='const unsigned char[::1]')
    cpdef list feed(self, data, start_tick=*)
    @cython.locals(tick='long long')
    cpdef list feed_symbols(self, symbols)
    cdef bint _is_apart(self, long long tick) noexcept
    cdef int _put(self, int byte, bint bad_stop, long long tick) noexcept
    @cython.locals(byte='unsigned int', register='unsigned int')
    cdef int _test(self, int start) noexcept
    cdef _give_out(self, int kind, list events)
    cdef void _read_body(self, int sync) noexcept
    cdef int _lead_start(self, int sync) noexcept
    cdef _give_out_damaged(self, int length, list events)
