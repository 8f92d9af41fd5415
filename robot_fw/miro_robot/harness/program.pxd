cimport cython

cdef int _MOST, _MOST_RESETS, _MOST_PUTS, _PAIR, SEQ_MODULUS, _XOR_OUT
cdef long long _MOST_TICKS, _PAUSE, _SILENCE, _RESET_TICKS, _UP_TICKS, _PUT_TICKS
cdef int _BYTES, _FRAMES, _SESSION, _TEAM, _SERVICE, _ASK, _BAD_STOP, _RESET, _LONG
cdef bytes _WHITE


cdef class Program:
    cdef readonly int how, slot, robots
    cdef readonly object repair
    cdef readonly long long character_ticks
    cdef unsigned char characters[2048]
    cdef unsigned char flaws[2048]
    cdef long long pauses[2048]
    cdef readonly int choices, pins, puts
    cdef int put_places[256]
    cdef long long put_ticks[256]
    cdef int put_choices[256]
    cdef int put_values[256]
    cdef readonly int count, frames
    cdef readonly long long length
    cdef unsigned char _frame[64]
    cdef int _head, _payload
    cdef unsigned int _layout
    cdef unsigned short _table[256]
    cdef const unsigned char[::1] _data
    cdef Py_ssize_t _place, _end
    cdef int _seq, _first, _size, _damage_at, _damage, _cut, _stop_at, _flags, _resets
    cdef readonly long long trailing_ticks

    cpdef int read(self, data) except -1
    cpdef bint ends_with_reset(self) noexcept
    cpdef bint opens_with(self, bytes characters) noexcept
    cdef bint _has_room(self) noexcept
    cdef int _next(self) noexcept
    cdef void _put(self, int value) noexcept
    cdef void _pause(self, long long ticks) noexcept
    cdef void _forget_flaws(self) noexcept
    cdef int _one_frame(self) except -1
    cdef int _operation(self, int kind) except -1
    @cython.locals(which=int, value=int, ticks='long long')
    cdef int _one_put(self, bint pin) except -1
    cdef bint _has_put(self) noexcept
    cdef int _frame_operation(self, int kind) except -1
    cdef void _payload_from_input(self) noexcept
    cdef void _own_velocities(self) noexcept
    @cython.locals(register='unsigned int')
    cdef int _seal(self, int hdr) except -1
    cdef int _foreign(self) except -1
    cdef int _send(self, bytes frame) except -1
