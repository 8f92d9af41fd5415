cimport cython

from miro_robot.lm629.axis cimport MotorAxis


cdef int _HELD, _RESETTING, _RUNNING
cdef int _MOTOR_OFF, _ON_TARGET, _STOP_ON_ERROR, _UPDATE_PENDING, _ACQUIRE_INDEX


@cython.final
cdef class Lm629(MotorAxis):
    cpdef void set_encoder(self, long long tick, int a, int b) noexcept
    cpdef void set_index(self, long long tick, int level) noexcept
    @cython.locals(outcome=cython.int)
    cpdef int set_bus(self, long long tick, int cs, int rd, int wr, int ps, int data) except -1
    cpdef int data_out(self, long long tick) noexcept
    cpdef int status_at(self, long long tick) noexcept
