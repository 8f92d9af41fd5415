cimport cython

from miro_robot.event_log cimport EventLog
from miro_robot.lm629.buffers cimport FilterBuffer, TrajectoryBuffer, fit_15, signed_31
from miro_robot.lm629.encoder cimport Encoder
from miro_robot.lm629.host_port cimport HostPort
from miro_robot.lm629.pid cimport Pid
from miro_robot.lm629.signals cimport Signals
from miro_robot.lm629.trajectory cimport ProfileGenerator

cdef long long NEVER_TICK, _SAMPLE_TICKS, _PWM_TICKS
cdef int _HELD, _RESETTING, _RUNNING, _OPEN, _HARDWARE_RESET, _SOFTWARE_RESET
cdef int _MOTOR_OFF, _ON_TARGET, _STOP_ON_ERROR, _UPDATE_PENDING, _ACQUIRE_INDEX, _ACCELERATION_LOADED, _OUTPUT_8_BIT
cdef int _INTERRUPT, _BREAKPOINT, _EXCESSIVE_ERROR, _WRAP_AROUND, _INDEX_ACQUIRED, _TRAJECTORY_COMPLETE, _COMMAND_ERROR
cdef int _VELOCITY_MODE, _FORWARD, _TURN_OFF, _STOP_ABRUPTLY, _STOP_SMOOTHLY, _STOPS, _COMPLETED, _OUT_OF_RANGE
cdef int _TAKEN, _FROM_OFF, _STOPS_AT_ONCE, _ARMED, _ON_THE_PLACE
cdef int COMMAND, START_LOST, WHEEL_LOST, _COMMAND_CAME, _WORD_CAME, _ANSWERED
cdef int _RESET, _STT, _DFH, _SIP, _UDF, _PORT8, _PORT12
cdef int _RDDV, _RDDP, _RDIP, _RDRP, _RDRV, _RDSIGS
cdef int _LPES, _LPEI, _MSKI, _RSTI, _LFIL, _LTRJ, _SBPA, _SBPR
cdef unsigned char _WORDS_IN[256]
cdef unsigned char _WORDS_OUT[256]

@cython.final
cdef class Lm629:
    cdef readonly object options
    cdef readonly long long reset_ticks
    cdef readonly int rounds_down, negative, pulse_late, keeps_sign, open_clears, error_full, error_repeats, clamps
    cdef readonly int shows_late, falls_late
    cdef readonly HostPort port
    cdef readonly Encoder encoder
    cdef readonly ProfileGenerator trajectory
    cdef readonly Pid pid
    cdef readonly Signals signals
    cdef readonly TrajectoryBuffer trajectory_buffer
    cdef readonly FilterBuffer filter_buffer
    cdef readonly EventLog log
    cdef readonly int side
    cdef public list commands, encoder_edges
    cdef public long long writes_while_busy
    cdef public long long next_tick, sample_tick, period_tick, reset_tick, hi_falls_tick
    cdef public int mode, reset_level, start_taken
    cdef public long long threshold, real_position, real_velocity, index_position, breakpoint
    cdef public int breakpoint_armed, excessive
    cdef public int pwm, pwm_magnitude, sign, hi, pulses

    cpdef set_reset(self, long long tick, int level)
    cdef _enter_reset(self, int mode, int lock, long long until_tick)
    cdef _end_reset(self, long long now)
    cpdef int advance(self, long long tick) except -1
    cpdef rest(self, long long tick)
    cdef inline void _put_hi(self, long long tick) noexcept
    cdef inline int _period(self, long long now) except -1
    cdef inline int _sample(self, long long now) except -1
    cdef inline int _latch_position(self, long long now) noexcept
    cdef int _start(self) except -1
    cdef inline void _show_start(self, int control) noexcept
    cdef _relative_base(self)
    cdef _commanded_target(self)
    cdef inline int _step_profile(self) noexcept
    cdef inline int _check_error(self, long long error, long long now) noexcept
    cdef inline void _put_out(self, int drive) noexcept
    cdef inline int _check_breakpoint(self) noexcept
    cpdef int set_breakpoint(self, long long place) except -1
    cpdef void set_encoder(self, long long tick, int a, int b) noexcept
    cpdef void set_index(self, long long tick, int level) noexcept
    cpdef int set_bus(self, long long tick, int cs, int rd, int wr, int ps, int data) except -1
    cdef int _host(self, long long tick, int outcome) except -1
    cdef int _finished(self, long long tick) except -1
    cdef int _command(self, long long tick) except -1
    cdef int _execute(self, long long tick, int opcode) except -1
    cdef int _complain(self, flags) except -1
    cdef int _accept_start(self, long long tick) except -1
    cdef int _take_start(self, long long tick, int control) except -1
    cdef _answer(self, long long tick, int opcode)
    cdef int _word(self, long long tick) except -1
    cdef _trajectory_word(self, int word)
    cdef int _filter_word(self, int word) except -1
    cdef int _load(self, int opcode) except -1
    cpdef int check_times(self, long long earliest_tick) except -1
    cdef long long _due_tick(self) noexcept
