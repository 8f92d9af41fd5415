# C layout of mirotwin.recording.rows.
cimport cython

cdef int _LINE_END, _MESSAGE, _HEAD, _BEFORE_LENGTH


cdef class Chunk:
    cdef public bytearray data
    cdef readonly dict indexes
    cdef readonly unsigned long long first_ns, last_ns
    cdef Py_ssize_t end

    cpdef add(self, long long channel, unsigned long long time_ns, bytes content)
    @cython.locals(end=Py_ssize_t, room=Py_ssize_t, place=Py_ssize_t)
    cpdef fill(self, list heads, Py_ssize_t first, bytes text, Py_ssize_t at, Py_ssize_t limit)
    @cython.locals(
        place=Py_ssize_t, begin=Py_ssize_t, index=Py_ssize_t, channel='long long', time_ns='unsigned long long', form=bytes,
        byte='unsigned char'
    )
    cdef _fill(
        self, unsigned char[::1] out, Py_ssize_t end, list heads, Py_ssize_t first, bytes text, Py_ssize_t at, Py_ssize_t limit
    )
    @cython.locals(index=list)
    cdef _head(
        self, unsigned char[::1] out, Py_ssize_t begin, Py_ssize_t size, long long channel, unsigned long long time_ns
    )


@cython.locals(index=int)
cdef void _put(unsigned char[::1] out, Py_ssize_t place, unsigned long long value, int size) noexcept


cdef class Rows:
    cdef object add_channel, write
    cdef readonly dict channels
    cdef list heads, values

    cpdef flush(self)
    cpdef clear(self)
    cpdef message(self, str topic, tick, message)
    cpdef period(self, period)
    cdef _wire(self, sent)
    @cython.locals(names=list)
    cdef _robot(self, robot, tick)
    cdef _control(self, str topic, answer, tick)
    cdef _registers(self, axis)
    cdef _posture(self, tick, at)
    @cython.locals(found=tuple)
    cdef _begin(self, str topic, tick, kind)
    cdef _add_channel(self, str topic, kind, bytes form, inner)
