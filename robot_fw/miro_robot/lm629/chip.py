"""The LM629: its pins, its time, the order inside a sample, and what each command does.

The parts live in their own files: host port, encoder inputs, profile generator, filter, signals register,
buffers. Time is in 24 MHz ticks; a chip clock is 4, a PWM period 2048, a sample 8192 of them. Rule names in
comments (T1, D1, ...) are those of README.md in this folder.
"""

from __future__ import annotations

from miro_robot.lm629 import buffers, host_port, signals
from miro_robot.lm629.buffers import FilterBuffer, TrajectoryBuffer
from miro_robot.lm629.commands import BY_OPCODE
from miro_robot.lm629.encoder import Encoder
from miro_robot.lm629.host_port import HostPort
from miro_robot.lm629.options import DEFAULT_OPTIONS, TICKS_PER_CLOCK, Lm629Options
from miro_robot.lm629.pid import Pid
from miro_robot.lm629.signals import Signals
from miro_robot.lm629.trajectory import Trajectory

SAMPLE_TICKS = 8192
PWM_TICKS = 2048
FAR = 1 << 62

_FAR = FAR
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


def _signed_31(value: int) -> int:
    """Sign-extended from bit 30: the chip's position space."""
    return ((value + 0x40000000) & 0x7FFFFFFF) - 0x40000000


def _side(value: int) -> int:
    return 1 if value > 0 else -1 if value < 0 else 0


class Lm629:
    """One motion controller at 6 MHz.

    Inputs are told when they change (`set_bus`, `set_reset`, `set_encoder`, `set_index`), in tick order and
    never beyond `next_tick` without an `advance` first. Outputs are the public fields `pwm` (magnitude
    pin), `sign` (1 = negative torque) and `hi` (host interrupt), and `data_out`. A new chip stands still
    until its first reset.

    For observers: `real_position`, `real_velocity`, `index_position` (counts, as of the last sample),
    `desired_position`, `desired_velocity`, `status`, `pwm_magnitude` (0..127), `writes_while_busy` (writes
    lost because the chip was busy or in reset), and `commands`, which collects (tick, opcode, data bytes)
    of every command whose words are complete; it is no state, drain it as you like. `encoder_edges` is None, or
    a list of yours that gets (tick, a, b) of every call of `set_encoder`.
    """

    NOT_STATE = (
        *("options", "reset_ticks", "reset_pulse_ticks"),
        *("commands", "encoder_edges"),
        *("hi", "writes_while_busy"),  # copies of what the parts hold
    )

    def __init__(self, options: Lm629Options = DEFAULT_OPTIONS) -> None:
        self.options = options
        self.reset_ticks = options.reset_clocks * TICKS_PER_CLOCK
        self.reset_pulse_ticks = options.reset_pulse_clocks * TICKS_PER_CLOCK
        self.port = HostPort(options.busy_clocks * TICKS_PER_CLOCK)
        self.encoder = Encoder(options.filter_clocks)
        self.trajectory = Trajectory()
        self.pid = Pid(options.pid_saturates)
        self.signals = Signals()
        self.trajectory_buffer = TrajectoryBuffer()
        self.filter_buffer = FilterBuffer()
        self.commands: list[tuple[int, int, bytes]] = []
        self.encoder_edges: list[tuple[int, int, int]] | None = None
        self.writes_while_busy = 0
        self.reset_level = 1
        self.reset_tick = 0
        self.threshold = 0x7FFF
        self.next_tick = _FAR
        self._enter_reset(_HELD, host_port.HARDWARE_RESET, _FAR)

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
            self._enter_reset(_HELD, host_port.HARDWARE_RESET, _FAR)
        elif tick - self.reset_tick >= self.reset_pulse_ticks:
            self.mode = _RESETTING
            self.next_tick = (tick + 3 & -4) + self.reset_ticks

    def _enter_reset(self, mode: int, lock: int, until_tick: int) -> None:
        """Everything but the error threshold and the encoder's inputs falls back to zero."""
        self.mode = mode
        self.next_tick = until_tick
        self.sample_tick = _FAR
        self.period_tick = 0
        self.port.reset(lock)
        self.encoder.clear()
        self.trajectory.reset()
        self.trajectory_buffer.reset()
        self.filter_buffer.reset()
        self.pid.load(0, 0, 0, 0, 0)
        self.pid.open_loop()
        self.signals.during_reset()
        self.real_position = 0
        self.real_velocity = 0
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
        self.encoder.clear()
        self.port.reset(host_port.OPEN)
        self.signals.after_reset()
        self.hi = self.signals.word >> 15
        self.sample_tick = now + _SAMPLE_TICKS
        self.next_tick = self.sample_tick

    # ------------------------------------------------------------------------------------------ time

    def advance(self, tick: int) -> None:
        """Do everything the chip does by itself up to and including `tick`."""
        while self.next_tick <= tick:
            now = self.next_tick
            if self.mode != _RUNNING:
                self._end_reset(now)
            elif self.pwm:
                self.pwm = 0
                self.next_tick = self.period_tick + _PWM_TICKS
            else:
                self.period_tick = now
                if now == self.sample_tick:
                    self.sample_tick = now + _SAMPLE_TICKS
                    self._sample(now)
                if self.pwm_magnitude > 0:
                    self.pwm = 1
                    self.next_tick = now + 16 * self.pwm_magnitude
                else:
                    self.next_tick = self.sample_tick

    def _sample(self, now: int) -> None:
        """One sample, in the order of the sheet's 9.4."""
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
            error = _signed_31((self.trajectory.position >> 16) - self.real_position)
            flags |= self._check_error(error)
            if not self.signals.word & _MOTOR_OFF:
                drive = self.pid.step(error)
        if self.signals.word & _MOTOR_OFF:
            self.trajectory.follow(self.real_position)
            self.pid.open_loop()
        self._put_out(drive)
        flags |= self._check_breakpoint()
        self.signals.raise_flags(flags)
        self.signals.clear_bits(_UPDATE_PENDING)
        self.hi = self.signals.word >> 15

    def _latch_position(self, now: int) -> int:
        """Take the counts since the last sample, and an index that was caught among them."""
        self.encoder.settle(now)
        flags = 0
        if self.encoder.caught:
            self.index_position = _signed_31(self.real_position + self.encoder.caught_counts)
            self.encoder.caught = 0
            self.signals.clear_bits(_ACQUIRE_INDEX)
            flags = _INDEX_ACQUIRED
        self.real_velocity = self.encoder.counts
        moved = self.real_position + self.encoder.counts
        self.real_position = _signed_31(moved)
        self.encoder.counts = 0
        if self.real_position != moved:
            flags |= _WRAP_AROUND
        return flags

    def _start(self) -> int:
        """The accepted STT takes effect. Returns flags."""
        profile = self.trajectory
        control, acceleration, velocity, _, _ = self.trajectory_buffer.taken
        profile.target = self.trajectory_buffer.resolve(self._relative_base())
        profile.acceleration = acceleration
        profile.max_velocity = velocity
        profile.velocity_mode = 1 if control & buffers.VELOCITY_MODE else 0
        profile.forward = 1 if control & buffers.FORWARD else 0
        self.start_taken = 0
        self.signals.clear_bits(_MOTOR_OFF | _ON_TARGET | signals.VELOCITY_MODE | signals.FORWARD)
        # The two mode bits stand in the same place in the control word and in the signals register.
        self.signals.set_bits(control & (buffers.VELOCITY_MODE | buffers.FORWARD))
        if control & buffers.MOTOR_OFF:
            self.signals.set_bits(_MOTOR_OFF)
            return _TRAJECTORY_COMPLETE
        if control & buffers.STOP_ABRUPTLY:
            profile.stop_abruptly(self.real_position)
            self.signals.set_bits(_ON_TARGET)
            return _TRAJECTORY_COMPLETE
        if control & buffers.STOP_SMOOTHLY:
            profile.stop_smoothly()
        else:
            profile.start()
        return 0

    def _update_filter(self) -> None:
        """The accepted UDF takes effect."""
        kp, ki, kd, il, ds = self.filter_buffer.taken
        self.pid.load(kp, ki, kd, il, ds)

    def _relative_base(self) -> int:
        """What a relative position adds to (T6)."""
        choice = self.options.relative_base
        if choice == "real":
            return self.real_position
        if choice == "target" and not self.trajectory.velocity_mode:
            return self.trajectory.target
        return self.trajectory.position >> 16

    def _step_profile(self) -> int:
        flags = 0
        if self.trajectory.moving:
            if self.trajectory.step():
                self.signals.set_bits(_ON_TARGET)
                flags = _TRAJECTORY_COMPLETE
            if self.trajectory.crossed:
                flags |= _WRAP_AROUND
        return flags

    def _check_error(self, error: int) -> int:
        """Excessive position error; with LPES it turns the motor off."""
        if -self.threshold <= error <= self.threshold:
            return 0
        if not self.signals.word & _STOP_ON_ERROR:
            return _EXCESSIVE_ERROR
        self.signals.set_bits(_MOTOR_OFF)
        return _EXCESSIVE_ERROR | _TRAJECTORY_COMPLETE

    def _put_out(self, drive: int) -> None:
        """16 bits to sign and 7-bit magnitude (O1)."""
        top = drive >> 8
        self.sign = 1 if top < 0 else 0
        self.pwm_magnitude = min(127, -top if top < 0 else top)

    def _check_breakpoint(self) -> int:
        if not self.breakpoint_armed:
            return 0
        side = _side(self.real_position - self.breakpoint)
        if side != 0 and side == self.breakpoint_side:
            return 0
        self.breakpoint_armed = 0
        return _BREAKPOINT

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
        if self.next_tick <= tick:
            self.advance(tick)
        outcome = self.port.pins(tick, cs, rd, wr, ps, data, self.signals.word & 0xFE)
        self.writes_while_busy = self.port.writes_while_busy
        if outcome:
            self._host(tick, outcome)
            self.hi = self.signals.word >> 15

    def data_out(self, tick: int) -> int:
        """The byte the chip drives onto D7..D0, or -1 while it leaves the bus alone."""
        return self.port.drive if self.port.reading else -1

    def _host(self, tick: int, outcome: int) -> None:
        if outcome == host_port.COMMAND:
            self._command(tick)
        elif outcome == host_port.WORD:
            self._word(tick)
        elif outcome == host_port.ANSWERED:
            self._finished(tick)
        else:
            self.signals.raise_flags(signals.COMMAND_ERROR)

    def _finished(self, tick: int) -> None:
        self.commands.append((tick, self.port.command, bytes(self.port.record)))

    def _command(self, tick: int) -> None:
        """A command byte: act on it, prepare its answer, or wait for its words."""
        if self.port.abandoned:
            self.signals.raise_flags(signals.COMMAND_ERROR)
            self.trajectory_buffer.abandon()
            self.filter_buffer.abandon()
        command = BY_OPCODE.get(self.port.command)
        if command is not None and command.words_in:
            self.port.expect(command.words_in)
        elif command is not None and command.words_out:
            self.port.reply(command.words_out, self._answer(command.name))
        else:
            self._finished(tick)
            self._execute(tick, "" if command is None else command.name)

    def _execute(self, tick: int, name: str) -> None:
        """Commands without data."""
        if name == "STT":
            self._accept_start()
        elif name == "UDF":
            self.filter_buffer.take()
            self.signals.set_bits(_UPDATE_PENDING)
        elif name == "SIP":
            self.signals.set_bits(_ACQUIRE_INDEX)
            self.encoder.arm(tick)
        elif name == "DFH":
            self.trajectory.define_home(self.real_position)
            self.real_position = 0
        elif name == "RESET":
            self._enter_reset(_RESETTING, host_port.SOFTWARE_RESET, (tick + 3 & -4) + self.reset_ticks)
        elif name not in ("PORT8", "PORT12"):  # those two mean nothing to an LM629
            self.signals.raise_flags(signals.COMMAND_ERROR)

    def _accept_start(self) -> None:
        """STT is refused when it would change the acceleration of a motion that goes on (T2)."""
        resting = self.signals.word & (_ON_TARGET | _MOTOR_OFF)
        stopping = self.trajectory_buffer.control & buffers.STOPS
        if self.signals.word & signals.ACCELERATION_LOADED and not resting and not stopping:
            self.signals.raise_flags(signals.COMMAND_ERROR)
            return
        self.trajectory_buffer.take()
        self.signals.clear_bits(signals.ACCELERATION_LOADED)
        self.start_taken = 1

    def _answer(self, name: str) -> int:
        """What a reading command says, as it is when the command arrives."""
        if name == "RDSIGS":
            return self.signals.word
        if name == "RDRP":
            return self.real_position
        if name == "RDRV":
            return self.real_velocity
        if name == "RDDP":
            return self.desired_position
        if name == "RDDV":
            return self.trajectory.velocity
        if name == "RDIP":
            return self.index_position
        return self.pid.integral if self.options.sum_reading == "term" else self.pid.top_of_sum()

    def _word(self, tick: int) -> None:
        """A data word from the host."""
        name = BY_OPCODE[self.port.command].name
        if name == "LTRJ":
            self._trajectory_word(self.port.word)
        elif name == "LFIL":
            self._filter_word(self.port.word)
        if self.port.words_left == 0:
            self._load(name, int.from_bytes(self.port.record, "big"))
            self._finished(tick)

    def _trajectory_word(self, word: int) -> None:
        buffer = self.trajectory_buffer
        if len(self.port.record) == 2:
            self.port.expect(buffer.begin(word))
        elif buffer.word(word, self.trajectory.acceleration, self.trajectory.max_velocity):
            self.signals.set_bits(signals.ACCELERATION_LOADED)

    def _filter_word(self, word: int) -> None:
        if len(self.port.record) == 2:
            self.port.expect(self.filter_buffer.begin(word))
        else:
            self.filter_buffer.word(word)

    def _load(self, name: str, value: int) -> None:
        """Commands with one parameter of one or two words, now complete."""
        if name == "RSTI":
            self.signals.reset_interrupts(value)
        elif name == "MSKI":
            self.signals.mask_interrupts(value)
        elif name in ("LPES", "LPEI"):
            self.threshold = value & 0x7FFF
            self.signals.clear_bits(_STOP_ON_ERROR)
            if name == "LPES":
                self.signals.set_bits(_STOP_ON_ERROR)
        elif name in ("SBPA", "SBPR"):
            base = self.trajectory.target if name == "SBPR" else 0
            self.breakpoint = _signed_31(base + value)
            self.breakpoint_side = _side(self.real_position - self.breakpoint)
            self.breakpoint_armed = 1

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

    def snapshot(self) -> dict[str, object]:
        """All of the state; a chip with the same options restored from it goes on with the same bits."""
        return {
            "port": self.port.snapshot(),
            "encoder": self.encoder.snapshot(),
            "trajectory": self.trajectory.snapshot(),
            "pid": self.pid.snapshot(),
            "signals": self.signals.snapshot(),
            "trajectory_buffer": self.trajectory_buffer.snapshot(),
            "filter_buffer": self.filter_buffer.snapshot(),
            "mode": self.mode,
            "reset_level": self.reset_level,
            "reset_tick": self.reset_tick,
            "threshold": self.threshold,
            "next_tick": self.next_tick,
            "sample_tick": self.sample_tick,
            "period_tick": self.period_tick,
            "real_position": self.real_position,
            "real_velocity": self.real_velocity,
            "index_position": self.index_position,
            "breakpoint": self.breakpoint,
            "breakpoint_armed": self.breakpoint_armed,
            "breakpoint_side": self.breakpoint_side,
            "start_taken": self.start_taken,
            "pwm": self.pwm,
            "pwm_magnitude": self.pwm_magnitude,
            "sign": self.sign,
        }

    def restore(self, state: dict[str, object]) -> None:
        for name, value in state.items():
            if isinstance(value, dict):
                getattr(self, name).restore(value)
            else:
                setattr(self, name, value)
        self.hi = self.signals.word >> 15
        self.writes_while_busy = self.port.writes_while_busy
