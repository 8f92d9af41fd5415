"""What an LM629 does by itself as time goes by: resets, samples and the order inside one, PWM.

Time is in 24 MHz ticks; a chip clock is 4, a PWM period 2048, a sample 8192 of them. Rule names in comments (T1, D1,
...) are those of README.md in this folder.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.event_log import EventLog
from miro_robot.lm629 import buffers, host_port, signals
from miro_robot.lm629.buffers import FilterBuffer, TrajectoryBuffer, signed_31
from miro_robot.lm629.encoder import Encoder
from miro_robot.lm629.host_port import HostPort
from miro_robot.lm629.options import DEFAULT_OPTIONS, TICKS_PER_CLOCK, Lm629Options
from miro_robot.lm629.pid import Pid
from miro_robot.lm629.signals import Signals
from miro_robot.lm629.trajectory import ProfileGenerator

SAMPLE_TICKS = 8192
PWM_TICKS = 2048

_NEVER = NEVER_TICK
_PLACE = ("q", -(1 << 30), (1 << 30) - 1)  # the chip's position space
_SAMPLE_TICKS = SAMPLE_TICKS
_PWM_TICKS = PWM_TICKS
_HELD, _RESETTING, _RUNNING = 0, 1, 2
_MOTOR_OFF = signals.MOTOR_OFF
_ON_TARGET = signals.ON_TARGET
_STOP_ON_ERROR = signals.STOP_ON_ERROR
_UPDATE_PENDING = signals.UPDATE_PENDING
_ACQUIRE_INDEX = signals.ACQUIRE_INDEX
_BREAKPOINT = signals.BREAKPOINT
_EXCESSIVE_ERROR = signals.EXCESSIVE_ERROR
_WRAP_AROUND = signals.WRAP_AROUND
_INDEX_ACQUIRED = signals.INDEX_ACQUIRED
_TRAJECTORY_COMPLETE = signals.TRAJECTORY_COMPLETE
_VELOCITY_MODE, _FORWARD = buffers.VELOCITY_MODE, buffers.FORWARD
"""They stand in the same place in the control word and in the signals register."""
_TURN_OFF, _STOP_ABRUPTLY, _STOP_SMOOTHLY = buffers.MOTOR_OFF, buffers.STOP_ABRUPTLY, buffers.STOP_SMOOTHLY


def _side(value: int) -> int:
    return 1 if value > 0 else -1 if value < 0 else 0


class MotorAxis:
    """One motor's controller without its host; `Lm629` adds that."""

    STATE = {
        "port": HostPort,
        "encoder": Encoder,
        "trajectory": ProfileGenerator,
        "pid": Pid,
        "signals": Signals,
        "trajectory_buffer": TrajectoryBuffer,
        "filter_buffer": FilterBuffer,
        "mode": ("i", 0, 2),
        "reset_level": FLAG,
        "reset_tick": TICK,
        "threshold": ("q", 0, 0x7FFF),
        "next_tick": TICK,
        "sample_tick": TICK,
        "period_tick": TICK,
        "real_position": _PLACE,
        "real_velocity": ("q", -(1 << 40), 1 << 40),
        "index_position": _PLACE,
        "breakpoint": _PLACE,
        "breakpoint_armed": FLAG,
        "breakpoint_side": ("i", -1, 1),
        "start_taken": FLAG,
        "pwm": FLAG,
        "pwm_magnitude": ("i", 0, 127),
        "sign": FLAG,
        "excessive": FLAG,
    }
    NOT_STATE = (
        *("options", "reset_ticks", "rounds_down", "negative", "pulse_late", "keeps_sign", "open_clears"),
        *("error_full", "error_repeats", "clamps", "commands", "encoder_edges", "log", "side", "pulses"),
        *("hi", "writes_while_busy"),  # copies of what the parts hold
    )

    def __init__(self, options: Lm629Options = DEFAULT_OPTIONS) -> None:
        self.options = options
        self.reset_ticks = options.reset_clocks * TICKS_PER_CLOCK
        self.rounds_down = 1 if options.output_rounding == "down" else 0
        self.negative = options.sign_of_negative
        self.pulse_late = 1 if options.pulse_at == "end" else 0
        self.keeps_sign = 1 if options.off_keeps_sign else 0
        self.open_clears = 1 if options.open_loop_clears else 0
        self.error_full = 1 if options.error_test == "full" else 0
        self.error_repeats = 1 if options.error_flag_repeats else 0
        self.clamps = 1 if options.out_of_range == "clamped" else 0
        self.port = HostPort(options.busy_clocks * TICKS_PER_CLOCK, options)
        self.encoder = Encoder(options.filter_clocks, options.double_step)
        self.trajectory = ProfileGenerator(options.stop_keeps_fraction)
        self.pid = Pid(options.pid_saturates, options.sum_rounding == "down")
        self.signals = Signals(options)
        self.trajectory_buffer = TrajectoryBuffer()
        self.filter_buffer = FilterBuffer()
        self.commands: list[tuple[int, int, bytes]] = []
        self.encoder_edges: list[tuple[int, int, int]] | None = None
        self.log: EventLog | None = None
        self.side = 0
        self.pulses = 1  # 0: nobody sees the magnitude pin, which stays low
        self.writes_while_busy = 0
        self.reset_level = 1
        self.reset_tick = 0
        self.threshold = 0x7FFF
        self.next_tick = _NEVER
        self.index_position = 0
        self._enter_reset(_HELD, host_port.HARDWARE_RESET, _NEVER)

    # ------------------------------------------------------------------------------------------ reset

    def set_reset(self, tick: int, level: int) -> None:
        """Level of /RST from `tick` on."""
        if self.next_tick <= tick:
            self.advance(tick)
        if level == self.reset_level:
            return
        self.reset_level = level
        if level == 0:
            self.reset_tick = tick
            self.threshold = 0x7FFF
            self.encoder.settle(tick)
            self._enter_reset(_HELD, host_port.HARDWARE_RESET, _NEVER)
        elif tick - self.reset_tick >= self.options.reset_pulse_clocks * TICKS_PER_CLOCK:
            self.mode = _RESETTING
            self.next_tick = (tick + 3 & -4) + self.reset_ticks

    def _enter_reset(self, mode: int, lock: int, until_tick: int) -> None:
        """Everything but the error threshold and the encoder's inputs falls back to zero (R5, R6).

        The encoder has been settled: what it caught before this tick ends the wait for an index.
        """
        clears_index = self.options.reset_clears_index
        self.mode = mode
        self.next_tick = until_tick
        self.sample_tick = _NEVER
        self.period_tick = 0
        self.port.reset(lock)
        self.encoder.clear(clears_index)
        self.trajectory.reset()
        self.trajectory_buffer.reset()
        self.filter_buffer.reset()
        self.pid.load(0, 0, 0, 0, 0)
        self.pid.open_loop()
        kept = 0
        if lock == host_port.SOFTWARE_RESET and not self.options.reset_clears_lpes:
            kept = self.signals.word & _STOP_ON_ERROR
        if self.encoder.armed:
            kept |= _ACQUIRE_INDEX
        self.signals.during_reset(kept)
        self.excessive = 0
        self.real_position = 0
        self.real_velocity = 0
        if clears_index:
            self.index_position = 0
        self.breakpoint = 0
        self.breakpoint_armed = 0
        self.breakpoint_side = 0
        self.start_taken = 0
        self.pwm = 0
        self.pwm_magnitude = 0
        self.sign = 0
        self.hi = 0

    def _end_reset(self, now: int) -> None:
        """Status 84h; sample counter and PWM period start here (R4)."""
        self.mode = _RUNNING
        self.encoder.settle(now)
        self.encoder.clear(self.options.reset_clears_index)
        if not self.encoder.armed:
            self.signals.word &= ~_ACQUIRE_INDEX
        self.port.reset(host_port.OPEN)
        self.signals.after_reset()
        self.hi = self.signals.word >> 15
        self.breakpoint_armed = 0 if self.options.reset_disarms_breakpoint else 1
        self.sample_tick = now + _SAMPLE_TICKS
        if not self.options.reset_restarts_samples:
            self.sample_tick -= now % _SAMPLE_TICKS
        self.next_tick = self.sample_tick

    # ------------------------------------------------------------------------------------------ time

    def advance(self, tick: int) -> None:
        """Do everything the chip does by itself up to and including `tick`."""
        while self.next_tick <= tick:
            now = self.next_tick
            if self.mode != _RUNNING:
                self._end_reset(now)
            elif self.pwm and not self.pulse_late:
                self.pwm = 0
                self.next_tick = self.period_tick + _PWM_TICKS
            elif self.pulse_late and self._late_pulse_begins(now):
                self.pwm = 1
                self.next_tick = self.period_tick + _PWM_TICKS
            else:
                self._period(now)

    def rest(self, tick: int) -> None:
        """Makes a sample of an unplugged motor that is off, and passes those up to `tick` that find what it left.

        The last of them is left, and all where there are fewer than three.
        """
        now = self.next_tick
        if self.pulses or now + 2 * _SAMPLE_TICKS > tick:
            return
        self.advance(now)
        if self.signals.word & _MOTOR_OFF and self.encoder.quadrature.due == _NEVER:
            passed = (tick - self.next_tick) // _SAMPLE_TICKS * _SAMPLE_TICKS
            self.next_tick += passed
            self.sample_tick += passed

    def _period(self, now: int) -> None:
        """A PWM period begins, every fourth with a sample."""
        self.period_tick = now
        if now == self.sample_tick:
            self.sample_tick = now + _SAMPLE_TICKS
            self._sample(now)
        self.pwm = 0
        if self.pwm_magnitude == 0 or self.pulses == 0:
            self.next_tick = self.sample_tick
        elif self.pulse_late:
            self.next_tick = now + _PWM_TICKS - 16 * self.pwm_magnitude
        else:
            self.pwm = 1
            self.next_tick = now + 16 * self.pwm_magnitude

    def _late_pulse_begins(self, now: int) -> bool:
        """O3 read the other way: the pulse is at the end of its period."""
        if self.pwm or self.pwm_magnitude == 0:
            return False
        return now == self.period_tick + _PWM_TICKS - 16 * self.pwm_magnitude

    def _sample(self, now: int) -> None:
        """One sample; its order is chosen (README.md, "Inside a sample")."""
        flags = self._latch_position(now)
        if self.signals.word & _MOTOR_OFF:
            self.trajectory.follow(self.real_position)
        if self.start_taken:
            flags |= self._start()
        if self.signals.word & _UPDATE_PENDING:
            self._update_filter()
        drive = 0
        if not self.signals.word & _MOTOR_OFF:
            flags |= self._step_profile()
            error = signed_31((self.trajectory.position >> 16) - self.real_position)
            flags |= self._check_error(error)
            if not self.signals.word & _MOTOR_OFF:
                drive = self.pid.step(error)
        if self.signals.word & _MOTOR_OFF:
            self.trajectory.follow(self.real_position)
            self.excessive = 0
            if self.open_clears:
                self.pid.open_loop()
        self._put_out(drive)
        flags |= self._check_breakpoint()
        self.signals.raise_flags(flags)
        self.signals.word &= ~_UPDATE_PENDING
        self.hi = self.signals.word >> 15

    def _latch_position(self, now: int) -> int:
        """Take the counts since the last sample, and an index that was caught among them."""
        self.encoder.settle(now)
        flags = 0
        if self.encoder.caught:
            self.index_position = signed_31(self.real_position + self.encoder.caught_counts)
            self.encoder.caught = 0
            self.signals.word &= ~_ACQUIRE_INDEX
            flags = _INDEX_ACQUIRED
        self.real_velocity = self.encoder.counts
        moved = self.real_position + self.encoder.counts
        self.real_position = signed_31(moved)
        self.encoder.counts = 0
        if self.real_position != moved:
            flags |= _WRAP_AROUND
        return flags

    def _start(self) -> int:
        """The accepted STT takes effect. Returns flags."""
        profile = self.trajectory
        buffer = self.trajectory_buffer
        if self.options.start_takes == "sample":
            buffer.take(self.options.stop_bits_stay)
        control = buffer.taken_control
        profile.target = buffer.resolve(self._relative_base())
        profile.acceleration = buffer.taken_acceleration
        profile.max_velocity = buffer.taken_velocity
        profile.velocity_mode = 1 if control & _VELOCITY_MODE else 0
        profile.forward = 1 if control & _FORWARD else 0
        self.start_taken = 0
        self.signals.word &= ~(_MOTOR_OFF | _ON_TARGET | _VELOCITY_MODE | _FORWARD)
        self.signals.word |= control & (_VELOCITY_MODE | _FORWARD)
        if control & _TURN_OFF:
            self.signals.word |= _MOTOR_OFF
            return _TRAJECTORY_COMPLETE
        if control & _STOP_ABRUPTLY:
            at_real = self.options.abrupt_stop_at == "real"
            profile.stop_abruptly(self.real_position if at_real else profile.position >> 16)
            self.signals.word |= _ON_TARGET
            return _TRAJECTORY_COMPLETE
        if control & _STOP_SMOOTHLY:
            profile.stop_smoothly()
        else:
            profile.start()
        return 0

    def _update_filter(self) -> None:
        """The accepted UDF takes effect."""
        buffer = self.filter_buffer
        self.pid.load(buffer.taken_kp, buffer.taken_ki, buffer.taken_kd, buffer.taken_il, buffer.taken_ds)
        if self.options.update_clears:
            self.pid.open_loop()

    def _relative_base(self) -> int:
        """What a relative position adds to (T6)."""
        if self.options.relative_base == "real":
            return self.real_position
        if self.options.relative_base == "target" and not self.trajectory.velocity_mode:
            return self.trajectory.target
        return self.trajectory.position >> 16

    def _step_profile(self) -> int:
        flags = 0
        if self.trajectory.moving:
            if self.trajectory.step():
                self.signals.word |= _ON_TARGET
                flags = _TRAJECTORY_COMPLETE
            if self.trajectory.crossed:
                flags |= _WRAP_AROUND
        return flags

    def _check_error(self, error: int) -> int:
        """Excessive position error; with LPES it turns the motor off."""
        if not self.error_full:
            error = max(-32768, min(error, 32767))
        before = self.excessive
        self.excessive = 0 if -self.threshold <= error <= self.threshold else 1
        if not self.excessive:
            return 0
        flags = _EXCESSIVE_ERROR if self.error_repeats or not before else 0
        if self.signals.word & _STOP_ON_ERROR:
            self.signals.word |= _MOTOR_OFF
            flags |= _TRAJECTORY_COMPLETE
        return flags

    def _put_out(self, drive: int) -> None:
        """16 bits to sign and 7-bit magnitude (O1, O2); a motor that is off gets none (O4)."""
        top = drive >> 8 if drive >= 0 or self.rounds_down else -(-drive >> 8)
        self.pwm_magnitude = min(127, -top if top < 0 else top)
        if not self.signals.word & _MOTOR_OFF:
            self.sign = self.negative if top < 0 else 1 - self.negative
        elif not self.keeps_sign:
            self.sign = 0

    def _check_breakpoint(self) -> int:
        if not self.breakpoint_armed:
            return 0
        side = _side(self.real_position - self.breakpoint)
        if side != 0 and (side == self.breakpoint_side or self.options.breakpoint_exact):
            return 0
        self.breakpoint_armed = 0
        return _BREAKPOINT

    def set_breakpoint(self, place: int) -> None:
        """Arms it; which side of it the axis is on now decides when it is passed."""
        self.breakpoint = signed_31(place)
        self.breakpoint_side = _side(self.real_position - self.breakpoint)
        self.breakpoint_armed = 1

    def live_position(self, tick: int) -> int:
        """Counts of the last sample and those since."""
        self.encoder.settle(tick)
        return signed_31(self.real_position + self.encoder.counts)
