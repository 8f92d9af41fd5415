cimport cython

cdef long long _LIMIT
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
    @cython.locals(place=int, sync=int, found=int)
    cpdef bint take(self, int byte, bint bad_stop, long long tick) except -1
    cdef void _clear(self) noexcept
    cpdef int body_at(self, int place) noexcept

    @cython.locals(tick='long long', flaws=int, place=Py_ssize_t, length=Py_ssize_t, found=int, view='const unsigned char[::1]')
    cpdef list feed(self, data, start_tick=*)
    @cython.locals(tick='long long', found=int)
    cpdef list feed_symbols(self, symbols)
    @cython.locals(tick='long long', place=Py_ssize_t, length=Py_ssize_t, found=int, 
                   bytes_view='const unsigned char[::1]', stop_view='const unsigned char[::1]', tick_view='const long long[::1]')
    cpdef list feed_columns(self, data, bad_stop, ticks)
    @cython.locals(place=int)
    cpdef int after_load(self) except -1
    @cython.locals(spacing='long long')
    cdef bint _is_apart(self, long long tick) noexcept
    @cython.locals(flaws=int)
    cdef int _put_symbol(self, int byte, bint bad_stop, long long tick) noexcept
    @cython.locals(place=int)
    cdef inline void _keep(self, int byte, int flaws, long long tick) noexcept
    @cython.locals(start=int, reason=int)
    cdef inline int _put(self, int byte, int flaws, long long tick) noexcept
    @cython.locals(place=int, byte='unsigned int', register='unsigned int')
    cdef int _test(self, int start) noexcept
    @cython.locals(sync=int, start=int, end=int, place=int, body=bytearray)
    cdef _give_out(self, int found, list events)
    @cython.locals(start=int, expected=int)
    cdef int _lead_start(self, int sync) noexcept
    @cython.locals(place=int)
    cdef _give_out_damaged(self, int length, list events)
