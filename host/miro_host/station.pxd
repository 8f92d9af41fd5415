cimport cython

cdef int _SEQ_MODULUS, _XOR_OUT


cdef class Station:
    cdef readonly int n
    cdef readonly object telemetry, services
    cdef public long long seq, team_frames_since_service
    cdef int _kind, _size, _body
    cdef unsigned int _start
    cdef bytes _white
    cdef unsigned char _frame[64]
    cdef unsigned short _table[256]

    cpdef bytes frame(self, commands)
    @cython.locals(word=int, register='unsigned int')
    cdef bint _fill(self, commands) except -1
