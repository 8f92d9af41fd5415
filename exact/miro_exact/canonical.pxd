cimport cython

cdef int _DEPTH, _ROOM
cdef long long _HIGHEST, _LOWEST
cdef object _FLOAT

@cython.locals(encoder=Encoder)
cpdef bytes encode(object state)
cpdef bytes digest_chain(bytes previous, object state)


@cython.final
cdef class Encoder:
    cdef bytearray out
    cdef unsigned char room[512]
    cdef int used

    cdef int flush(self) except -1
    cdef int put(self, object value, int depth) except -1
    cdef int put_other(self, object value, int depth) except -1
    cdef int put_tag(self, int tag) except -1
    @cython.locals(at=int)
    cdef int put_number(self, int tag, long long number, int size) except -1
    @cython.locals(size=object)
    cdef int put_int(self, object value) except -1
    cdef int put_float(self, double value) except -1
    @cython.locals(size=Py_ssize_t, begin=int, at=int, others=int, letter=Py_UCS4)
    cdef int put_text(self, str value) except -1
    cdef int put_content(self, int tag, bytes content) except -1
    @cython.locals(byte='unsigned char', at=int)
    cdef int put_bytes(self, bytes content) except -1
    @cython.locals(index=Py_ssize_t)
    cdef int put_items(self, object value, int depth) except -1
    @cython.locals(keys=list, key=str)
    cdef int put_dict(self, dict value, int depth) except -1
