cimport cython


@cython.final
cdef class Grabber:
    cdef readonly Py_ssize_t robots, delay_frames
    cdef readonly list under_way

    cpdef tuple take(self, tuple frame)
