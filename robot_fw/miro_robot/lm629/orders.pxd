cdef int ACCELERATION, FORWARD, MOTOR_OFF, STOP_ABRUPTLY, STOPS, VELOCITY, VELOCITY_MODE
cdef int _RESET, _STT, _LTRJ, _NO_WORD


cdef class WheelOrder:
    cdef readonly str what
    cdef readonly long long velocity, acceleration
    cdef readonly bint abrupt
    cdef int _control
    cdef long long _velocity, _acceleration

    cpdef begin(self)
    cpdef bint take(self, int opcode, int size, long long high, long long low) except -1
    cpdef bint moves(self) noexcept
    cpdef int word(self) noexcept
    cdef int _start(self) except -1
    cdef int _load(self, int size, long long high, long long low) except -1


cdef long long _number(int size, long long high, long long low, int at) noexcept
cdef int _byte(int size, long long high, long long low, int at) noexcept
