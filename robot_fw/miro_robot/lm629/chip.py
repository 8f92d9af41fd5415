"""The LM629: its pins, what it does as time goes by, and what each command of the host does.

                +--------v--------+
       /IN    1 |                 | 28  VDD        A B, /IN   encoder: `set_encoder`, `set_index`
         A    2 |                 | 27  /RST       D7-D0, /CS /RD /WR, PS
         B    3 |                 | 26  CLK                   host: `set_bus`; the chip drives `data_out`
     D7-D0 4-11 |                 | 25-20          PS         0 command and status, 1 data
       /CS   12 |                 | 19  PWM MAG    HI         `hi`, high: an interrupt for the host
       /RD   13 |                 | 18  PWM SIGN   PWM MAG    `pwm`, 128 steps of 4 clocks in 512
       GND   14 |                 | 17  HI         PWM SIGN   `sign`, 1: negative torque
                |                 | 16  PS         /RST       `set_reset`
                |                 | 15  /WR        CLK        6 MHz, a quarter of the tick
                +-----------------+

    host --> host port --> trajectory buffers --STT--> profile --> desired position --> (+)
      ^          |     |                                                                 |
      |          |     +-> filter buffers -----UDF--> kp ki kd il --> PID <--- error <---+
      +-- status, registers                                            |                 |
                                        bridge, motor <-- PWM <--------+                 |
                                              |                                          |
                                           encoder --> A, B, /IN --> decoder, index --> (-) real position

How bytes make words is `host_port.py`'s. Time is in 24 MHz ticks; a chip clock is 4, a PWM period 2048, a sample 8192
of them. Rule names in comments (T1, D1, ...) are those of README.md in this folder. Pins: data sheet SNVS781,
connection diagram of the 28-pin package.
"""

from __future__ import annotations

from miro_exact.clock import LM629_CLOCK_TICKS, NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.event_log import COMMAND, START_LOST, WHEEL_LOST, EventLog
from miro_robot.lm629 import buffers, host_port, signals
from miro_robot.lm629.buffers import FilterBuffer, TrajectoryBuffer, fit_15, signed_31
from miro_robot.lm629.commands import BY_OPCODE, COMMANDS
from miro_robot.lm629.encoder import Encoder
from miro_robot.lm629.host_port import HostPort
from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options
from miro_robot.lm629.pid import Pid
from miro_robot.lm629.signals import Signals
from miro_robot.lm629.trajectory import ProfileGenerator

SAMPLE_TICKS = 8192
PWM_TICKS = 2048

_SAMPLE_TICKS, _PWM_TICKS = SAMPLE_TICKS, PWM_TICKS
_PLACE = ("q", -(1 << 30), (1 << 30) - 1)  # the chip's position space
_HELD, _RESETTING, _RUNNING = 0, 1, 2
_MOTOR_OFF, _ON_TARGET, _STOP_ON_ERROR = signals.MOTOR_OFF, signals.ON_TARGET, signals.STOP_ON_ERROR
_UPDATE_PENDING, _ACQUIRE_INDEX = signals.UPDATE_PENDING, signals.ACQUIRE_INDEX
_INTERRUPT = signals.INTERRUPT
_BREAKPOINT, _EXCESSIVE_ERROR = signals.BREAKPOINT, signals.EXCESSIVE_ERROR
_WRAP_AROUND, _INDEX_ACQUIRED = signals.WRAP_AROUND, signals.INDEX_ACQUIRED
_TRAJECTORY_COMPLETE, _COMMAND_ERROR = signals.TRAJECTORY_COMPLETE, signals.COMMAND_ERROR
_ACCELERATION_LOADED, _OUTPUT_8_BIT = signals.ACCELERATION_LOADED, signals.OUTPUT_8_BIT
_VELOCITY_MODE, _FORWARD = buffers.VELOCITY_MODE, buffers.FORWARD
"""They stand in the same place in the control word and in the signals register."""
_TURN_OFF, _STOP_ABRUPTLY, _STOP_SMOOTHLY = buffers.MOTOR_OFF, buffers.STOP_ABRUPTLY, buffers.STOP_SMOOTHLY
_STOPS, _COMPLETED, _OUT_OF_RANGE = buffers.STOPS, buffers.COMPLETED, buffers.OUT_OF_RANGE
_TAKEN, _FROM_OFF, _STOPS_AT_ONCE = 1, 2, 4
"""`start_taken`: an STT waits for its sample; the motor was off when it came; it turns it off or stops abruptly."""
_ARMED, _ON_THE_PLACE = 1, 2
_COMMAND_CAME, _WORD_CAME, _ANSWERED = host_port.COMMAND, host_port.WORD, host_port.ANSWERED
_OPEN, _HARDWARE_RESET, _SOFTWARE_RESET = host_port.OPEN, host_port.HARDWARE_RESET, host_port.SOFTWARE_RESET

(
    _RESET, _STT, _DFH, _SIP, _UDF, _PORT8, _PORT12, _RDDV, _RDDP, _RDIP, _RDRP, _RDRV, _RDSIGS, _RDSUM,
    _LPES, _LPEI, _MSKI, _RSTI, _LFIL, _LTRJ, _SBPA, _SBPR,
) = (command.opcode for command in COMMANDS)  # fmt: skip
_WORDS_IN = [BY_OPCODE[opcode].words_in if opcode in BY_OPCODE else 0 for opcode in range(256)]
_WORDS_OUT = [BY_OPCODE[opcode].words_out if opcode in BY_OPCODE else 0 for opcode in range(256)]


class Lm629:
    """One motion controller at 6 MHz.

    Inputs are told when they change (`set_bus`, `set_reset`, `set_encoder`, `set_index`), in tick order and
    never beyond `next_tick` and `hi_falls_tick` without an `advance` first. Outputs are the public fields `pwm` (PWM
    pin), `sign` (1 = negative torque) and `hi` (host interrupt), and `data_out`. A new chip stands still
    until its first reset.

    For observers: `real_position`, `real_velocity`, `index_position` (counts, as of the last sample),
    `desired_position`, `desired_velocity`, `status`, `pwm_magnitude` (0..127), `writes_while_busy` (writes
    lost because the chip was busy or in reset), and `commands`, which collects (tick, opcode, data bytes)
    of every command whose words are complete; it is no state, drain it as you like. `encoder_edges` is None, or
    a list of yours that gets (tick, a, b) of every call of `set_encoder`.
    """

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
        "hi_falls_tick": TICK,
        "sample_tick": TICK,
        "period_tick": TICK,
        "real_position": _PLACE,
        "real_velocity": ("q", -(1 << 40), 1 << 40),
        "index_position": _PLACE,
        "breakpoint": _PLACE,
        "breakpoint_armed": ("i", 0, 2),
        "start_taken": ("i", 0, 7),
        "pwm": FLAG,
        "pwm_magnitude": ("i", 0, 127),
        "sign": FLAG,
        "excessive": FLAG,
    }
    NOT_STATE = (
        *("options", "reset_ticks", "rounds_down", "negative", "pulse_late", "keeps_sign", "open_clears"),
        *("error_full", "error_repeats", "clamps", "shows_late", "falls_late", "commands"),
        *("encoder_edges", "log", "side", "pulses"),
        *("hi", "writes_while_busy"),  # copies of what the parts hold
    )

    def __init__(self, options: Lm629Options = DEFAULT_OPTIONS) -> None:
        self.options = options
        self.reset_ticks = options.reset_clocks * LM629_CLOCK_TICKS
        self.rounds_down = 1 if options.output_rounding == "down" else 0
        self.negative = options.sign_of_negative
        self.pulse_late = 1 if options.pulse_at == "end" else 0
        self.keeps_sign = 1 if options.off_keeps_sign else 0
        self.open_clears = 1 if options.open_loop_clears else 0
        self.error_full = 1 if options.error_test == "full" else 0
        self.error_repeats = 1 if options.error_flag_repeats else 0
        self.clamps = 1 if options.out_of_range == "clamped" else 0
        self.shows_late = 1 if options.start_shows == "sample" else 0
        self.falls_late = 1 if options.hi_falls == "busy" else 0
        self.port = HostPort(options.busy_clocks * LM629_CLOCK_TICKS, options)
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
        self.pulses = 1  # 0: no wire is at the magnitude pin, which stays low
        self.writes_while_busy = 0
        self.reset_level = 1
        self.reset_tick = 0
        self.threshold = 0x7FFF
        self.next_tick = NEVER_TICK
        self.index_position = 0
        self._enter_reset(_HELD, _HARDWARE_RESET, NEVER_TICK)

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
            # By the pin alone: a RESET command keeps the error threshold (SNVS781, RESET).
            self.threshold = 0x7FFF
            self.encoder.settle(tick)
            self._enter_reset(_HELD, _HARDWARE_RESET, NEVER_TICK)
        # A shorter pulse is below the sheet's minimum: chosen, the chip stands still until a long one.
        elif tick - self.reset_tick >= self.options.reset_pulse_clocks * LM629_CLOCK_TICKS:
            self.mode = _RESETTING
            # Reset clocks are counted from the next edge of the chip's own clock, every fourth tick.
            self.next_tick = (tick + 3 & -4) + self.reset_ticks

    def _enter_reset(self, mode: int, lock: int, until_tick: int) -> None:
        """Everything but the error threshold and the encoder's inputs falls back to zero (R5, R6).

        The encoder has been settled: what it caught before this tick ends the wait for an index.
        """
        clears_index = self.options.reset_clears_index
        self.mode = mode
        self.next_tick = until_tick
        self.sample_tick = NEVER_TICK
        self.period_tick = 0
        self.port.reset(lock)
        self.encoder.clear(clears_index)
        self.trajectory.reset()
        self.trajectory_buffer.reset()
        self.filter_buffer.reset()
        self.pid.load(0, 0, 0, 0, 0)
        self.pid.open_loop()
        kept = 0
        if lock == _SOFTWARE_RESET and not self.options.reset_clears_lpes:
            kept = self.signals.word & _STOP_ON_ERROR
        if self.encoder.armed:
            kept |= _ACQUIRE_INDEX
        self.signals.clear(kept)
        self.excessive = 0
        self.real_position = 0
        self.real_velocity = 0
        if clears_index:
            self.index_position = 0
        self.breakpoint = 0
        self.breakpoint_armed = 0
        self.start_taken = 0
        self.pwm = 0
        self.pwm_magnitude = 0
        self.sign = 0
        self.hi = 0
        self.hi_falls_tick = NEVER_TICK

    def _end_reset(self, now: int) -> None:
        """Status 84h; sample counter and PWM period start here (R4)."""
        self.mode = _RUNNING
        self.encoder.settle(now)
        self.encoder.clear(self.options.reset_clears_index)
        if not self.encoder.armed:
            self.signals.word &= ~_ACQUIRE_INDEX
        self.port.reset(_OPEN)
        self.signals.after_reset()
        self.hi = self.signals.word >> 15
        self.breakpoint_armed = _ON_THE_PLACE if self.options.reset_breakpoint == "fires" else 0
        self.sample_tick = now + _SAMPLE_TICKS
        if not self.options.reset_restarts_samples:
            self.sample_tick -= now % _SAMPLE_TICKS
        self.next_tick = self.sample_tick

    # ------------------------------------------------------------------------------------------ time

    def advance(self, tick: int) -> None:
        """Executes everything the chip does on its own up to and including `tick`."""
        while self.next_tick <= tick:
            now = self.next_tick
            if self.mode != _RUNNING:
                self._end_reset(now)
            elif self.pwm != self.pulse_late and self.pwm_magnitude and (self.pwm or self.pulses):
                self.pwm = self.pulse_late  # the edge inside of a period (O3)
                self.next_tick = self.period_tick + _PWM_TICKS
            else:
                self._period(now)
        # Last: a flag that a sample on this very tick raises keeps HI high (I4).
        if self.hi_falls_tick <= tick:
            self.hi = 0
            self.hi_falls_tick = NEVER_TICK

    def _put_hi(self, tick: int) -> None:
        """HI after a command, which may be what lets it fall (I4)."""
        if self.signals.word & _INTERRUPT:
            self.hi = 1
            self.hi_falls_tick = NEVER_TICK
        elif self.falls_late and tick < self.port.busy_until:
            if self.hi:
                self.hi_falls_tick = self.port.busy_until
        else:
            self.hi = 0

    def rest(self, tick: int) -> None:
        """Makes a sample of an unplugged motor that is off, and passes those up to `tick` that find what it left.

        The last of them is left, and all where there are fewer than three.
        """
        now = self.next_tick
        if self.pulses or self.hi_falls_tick != NEVER_TICK or now + 2 * _SAMPLE_TICKS > tick:
            return
        self.advance(now)
        if self.signals.word & _MOTOR_OFF and self.encoder.quadrature.due == NEVER_TICK:
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
            # A step of the magnitude is 4 clocks of 4 ticks.
            self.next_tick = now + _PWM_TICKS - 16 * self.pwm_magnitude
        else:
            self.pwm = 1
            self.next_tick = now + 16 * self.pwm_magnitude

    def _sample(self, now: int) -> None:
        """Computes one sample; its order is chosen (README.md, "Inside a sample")."""
        # First, so that STT, error and breakpoint all count from the positions of this sample.
        flags = self._latch_position(now)
        if self.start_taken:
            flags |= self._start()
        if self.signals.word & _UPDATE_PENDING:
            self._update_filter()
        drive = 0
        if not self.signals.word & _MOTOR_OFF:
            flags |= self._step_profile()
            error = signed_31((self.trajectory.position >> 16) - self.real_position)
            flags |= self._check_error(error, now)
            # Asked again: LPES turns the motor off in the very sample that finds the error.
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
        if self.signals.word & _INTERRUPT:
            self.hi = 1
            self.hi_falls_tick = NEVER_TICK

    def _latch_position(self, now: int) -> int:
        """Take the counts since the last sample, and an index that was caught among them."""
        self.encoder.settle(now)
        flags = 0
        if self.encoder.caught:
            # Counts up to the pulse, added to the position of the sample before: it moves on below.
            self.index_position = signed_31(self.real_position + self.encoder.caught_counts)
            self.encoder.caught = 0
            self.signals.word &= ~_ACQUIRE_INDEX
            flags = _INDEX_ACQUIRED
        self.real_velocity = self.encoder.counts
        moved = self.real_position + self.encoder.counts
        self.real_position = signed_31(moved)
        self.encoder.counts = 0
        # Positions are a circle of 2^31 counts (SNVS781): the flag says that this sample passed its border.
        if self.real_position != moved:
            flags |= _WRAP_AROUND
        return flags

    def _start(self) -> int:
        """The accepted STT takes effect. Returns flags."""
        profile = self.trajectory
        buffer = self.trajectory_buffer
        if self.start_taken & _FROM_OFF:
            profile.follow(self.real_position)
        if self.options.start_takes == "sample":
            buffer.take(self.options.stop_bits_stay)
        control = buffer.taken_control
        profile.target = buffer.resolve(self._relative_base())
        profile.acceleration = buffer.taken_acceleration
        profile.max_velocity = buffer.taken_velocity
        profile.velocity_mode = 1 if control & _VELOCITY_MODE else 0
        profile.forward = 1 if control & _FORWARD else 0
        self.start_taken = 0
        self._show_start(control)
        # Of several stops "motor off" wins, then the abrupt one (T3).
        if control & _TURN_OFF:
            self.signals.word |= _MOTOR_OFF
            return _TRAJECTORY_COMPLETE
        if control & _STOP_ABRUPTLY:
            at_real = self.options.abrupt_stop_at == "real"
            profile.stop_abruptly(self.real_position if at_real else profile.position >> 16)
            self.signals.word |= _ON_TARGET
            return _TRAJECTORY_COMPLETE
        profile.start(1 if control & _STOP_SMOOTHLY else 0)
        return 0

    def _show_start(self, control: int) -> None:
        """Sets the signals for STT; for an order to turn the motor off, bit 7 is set by its result."""
        cleared = _ON_TARGET | _VELOCITY_MODE | _FORWARD
        self.signals.word &= ~(cleared if control & _TURN_OFF else cleared | _MOTOR_OFF)
        self.signals.word |= control & (_VELOCITY_MODE | _FORWARD)

    def _update_filter(self) -> None:
        """The accepted UDF takes effect."""
        taken = self.filter_buffer.taken
        self.pid.load(taken[0], taken[1], taken[2], taken[3], self.filter_buffer.taken_ds)
        if self.options.update_clears:
            self.pid.open_loop()

    def _relative_base(self) -> int:
        """The base to which a relative position is added (T6)."""
        if self.options.relative_base == "real":
            return self.real_position
        if self.options.relative_base == "target" and not self.trajectory.velocity_mode:
            return self.trajectory.target
        return self.trajectory.position >> 16

    def _commanded_target(self) -> int:
        """Target of the last STT accepted; before its sample, with the positions of the sample before (P5)."""
        buffer = self.trajectory_buffer
        if not self.start_taken or self.options.breakpoint_base == "working":
            return self.trajectory.target
        position, relative = buffer.taken_position, buffer.taken_relative
        if self.options.start_takes == "sample":
            position, relative = buffer.position, buffer.relative
        return signed_31(self._relative_base() + position) if relative else position

    def _step_profile(self) -> int:
        flags = 0
        if self.trajectory.moving:
            if self.trajectory.step():
                self.signals.word |= _ON_TARGET
                flags = _TRAJECTORY_COMPLETE
            if self.trajectory.crossed:
                flags |= _WRAP_AROUND
        return flags

    def _check_error(self, error: int, now: int) -> int:
        """Excessive position error; with LPES it turns the motor off."""
        # The filter's error has 16 bits; whether the threshold sees more is a choice (F5).
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
            if self.log is not None:
                self.log.note(WHEEL_LOST, now, self.side, 0)
        return flags

    def _put_out(self, drive: int) -> None:
        """16 bits to sign and 7-bit magnitude (O1, O2); a motor that is off gets none (O4)."""
        top = drive >> 8 if drive >= 0 or self.rounds_down else -(-drive >> 8)
        # -32768 shifted by 8 is -128, one more than the seven bits of the magnitude hold (O1).
        self.pwm_magnitude = min(127, -top if top < 0 else top)
        if not self.signals.word & _MOTOR_OFF:
            self.sign = self.negative if top < 0 else 1 - self.negative
        elif not self.keeps_sign:
            self.sign = 0

    def _check_breakpoint(self) -> int:
        """Checks the breakpoint against this sample's counts only: the wrap of the position space and DFH do not
        trigger it.
        """
        if not self.breakpoint_armed:
            return 0
        counts = self.real_velocity
        way = signed_31(self.breakpoint - self.real_position + counts)  # from the sample before
        passed = 0 < way <= counts or counts <= way < 0
        if self.options.breakpoint_exact:
            passed = passed and way == counts
        if not passed and self.breakpoint_armed != _ON_THE_PLACE:
            return 0
        self.breakpoint_armed = 0
        return _BREAKPOINT

    def set_breakpoint(self, place: int) -> None:
        """Arms it; on the place itself it fires at the next sample."""
        self.breakpoint = signed_31(place)
        self.breakpoint_armed = _ON_THE_PLACE if self.breakpoint == self.real_position else _ARMED

    # ------------------------------------------------------------------------------------------ encoder

    def set_encoder(self, tick: int, a: int, b: int) -> None:
        """Levels of A and B from `tick` on; the first call tells where the wheel stands."""
        self.encoder.set_phases(tick, a, b)
        if self.encoder_edges is not None:
            self.encoder_edges.append((tick, a, b))

    def set_index(self, tick: int, level: int) -> None:
        """Level of /IN from `tick` on."""
        self.encoder.set_index(tick, level)

    # ------------------------------------------------------------------------------------------ host

    def set_bus(self, tick: int, cs: int, rd: int, wr: int, ps: int, data: int) -> None:
        """Levels of /CS, /RD, /WR, PS and D7..D0 from `tick` on."""
        # What the chip does by itself up to this tick comes before what the host does on it.
        if self.next_tick <= tick or self.hi_falls_tick <= tick:
            self.advance(tick)
        outcome = self.port.pins(tick, cs, rd, wr, ps, data, self.signals.word & 0xFE)
        self.writes_while_busy = self.port.writes_while_busy
        if outcome:
            self._host(tick, outcome)
            # After the command has acted: it may clear the flag that holds HI, or raise one.
            self._put_hi(tick)

    def data_out(self, tick: int) -> int:
        """The byte the chip drives onto D7..D0, or -1 while it leaves the bus alone."""
        return self.port.drive if self.port.reading else -1

    def _host(self, tick: int, outcome: int) -> None:
        if outcome == _COMMAND_CAME:
            self._command(tick)
        elif outcome == _WORD_CAME:
            self._word(tick)
        elif outcome == _ANSWERED:
            self._finished(tick)
        else:
            self.signals.raise_flags(_COMMAND_ERROR)

    def tell(self, log: EventLog, side: int) -> None:
        """From now on completed commands are noted in `log` too, as those of `side` (0 left, 1 right)."""
        self.log = log
        self.side = side

    def _finished(self, tick: int) -> None:
        record = self.port.data_bytes()
        self.commands.append((tick, self.port.command, record))
        if self.log is not None:
            self.log.note(COMMAND, tick, self.side << 8 | self.port.command, 0, record)

    def _command(self, tick: int) -> None:
        """A command byte: act on it, prepare its answer, or wait for its words."""
        # First: a command that drops another one's last words must not find half a parameter in the buffers.
        if self.port.abandoned:
            self._complain(self.options.unfinished_flags)
            self.trajectory_buffer.abandon()
            self.filter_buffer.abandon()
        opcode = self.port.command
        if _WORDS_IN[opcode]:
            self.port.expect(_WORDS_IN[opcode])
        elif _WORDS_OUT[opcode]:
            self.port.reply(_WORDS_OUT[opcode], self._answer(tick, opcode))
        else:
            self._finished(tick)
            # After `_finished`: RESET forgets the command, and it would not be logged.
            self._execute(tick, opcode)

    def _execute(self, tick: int, opcode: int) -> None:
        """Commands without data."""
        if opcode == _STT:
            self._accept_start(tick)
        elif opcode == _UDF:
            self.filter_buffer.take()
            self.signals.word |= _UPDATE_PENDING
        elif opcode == _SIP:
            self.signals.word |= _ACQUIRE_INDEX
            self.encoder.arm(tick)
        elif opcode == _DFH:
            if self.options.home_shifts_buffer:
                self.trajectory_buffer.shift(self.real_position)
            self.trajectory.define_home(self.real_position)
            self.real_position = 0
        elif opcode == _RESET:
            self.encoder.settle(tick)
            # After the encoder was settled: an index caught before the command ends the SIP (R6).
            self._enter_reset(_RESETTING, _SOFTWARE_RESET, (tick + 3 & -4) + self.reset_ticks)
        elif opcode == _PORT12 and self.options.port12_clears:
            self.signals.word &= ~_OUTPUT_8_BIT
        elif opcode == _PORT8:
            self.signals.word |= _OUTPUT_8_BIT
        elif opcode != _PORT12:
            self._complain(self.options.unknown_opcode_flags)

    def _complain(self, flags: bool) -> None:
        if flags:
            self.signals.raise_flags(_COMMAND_ERROR)

    def _accept_start(self, tick: int) -> None:
        """STT is refused if it would change the acceleration of a continuing motion (T2).

        An order that waits for its sample decides whether there is one, else the flags.
        """
        control = self.trajectory_buffer.control
        # The order that waits will have been done before this one: what it leaves is what counts (T2).
        if self.start_taken:
            resting = self.start_taken & _STOPS_AT_ONCE
        else:
            resting = self.signals.word & (_ON_TARGET | _MOTOR_OFF)
        stopping = control & _STOPS and self.options.stop_lifts_refusal
        if self.signals.word & _ACCELERATION_LOADED and not resting and not stopping:
            self.signals.raise_flags(_COMMAND_ERROR)
        else:
            self._take_start(tick, control)

    def _take_start(self, tick: int, control: int) -> None:
        """STT is accepted: its sample will execute it. One that still waits for that is lost, or is done now (T11)."""
        if self.start_taken and self.options.second_start == "follows":
            self.signals.raise_flags(self._start())
        elif self.start_taken and self.log is not None:
            self.log.note(START_LOST, tick, self.side, 0)
        taken = _TAKEN | self.start_taken & _FROM_OFF
        if self.signals.word & _MOTOR_OFF:
            taken |= _FROM_OFF
        if control & (_TURN_OFF | _STOP_ABRUPTLY):
            taken |= _STOPS_AT_ONCE
        self.start_taken = taken
        if not self.shows_late:
            self._show_start(control)
        if self.options.start_takes != "sample":
            self.trajectory_buffer.take(self.options.stop_bits_stay)
        self.signals.word &= ~_ACCELERATION_LOADED

    def _answer(self, tick: int, opcode: int) -> int:
        """The data of a reading command at its arrival."""
        # Now, not when the words are read: both words of a position have to be of one moment.
        if opcode == _RDSIGS:
            return self.signals.word
        if opcode == _RDRP and self.options.read_position == "sample":
            return self.real_position
        if opcode == _RDRP:
            self.encoder.settle(tick)
            return signed_31(self.real_position + self.encoder.counts)
        if opcode == _RDRV:
            return self.real_velocity
        if opcode == _RDDP:
            return self.trajectory.position >> 16
        if opcode == _RDDV:
            return self.trajectory.velocity
        if opcode == _RDIP:
            return self.index_position
        return self.pid.integral if self.options.sum_reading == "term" else self.pid.top_of_sum()

    def _word(self, tick: int) -> None:
        """A data word from the host."""
        opcode = self.port.command
        if opcode == _LTRJ:
            self._trajectory_word(self.port.word)
        elif opcode == _LFIL:
            self._filter_word(self.port.word)
        if self.port.words_left == 0:
            self._load(opcode)
            self._finished(tick)

    def _trajectory_word(self, word: int) -> None:
        buffer: TrajectoryBuffer = self.trajectory_buffer
        profile = self.trajectory
        # The first word after LTRJ says which parameters follow (SNVS781, trajectory control word).
        if self.port.recorded == 2:
            self.port.expect(buffer.begin(word))
            if self.options.unsent == "working":
                buffer.refresh(profile.acceleration, profile.max_velocity, profile.target)
            return
        if self.options.relative_rates == "buffer":
            outcome = buffer.word(word, buffer.acceleration, buffer.velocity, self.clamps)
        else:
            outcome = buffer.word(word, profile.acceleration, profile.max_velocity, self.clamps)
        if outcome & _COMPLETED:
            self.signals.word |= _ACCELERATION_LOADED
        if outcome & _OUT_OF_RANGE:
            self._complain(self.options.range_flags)

    def _filter_word(self, word: int) -> None:
        if self.port.recorded == 2:
            self.port.expect(self.filter_buffer.begin(word))
        elif self.filter_buffer.word(word, self.clamps):
            self._complain(self.options.range_flags)

    def _load(self, opcode: int) -> None:
        """Commands with one parameter of one or two words, now complete."""
        word = self.port.word
        if opcode == _RSTI:
            self.signals.reset_interrupts(word)
        elif opcode == _MSKI:
            self.signals.mask_interrupts(word)
        elif opcode in (_LPES, _LPEI):
            self.threshold = fit_15(word, self.clamps)
            self._complain(self.options.range_flags and word > 0x7FFF)
            self.signals.word &= ~_STOP_ON_ERROR
            if opcode == _LPES:
                self.signals.word |= _STOP_ON_ERROR
        elif opcode in (_SBPA, _SBPR):
            base = self._commanded_target() if opcode == _SBPR else 0
            self.set_breakpoint(base + int.from_bytes(self.port.data_bytes(), "big"))

    # ------------------------------------------------------------------------------------------ observers

    @property
    def desired_position(self) -> int:
        """Counts, rounded down."""
        return int(self.trajectory.position >> 16)

    @property
    def desired_velocity(self) -> int:
        """Signed, 1/65536 counts per sample."""
        return int(self.trajectory.velocity)

    @property
    def status(self) -> int:
        """Bits 7..1 of the status byte, 0 in reset; the busy bit is a matter of time: `status_at`."""
        return int(self.signals.word & 0xFE)

    def status_at(self, tick: int) -> int:
        """The status byte a read that begins at `tick` gets."""
        return self.port.status(tick, self.signals.word & 0xFE)

    def __repr__(self) -> str:
        return (
            f"<Lm629 status {self.status:02X}h real {self.real_position} desired {self.desired_position}"
            f" velocity {self.desired_velocity / 65536:+.5f}"
            f" pwm {'-' if self.sign else '+'}{self.pwm_magnitude} next tick {self.next_tick}>"
        )

    # ------------------------------------------------------------------------------------------ state

    def after_load(self) -> None:
        """Raises ValueError where a mode, a command or a word does not go with the rest."""
        falls = self.hi_falls_tick != NEVER_TICK
        self.hi = 1 if falls else self.signals.word >> 15
        if falls and (self.mode != _RUNNING or self.signals.word & _INTERRUPT):
            raise ValueError("HI is about to fall, but it is low or a flag holds it")
        self.writes_while_busy = self.port.writes_while_busy
        if self.reset_level == 0 and self.mode != _HELD:
            raise ValueError("the reset pin is low, but the chip is not in reset")
        if self.mode != _RUNNING and (self.sample_tick != NEVER_TICK or self.pwm or self.pwm_magnitude):
            raise ValueError("the chip is in reset, but has a next sample or drives a motor")
        waiting = self.port.words_left if self.port.incoming else 0
        if waiting and waiting > self._words_due():
            raise ValueError(
                f"words_left is {waiting}, but command {self.port.command:02X}h takes {self._words_due()} more"
            )

    def _words_due(self) -> int:
        """Words that the command in progress may still want from the host."""
        begun = self.port.recorded >= 2
        if begun and self.port.command == _LTRJ:
            return self.trajectory_buffer.words_due()
        if begun and self.port.command == _LFIL:
            return self.filter_buffer.words_due()
        return _WORDS_IN[self.port.command]

    def check_times(self, earliest_tick: int) -> None:
        """Raises ValueError unless a restored chip continues at `earliest_tick` or soon after."""
        latest_tick = earliest_tick + 2 * _SAMPLE_TICKS
        if self.next_tick < earliest_tick or (self.mode == _RUNNING and self.next_tick > latest_tick):
            raise ValueError(f"next_tick is {self.next_tick}, not from {earliest_tick} to {latest_tick}")
        if self.hi_falls_tick < earliest_tick:
            raise ValueError(f"hi_falls_tick is {self.hi_falls_tick}, before {earliest_tick}")
        if self.mode == _RUNNING and not earliest_tick <= self.sample_tick <= latest_tick:
            raise ValueError(f"sample_tick is {self.sample_tick}, not from {earliest_tick} to {latest_tick}")
        if self.mode == _RUNNING and self.next_tick != self._due_tick():
            raise ValueError(
                f"next_tick is {self.next_tick}, but the next edge of PWM is at {self._due_tick()}"
            )

    def _due_tick(self) -> int:
        """Source of `next_tick` while the chip runs: a sample, the end of a PWM period or an edge of its pulse.

        -1 when the period is none of the four before the next sample, or there is a pulse of no length.
        """
        left = self.sample_tick - self.period_tick
        if self.pwm_magnitude == 0:
            return -1 if self.pwm else self.sample_tick
        if left % _PWM_TICKS or not _PWM_TICKS <= left <= _SAMPLE_TICKS:
            return -1
        length = 16 * self.pwm_magnitude
        if self.pulse_late:
            return self.period_tick + (_PWM_TICKS if self.pwm else _PWM_TICKS - length)
        return self.period_tick + (length if self.pwm else _PWM_TICKS)
