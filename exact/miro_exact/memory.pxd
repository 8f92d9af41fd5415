# C layout of miro_exact.memory.

cdef struct Place:
    char *at  # of the field inside its part
    Py_ssize_t size  # bytes of one item
    Py_ssize_t count  # items; of a queue: for how many it has room
    char code  # as in Python's `struct`
    bint bounded  # whether an item may be out of range
    long long low
    long long high
    double least
    double most
    char *end  # of a queue: the field with its length, else NULL
    Py_ssize_t end_size


cdef class Layout:
    cdef Place *places  # their addresses count from the start of a part
    cdef Py_ssize_t number
    cdef tuple names


cdef class Memory:
    cdef Place *places
    cdef Py_ssize_t number
    cdef Place *spans  # what is copied in one go: fields that are neighbours
    cdef Py_ssize_t span_count
    cdef Py_ssize_t *looked_at  # before packing: the places that are queues or may hold NaN
    cdef Py_ssize_t looked_at_count
    cdef Py_ssize_t fixed  # bytes of all that are no queues
    cdef list groups  # they hold the parts
    cdef bytes data
    cdef Py_ssize_t begin

    cpdef bytes pack(self)
    cpdef Py_ssize_t check(self, bytes data, Py_ssize_t begin) except -1
    cpdef put(self)
    cdef str name(self, Py_ssize_t number)
    cdef int join(self) except -1
    cdef Py_ssize_t size(self) except -1
    cdef void write(self, char *to) noexcept
    cdef int check_items(self, Place *place, Py_ssize_t index, const char *data, Py_ssize_t count) except -1


cdef class Attributes:
    cdef list fields
    cdef object slow
    cdef char *buffer
    cdef Py_ssize_t used, capacity

    cpdef bytes pack(self)
    cdef int add(self, value, int shape, bytes codes, Py_ssize_t count, split) except -1
    cdef int add_row(self, row, bytes codes, split) except -1
    cdef int add_length(self, Py_ssize_t length) except -1
    cdef int add_cell(self, value, char code) except -1
    cdef char *room(self, Py_ssize_t size) except NULL
