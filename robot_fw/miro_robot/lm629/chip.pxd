cimport cython

from miro_robot.lm629.axis cimport MotorAxis
from miro_robot.lm629.buffers cimport TrajectoryBuffer, fit_15
from miro_robot.lm629.trajectory cimport ProfileGenerator


cdef long long _NEVER, _SAMPLE_TICKS, _PWM_TICKS
cdef int _HELD, _RESETTING, _RUNNING
cdef int _MOTOR_OFF, _ON_TARGET, _STOP_ON_ERROR, _UPDATE_PENDING, _ACQUIRE_INDEX
cdef int _COMMAND_ERROR, _ACCELERATION_LOADED, _OUTPUT_8_BIT
cdef int _COMMAND_CAME, _WORD_CAME, _ANSWERED, _SOFTWARE_RESET
cdef int _STOPS, _COMPLETED, _OUT_OF_RANGE, _COMMAND
cdef long long _SEVEN_BYTES
cdef int _RESET, _STT, _DFH, _SIP, _UDF, _PORT8, _PORT12
cdef int _RDDV, _RDDP, _RDIP, _RDRP, _RDRV, _RDSIGS
cdef int _LPES, _LPEI, _MSKI, _RSTI, _LFIL, _LTRJ, _SBPA, _SBPR
cdef unsigned char _WORDS_IN[256]
cdef unsigned char _WORDS_OUT[256]


@cython.final
cdef class Lm629(MotorAxis):
    cpdef void set_encoder(self, long long tick, int a, int b) noexcept
    cpdef void set_index(self, long long tick, int level) noexcept
    cpdef int set_bus(self, long long tick, int cs, int rd, int wr, int ps, int data) except -1
    cdef int _host(self, long long tick, int outcome) except -1
    @cython.locals(high=cython.longlong, low=cython.longlong)
    cdef int _finished(self, long long tick) except -1
    cdef int _command(self, long long tick) except -1
    cdef int _execute(self, long long tick, int opcode) except -1
    cdef int _complain(self, flags) except -1
    cdef int _accept_start(self) except -1
    cdef _answer(self, long long tick, int opcode)
    cdef int _word(self, long long tick) except -1
    cdef _trajectory_word(self, int word)
    cdef int _filter_word(self, int word) except -1
    cdef int _load(self, int opcode) except -1
    cpdef int data_out(self, long long tick) noexcept
    cpdef int after_load(self) except -1
    cpdef int check_times(self, long long earliest_tick) except -1
    cpdef int status_at(self, long long tick) noexcept
    cdef long long _due_tick(self) noexcept
