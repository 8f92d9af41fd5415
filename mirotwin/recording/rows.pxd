# C layout of mirotwin.recording.rows.
cimport cython

cdef int _MESSAGE, _HEAD, _BEFORE_LENGTH
cdef bytes _EMPTY_HEAD, _EMPTY_ENTRY


cdef class Chunk:
    cdef Py_ssize_t limit
    cdef object full, encode_into
    cdef readonly bytearray data
    cdef readonly dict indexes
    cdef readonly unsigned long long first_ns, last_ns

    cpdef begin(self)
    cpdef add_record(self, bytes record)
    @cython.locals(begin=Py_ssize_t, entry=Py_ssize_t, index=bytearray)
    cpdef add(self, channel, unsigned long long time_ns, message)
    cdef _end(self)


cdef void _put_head(unsigned char *out, Py_ssize_t begin, Py_ssize_t size, long long channel, unsigned long long time_ns) noexcept
cdef void _put(unsigned char *out, Py_ssize_t place, unsigned long long value) noexcept


cdef class MessageWriter:
    cdef Chunk chunk
    cdef object add_channel
    cdef readonly dict channels
    cdef tuple ns_ticks

    cpdef write_all(self, list waiting)
    cdef _period(self, period)
    @cython.locals(names=list)
    cdef _robot(self, robot, tick, time_ns)
    cdef _add(self, str topic, time_ns, message)


cdef _registers(axis)
cdef _duty(axis)
