cimport cython

cdef int _OFF, _STOP, _DRIVE, _RESET, _STT, _LTRJ, _NO_WORD
cdef int _WORD_OFF, _WORD_STOPS, _WORD_ABRUPT, _VELOCITY_MODE, _FORWARD
cdef int _ACCELERATION, _ACCELERATION_RELATIVE, _VELOCITY, _VELOCITY_RELATIVE


cdef class WheelOrders:
    cdef int _control[2]
    cdef long long _velocity[2]
    cdef long long _acceleration[2]
    cdef int _what[2]
    cdef long long _speed[2]
    cdef long long _started[2]
    cdef int _abrupt[2]

    @cython.locals(side=int)
    cpdef void begin(self) noexcept
    cpdef bint take(self, int side, int opcode, int size, long long high, long long low) noexcept
    cpdef int what(self, int side) noexcept
    cpdef long long velocity(self, int side) noexcept
    cpdef long long acceleration(self, int side) noexcept
    cpdef bint abrupt(self, int side) noexcept
    cpdef bint moves(self, int side) noexcept
    cpdef int word(self, int side) noexcept
    cdef void _reset(self, int side) noexcept
    @cython.locals(control=int, backward=bint)
    cdef void _start(self, int side) noexcept
    @cython.locals(control=int, at=int, value='long long', relative=bint)
    cdef void _load(self, int side, int size, long long high, long long low) noexcept


@cython.locals(value='long long', place=int)
cdef long long _number(int size, long long high, long long low, int at) noexcept
@cython.locals(behind=int)
cdef int _byte(int size, long long high, long long low, int at) noexcept
