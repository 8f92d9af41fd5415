cimport cython

cdef int _DEPTH
cdef object _FLOAT

cpdef bytes encode(object state)
cpdef bytes digest_chain(bytes previous, object state)
cdef int _put(bytearray out, object value, int depth) except -1
cdef int _put_word(bytearray out, int tag, long long number, int size) except -1
cdef int _put_int(bytearray out, object value) except -1
cdef int _put_float(bytearray out, double value) except -1
cdef int _put_text(bytearray out, str value) except -1
@cython.locals(index=long)
cdef int _put_items(bytearray out, object value, int depth) except -1
cdef int _put_dict(bytearray out, dict value, int depth) except -1
