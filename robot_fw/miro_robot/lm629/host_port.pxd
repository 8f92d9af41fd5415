cimport cython

cdef int _STUCK, _DEAD
cdef int _NOTHING, _COMMAND, _WORD, _ANSWERED, _MISUSE, _OPEN, _SOFTWARE_RESET
cdef int _IGNORED, _ACCEPTED, _REFUSED, _RECORD


@cython.final
cdef class HostPort:
    cdef readonly long long busy_ticks
    cdef readonly int judged_at_end, reset_status, keeps_phase, undue_flags, status_flags
    cdef public int ps, data, writing, reading, fate, drive
    cdef public long long busy_until, writes_while_busy
    cdef public int buffer, lock, command, abandoned, words_left, incoming, low_next, word
    cdef public long long answer
    cdef unsigned char record[16]
    cdef readonly int recorded
    cdef public int broken

    cpdef reset(self, int lock)
    cpdef bint is_busy(self, long long tick) noexcept
    cpdef int status(self, long long tick, int flags) noexcept
    cpdef int pins(self, long long tick, int cs, int rd, int wr, int ps, int data, int flags) except -1
    cdef void _write_begins(self, long long tick) noexcept
    cdef void _read_begins(self, long long tick, int flags) noexcept
    cdef int _write_ends(self, long long tick) noexcept
    cdef int _read_ends(self, long long tick) noexcept
    cdef void _record(self, int byte) noexcept
    cpdef bytes data_bytes(self)
    cdef void _word_is_over(self, long long tick) noexcept
    cdef inline void _be_busy(self, long long tick) noexcept
    cpdef void expect(self, int words) noexcept
    cpdef void reply(self, int words, long long value) noexcept
