cimport cython
from miro_robot.parts.i2c cimport I2cTarget

cdef long long _NEVER
cdef int _NARROW_BYTES, _ADDRESS_PINS, _WP_BIT


cdef class At24cPart(I2cTarget):
    cdef readonly int size, page_size, address_pins
    cdef readonly long long write_ticks
    cdef public bytes memory
    cdef public int address, to_come
    cdef public unsigned char page[32]
    cdef public unsigned char loaded[32]
    cdef public long long writes

    cpdef int addressed(self, int byte, long long tick) except -1
    @cython.locals(above=int, place=int)
    cpdef int received(self, int byte, long long tick) except -1
    @cython.locals(byte=int)
    cpdef int transmit(self, long long tick) except -1
    @cython.locals(place=int)
    cpdef ended(self, long long tick)
    cpdef woken(self, long long tick)
    @cython.locals(first=int, place=int)
    cdef _store(self, int erased)
    @cython.locals(place=int)
    cdef int _forget(self) except -1
