cimport cython

from miro_robot.event_log cimport EventLog
from miro_robot.lm629.buffers cimport FilterBuffer, TrajectoryBuffer, signed_31
from miro_robot.lm629.encoder cimport Encoder
from miro_robot.lm629.host_port cimport HostPort
from miro_robot.lm629.pid cimport Pid
from miro_robot.lm629.signals cimport Signals
from miro_robot.lm629.trajectory cimport ProfileGenerator


cdef long long _NEVER, _SAMPLE_TICKS, _PWM_TICKS
cdef int _HELD, _RESETTING, _RUNNING
cdef int _MOTOR_OFF, _ON_TARGET, _STOP_ON_ERROR, _UPDATE_PENDING, _ACQUIRE_INDEX
cdef int _BREAKPOINT, _EXCESSIVE_ERROR, _WRAP_AROUND, _INDEX_ACQUIRED, _TRAJECTORY_COMPLETE
cdef int _VELOCITY_MODE, _FORWARD, _TURN_OFF, _STOP_ABRUPTLY, _STOP_SMOOTHLY


cdef int _side(long long value) noexcept


cdef class MotorAxis:
    cdef readonly object options
    cdef readonly long long reset_ticks
    cdef readonly int rounds_down, negative, pulse_late, keeps_sign, open_clears, error_full, error_repeats, clamps
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
    cdef public long long next_tick, sample_tick, period_tick, reset_tick
    cdef public int mode, reset_level, start_taken
    cdef public long long threshold, real_position, real_velocity, index_position, breakpoint
    cdef public int breakpoint_armed, breakpoint_side, excessive
    cdef public int pwm, pwm_magnitude, sign, hi, pulses

    cpdef set_reset(self, long long tick, int level)
    cpdef _enter_reset(self, int mode, int lock, long long until_tick)
    cdef _end_reset(self, long long now)
    cpdef int advance(self, long long tick) except -1
    cpdef rest(self, long long tick)
    @cython.final
    cdef inline int _period(self, long long now) except -1
    cdef bint _late_pulse_begins(self, long long now) noexcept
    @cython.final
    cdef inline int _sample(self, long long now) except -1
    @cython.final
    cdef inline int _latch_position(self, long long now) noexcept
    cdef int _start(self) except -1
    cdef long long _relative_base(self) except? 1
    @cython.final
    cdef inline int _step_profile(self) noexcept
    @cython.final
    cdef inline int _check_error(self, long long error) noexcept
    @cython.final
    cdef inline void _put_out(self, int drive) noexcept
    @cython.final
    cdef inline int _check_breakpoint(self) noexcept
    cpdef int set_breakpoint(self, long long place) except -1
    cpdef long long live_position(self, long long tick) except? -1
