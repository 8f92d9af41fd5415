"""Copies the fields of compiled parts to flat bytes and back, and packs those of other parts.

`state.py` says which fields there are and in what order, and what is wrong with a value. Used by the compiled engine
only, so it has no uncompiled twin: tests/exact/test_state.py compares the bytes with those of `state.py`.

The parts must outlive a Memory, which therefore holds them. A part's fields stay where they are as long as it lives.
"""

from cpython.bytes cimport PyBytes_AS_STRING, PyBytes_FromStringAndSize
from cpython.long cimport PyLong_AsLongLong, PyLong_Check
from cpython.mem cimport PyMem_Calloc, PyMem_Free, PyMem_Realloc
from cpython.tuple cimport PyTuple_Check, PyTuple_GET_ITEM, PyTuple_GET_SIZE
from libc.string cimport memcpy

import sys

from miro_exact.domain import DomainError
from miro_exact.fields import BLOCK, ITEMS, MEMORY, NUMBER, OCTETS, ROW


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


cdef bint LITTLE = sys.byteorder == "little"


cdef void copy(char *to, const char *source, Py_ssize_t size, Py_ssize_t count) noexcept:
    """`count` items, little-endian on one of both sides."""
    cdef Py_ssize_t item, byte
    if LITTLE or size == 1:
        if count == 1 and size == 4:
            memcpy(to, source, 4)
        elif count == 1 and size == 8:
            memcpy(to, source, 8)
        else:
            memcpy(to, source, size * count)
        return
    for item in range(count):
        for byte in range(size):
            to[item * size + byte] = source[item * size + size - 1 - byte]


cdef long long length(const char *at, Py_ssize_t size) noexcept:
    """The length of a queue, an int or a long long."""
    cdef int small
    cdef long long big
    if size == 4:
        memcpy(&small, at, 4)
        return small
    memcpy(&big, at, 8)
    return big


cdef void set_length(char *at, Py_ssize_t size, long long value) noexcept:
    cdef int small = <int>value
    if size == 4:
        memcpy(at, &small, 4)
    else:
        memcpy(at, &value, 8)


cdef class Layout:
    """Neighbouring fields of a class, from those of one part: (name, address, item size, items, code, low, high, end).

    `low` and `high` are None where every value of the type will do; `end` is None, or (address, size).
    """

    cdef Place *places  # their addresses count from the start of a part
    cdef Py_ssize_t number
    cdef tuple names

    def __cinit__(self, part, list fields):
        cdef Place *place
        cdef size_t begin = <size_t><void *>part
        self.number = len(fields)
        self.places = <Place *>PyMem_Calloc(max(1, self.number), sizeof(Place))
        if self.places == NULL:
            raise MemoryError
        self.names = tuple(field[0] for field in fields)
        for index, (_, address, size, count, code, low, high, end) in enumerate(fields):
            place = &self.places[index]
            place.at = <char *>(<size_t>address - begin)
            place.size = size
            place.count = count
            place.code = ord(code)
            place.bounded = low is not None or code == "d"
            if code == "d":
                place.least = -float("inf") if low is None else low
                place.most = float("inf") if high is None else high
            elif low is not None:
                place.low = low
                place.high = high
            if end is not None:
                place.end = <char *>(<size_t>end[0] - begin)
                place.end_size = end[1]

    def __dealloc__(self):
        PyMem_Free(self.places)


cdef class Memory:
    """Fields in their order, of groups: each is (part, what stands before the names of its fields, layout)."""

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

    def __cinit__(self, list groups):
        cdef Layout layout
        cdef Place *place
        cdef Py_ssize_t index, number = 0
        cdef size_t begin
        self.groups = groups
        for _, _, layout in groups:
            self.number += layout.number
        self.places = <Place *>PyMem_Calloc(max(1, self.number), sizeof(Place))
        self.looked_at = <Py_ssize_t *>PyMem_Calloc(max(1, self.number), sizeof(Py_ssize_t))
        if self.places == NULL or self.looked_at == NULL:
            raise MemoryError
        for part, _, layout in groups:
            begin = <size_t><void *>part
            for index in range(layout.number):
                place = &self.places[number]
                place[0] = layout.places[index]
                place.at += begin
                if place.end != NULL:
                    place.end += begin
                else:
                    self.fixed += place.size * place.count
                if place.end != NULL or place.code == c"d":
                    self.looked_at[self.looked_at_count] = number
                    self.looked_at_count += 1
                number += 1
        self.join()

    cdef str name(self, Py_ssize_t number):
        """Of a field, for messages."""
        cdef Layout layout
        for _, prefix, layout in self.groups:
            if number < layout.number:
                return prefix + layout.names[number]
            number -= layout.number

    cdef int join(self) except -1:
        """Fields that lie next to each other in their part as they do in the bytes are one span."""
        cdef Py_ssize_t index
        cdef Place *place
        cdef Place *span = NULL
        self.spans = <Place *>PyMem_Calloc(max(1, self.number), sizeof(Place))
        if self.spans == NULL:
            raise MemoryError
        for index in range(self.number):
            place = &self.places[index]
            if LITTLE and span != NULL and span.end == NULL and place.end == NULL:
                if place.at == span.at + span.size * span.count:
                    span.count = span.size * span.count + place.size * place.count
                    span.size = 1
                    continue
            span = &self.spans[self.span_count]
            span[0] = place[0]
            self.span_count += 1
        return 0

    def __dealloc__(self):
        PyMem_Free(self.places)
        PyMem_Free(self.spans)
        PyMem_Free(self.looked_at)

    cdef Py_ssize_t size(self) except -1:
        """Bytes of the fields. Raises DomainError for NaN, ValueError for a queue that is too long, with its name."""
        cdef Py_ssize_t look, index, item, total = self.fixed
        cdef long long count
        cdef double real
        cdef Place *place
        for look in range(self.looked_at_count):
            index = self.looked_at[look]
            place = &self.places[index]
            if place.end == NULL:
                for item in range(place.count):
                    memcpy(&real, place.at + 8 * item, 8)
                    if real != real:
                        raise DomainError(f"{self.name(index)} is NaN")
                continue
            count = length(place.end, place.end_size)
            if count < 0 or count > place.count:
                raise ValueError(f"{self.name(index)}: {count} items, room for {place.count}")
            total += 4 + place.size * count
        return total

    cpdef bytes pack(self):
        """The fields as flat bytes. Raises as `size` does."""
        cdef bytes data = PyBytes_FromStringAndSize(NULL, self.size())
        self.write(PyBytes_AS_STRING(data))
        return data

    cdef void write(self, char *to) noexcept:
        """Puts the fields there, after `size` has found them good."""
        cdef Py_ssize_t index, count
        cdef unsigned int written
        cdef Place *span
        for index in range(self.span_count):
            span = &self.spans[index]
            count = span.count
            if span.end != NULL:
                count = length(span.end, span.end_size)
                written = <unsigned int>count
                copy(to, <char *>&written, 4, 1)
                to += 4
            copy(to, span.at, span.size, count)
            to += span.size * count

    cpdef Py_ssize_t check(self, bytes data, Py_ssize_t begin) except -1:
        """Where what `pack` gave ends in `data`. Raises ValueError for bytes that cannot be put, and puts nothing."""
        cdef const char *source = PyBytes_AS_STRING(data)
        cdef Py_ssize_t at = begin, left, count, shared = 0
        cdef Py_ssize_t index
        cdef unsigned int written
        cdef Place *place
        cdef char *end = NULL
        for index in range(self.number):
            place = &self.places[index]
            left = len(data) - at
            count = place.count
            if place.end != NULL:
                if left < 4:
                    raise ValueError(f"the state ends in {self.name(index)}")
                copy(<char *>&written, source + at, 4, 1)
                if written > count:
                    raise ValueError(f"{self.name(index)} has {written} items, not at most {count}")
                count = written
                if place.end == end and count != shared:
                    raise ValueError(f"{self.name(index)} has {count} items, not {shared}")
                end = place.end
                shared = count
                at += 4
                left -= 4
            if left < count * place.size:
                raise ValueError(f"the state ends in {self.name(index)}")
            if place.bounded:
                self.check_items(place, index, source + at, count)
            at += count * place.size
        self.data = data
        self.begin = begin
        return at

    cdef int check_items(self, Place *place, Py_ssize_t index, const char *data, Py_ssize_t count) except -1:
        cdef Py_ssize_t item
        cdef long long value
        cdef int small
        cdef double real
        for item in range(count):
            if place.code == c"d":
                copy(<char *>&real, data + 8 * item, 8, 1)
                if not place.least <= real <= place.most:
                    raise ValueError(f"{self.name(index)} is {real}, not from {place.least} to {place.most}")
                continue
            if place.code == c"q":
                copy(<char *>&value, data + 8 * item, 8, 1)
            elif place.code == c"i":
                copy(<char *>&small, data + 4 * item, 4, 1)
                value = small
            else:
                value = <unsigned char>data[item]
            if not place.low <= value <= place.high:
                raise ValueError(f"{self.name(index)} is {value}, not from {place.low} to {place.high}")
        return 0

    cpdef put(self):
        """Writes the fields from the bytes that were checked last. Raises ValueError if none were."""
        cdef const char *source
        cdef Py_ssize_t index, count
        cdef unsigned int written
        cdef Place *span
        if self.data is None:
            raise ValueError("nothing was checked")
        source = PyBytes_AS_STRING(self.data) + self.begin
        for index in range(self.span_count):
            span = &self.spans[index]
            count = span.count
            if span.end != NULL:
                copy(<char *>&written, source, 4, 1)
                source += 4
                count = written
                set_length(span.end, span.end_size, count)
            copy(span.at, source, span.size, count)
            source += span.size * count


cdef int _NUMBER = NUMBER, _ITEMS = ITEMS, _OCTETS = OCTETS, _ROW = ROW, _MEMORY = MEMORY, _BLOCK = BLOCK


cdef class Attributes:
    """Fields that are Python objects, and a Memory wherever some are not, packed in one go.

    Each is (part, name, shape, codes, number of items, split): the shape is NUMBER or one of its neighbours, the codes
    are those of the cells, a number that is no array has 0 items. A Memory is the part of a field of shape MEMORY, and
    anything with a method `pack` of one of shape BLOCK; these have no name. `slow` packs the same fields, and says what
    is wrong with one: where a value is odd, it is asked.
    """

    cdef list fields
    cdef object slow
    cdef char *buffer
    cdef Py_ssize_t used, capacity

    def __cinit__(self, list fields, slow):
        self.fields = fields
        self.slow = slow

    def __dealloc__(self):
        PyMem_Free(self.buffer)

    cpdef bytes pack(self):
        """The fields as flat bytes. Raises what `slow` raises."""
        cdef tuple field
        cdef Memory memory
        cdef bytes packed
        self.used = 0
        try:
            for field in self.fields:
                if field[2] == _MEMORY:
                    memory = field[0]
                    memory.write(self.room(memory.size()))
                elif field[2] == _BLOCK:
                    packed = field[0].pack()
                    memcpy(self.room(len(packed)), PyBytes_AS_STRING(packed), len(packed))
                elif self.add(getattr(field[0], field[1]), field[2], field[3], field[4], field[5]):
                    return self.slow()
        except Exception:
            return self.slow()
        return PyBytes_FromStringAndSize(self.buffer, self.used)

    cdef int add(self, value, int shape, bytes codes, Py_ssize_t count, split) except -1:
        """Appends a field; 1 if there is something about it."""
        cdef char code = PyBytes_AS_STRING(codes)[0]
        cdef Py_ssize_t length
        if shape == _NUMBER and not count:
            return self.add_cell(value, code)
        if shape == _OCTETS:
            return self.add_cell(value, c"s")
        if shape == _ROW:
            return self.add_row(value, codes, split)
        length = len(value)
        if length > count or (shape == _NUMBER and length != count):
            return 1
        if shape != _NUMBER:
            self.add_length(length)
        if shape == _NUMBER or shape == _ITEMS:
            for item in value:
                if self.add_cell(item, code):
                    return 1
            return 0
        for item in value:
            if self.add_row(item, codes, split):
                return 1
        return 0

    cdef int add_row(self, row, bytes codes, split) except -1:
        cells = row if split is None else split(row)
        cdef Py_ssize_t index
        if not PyTuple_Check(cells) or PyTuple_GET_SIZE(cells) != len(codes):
            return 1
        for index in range(len(codes)):
            if self.add_cell(<object>PyTuple_GET_ITEM(cells, index), PyBytes_AS_STRING(codes)[index]):
                return 1
        return 0

    cdef int add_length(self, Py_ssize_t length) except -1:
        cdef unsigned int written = <unsigned int>length
        copy(self.room(4), <char *>&written, 4, 1)
        return 0

    cdef int add_cell(self, value, char code) except -1:
        cdef double real
        cdef long long big
        cdef int small
        cdef unsigned char byte
        if code == c"d":
            real = value
            copy(self.room(8), <char *>&real, 8, 1)
            return real != real
        if code == c"s":
            self.add_length(len(value))
            memcpy(self.room(len(value)), PyBytes_AS_STRING(<bytes?>value), len(value))
            return 0
        if code == c"?":
            self.room(1)[0] = <bint>value
            return 0
        if not PyLong_Check(value):
            return 1
        big = PyLong_AsLongLong(value)
        if code == c"q":
            copy(self.room(8), <char *>&big, 8, 1)
            return 0
        if code == c"B":
            self.room(1)[0] = <char>big
            return not 0 <= big <= 0xFF
        small = <int>big
        copy(self.room(4), <char *>&small, 4, 1)
        if code == c"i":
            return big != small
        return code != c"I" or not 0 <= big <= 0xFFFFFFFF

    cdef char *room(self, Py_ssize_t size) except NULL:
        """Where the next `size` bytes belong."""
        cdef char *larger
        if self.used + size > self.capacity:
            larger = <char *>PyMem_Realloc(self.buffer, 2 * (self.used + size))
            if larger == NULL:
                raise MemoryError
            self.buffer = larger
            self.capacity = 2 * (self.used + size)
        self.used += size
        return self.buffer + self.used - size
