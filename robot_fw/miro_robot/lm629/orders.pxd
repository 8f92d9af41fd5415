cdef int ACCELERATION, FORWARD, MOTOR_OFF, STOP_ABRUPTLY, STOPS, VELOCITY, VELOCITY_MODE
cdef int _RESET, _STT, _LTRJ, _NO_WORD


cdef class WheelOrder:
    cdef readonly str what
    cdef readonly long long velocity, acceleration
    cdef readonly bint abrupt
    cdef int _control
    cdef long long _velocity, _acceleration

    cpdef begin(self)
    cpdef bint take(self, int opcode, bytes data) except -1
    cpdef bint moves(self) noexcept
    cpdef int word(self) noexcept
    cdef int _start(self) except -1
    cdef int _load(self, bytes data) except -1
