"""The LM629: its pins, and what each command of the host does.

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

What it does by itself is `axis.py`'s; how bytes make words is `host_port.py`'s. Rule names in comments (T1, D1, ...)
are those of README.md in this folder. Pins: data sheet SNVS781, connection diagram of the 28-pin package.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_robot.event_log import COMMAND, EventLog
from miro_robot.lm629 import buffers, host_port, signals
from miro_robot.lm629.axis import PWM_TICKS, SAMPLE_TICKS, MotorAxis
from miro_robot.lm629.buffers import TrajectoryBuffer, fit_15
from miro_robot.lm629.commands import BY_NAME, BY_OPCODE

__all__ = ["PWM_TICKS", "SAMPLE_TICKS", "Lm629"]

_NEVER, _SAMPLE_TICKS, _PWM_TICKS = NEVER_TICK, SAMPLE_TICKS, PWM_TICKS
_HELD, _RESETTING, _RUNNING = 0, 1, 2
_MOTOR_OFF = signals.MOTOR_OFF
_ON_TARGET = signals.ON_TARGET
_STOP_ON_ERROR = signals.STOP_ON_ERROR
_UPDATE_PENDING = signals.UPDATE_PENDING
_ACQUIRE_INDEX = signals.ACQUIRE_INDEX
_COMMAND_ERROR = signals.COMMAND_ERROR
_ACCELERATION_LOADED = signals.ACCELERATION_LOADED
_OUTPUT_8_BIT = signals.OUTPUT_8_BIT
_COMMAND_CAME, _WORD_CAME, _ANSWERED = host_port.COMMAND, host_port.WORD, host_port.ANSWERED
_SOFTWARE_RESET = host_port.SOFTWARE_RESET
_STOPS, _COMPLETED, _OUT_OF_RANGE = buffers.STOPS, buffers.COMPLETED, buffers.OUT_OF_RANGE
_COMMAND = COMMAND  # kind of event
_SEVEN_BYTES = (1 << 56) - 1

_RESET, _STT, _DFH, _SIP, _UDF, _PORT8, _PORT12 = (
    BY_NAME[name].opcode for name in ("RESET", "STT", "DFH", "SIP", "UDF", "PORT8", "PORT12")
)
_RDDV, _RDDP, _RDIP, _RDRP, _RDRV, _RDSIGS = (
    BY_NAME[name].opcode for name in ("RDDV", "RDDP", "RDIP", "RDRP", "RDRV", "RDSIGS")
)
_LPES, _LPEI, _MSKI, _RSTI, _LFIL, _LTRJ, _SBPA, _SBPR = (
    BY_NAME[name].opcode for name in ("LPES", "LPEI", "MSKI", "RSTI", "LFIL", "LTRJ", "SBPA", "SBPR")
)
_WORDS_IN = [BY_OPCODE[opcode].words_in if opcode in BY_OPCODE else 0 for opcode in range(256)]
_WORDS_OUT = [BY_OPCODE[opcode].words_out if opcode in BY_OPCODE else 0 for opcode in range(256)]


class Lm629(MotorAxis):
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
            size = len(record)
            high = 0
            low = 0
            for index in range(size):
                if index < size - 7:
                    high = (high << 8 | record[index]) & _SEVEN_BYTES
                else:
                    low = low << 8 | record[index]
            self.log.note_long(_COMMAND, tick, self.side << 8 | self.port.command, size, high, low)

    def _command(self, tick: int) -> None:
        """A command byte: act on it, prepare its answer, or wait for its words."""
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
            self._execute(tick, opcode)

    def _execute(self, tick: int, opcode: int) -> None:
        """Commands without data."""
        if opcode == _STT:
            self._accept_start()
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

    def _accept_start(self) -> None:
        """STT is refused when it would change the acceleration of a motion that goes on (T2)."""
        resting = self.signals.word & (_ON_TARGET | _MOTOR_OFF)
        stopping = self.trajectory_buffer.control & _STOPS and self.options.stop_lifts_refusal
        if self.signals.word & _ACCELERATION_LOADED and not resting and not stopping:
            self.signals.raise_flags(_COMMAND_ERROR)
        else:
            if self.options.start_takes != "sample":
                self.trajectory_buffer.take(self.options.stop_bits_stay)
            self.signals.word &= ~_ACCELERATION_LOADED
            self.start_taken = 1

    def _answer(self, tick: int, opcode: int) -> int:
        """What a reading command says, as it is when the command arrives."""
        if opcode == _RDSIGS:
            return self.signals.word
        if opcode == _RDRP:
            return self.real_position if self.options.read_position == "sample" else self.live_position(tick)
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
            base = self.trajectory.target if opcode == _SBPR else 0
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
        self.hi = self.signals.word >> 15
        self.writes_while_busy = self.port.writes_while_busy
        if self.reset_level == 0 and self.mode != _HELD:
            raise ValueError("the reset pin is low, but the chip is not in reset")
        if self.mode != _RUNNING and (self.sample_tick != _NEVER or self.pwm or self.pwm_magnitude):
            raise ValueError("the chip is in reset, but has a next sample or drives a motor")
        waiting = self.port.words_left if self.port.incoming else 0
        if waiting and waiting > self._words_due():
            raise ValueError(
                f"words_left is {waiting}, but command {self.port.command:02X}h takes {self._words_due()} more"
            )

    def _words_due(self) -> int:
        """Words that the command in progress may still want from the host."""
        command = BY_OPCODE.get(self.port.command)
        if command is None:
            return 0
        begun = self.port.recorded >= 2
        if begun and command.name == "LTRJ":
            return self.trajectory_buffer.words_due()
        if begun and command.name == "LFIL":
            return self.filter_buffer.words_due()
        return command.words_in

    def check_times(self, earliest_tick: int) -> None:
        """Raises ValueError unless a restored chip goes on at `earliest_tick` or soon after."""
        latest_tick = earliest_tick + 2 * _SAMPLE_TICKS
        if self.next_tick < earliest_tick or (self.mode == _RUNNING and self.next_tick > latest_tick):
            raise ValueError(f"next_tick is {self.next_tick}, not from {earliest_tick} to {latest_tick}")
        if self.mode == _RUNNING and not earliest_tick <= self.sample_tick <= latest_tick:
            raise ValueError(f"sample_tick is {self.sample_tick}, not from {earliest_tick} to {latest_tick}")
        if self.mode == _RUNNING and self.next_tick != self._due_tick():
            raise ValueError(
                f"next_tick is {self.next_tick}, but the next edge of PWM is at {self._due_tick()}"
            )

    def _due_tick(self) -> int:
        """What `next_tick` follows from while the chip runs: a sample, the end of a period or an edge of its pulse.

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
