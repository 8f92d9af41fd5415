"""A slow, obvious LM629: the rules of `miro_robot.lm629` put down a second time in another shape.

Commands are generators that wait for their words; it shares nothing with the package but its options.
"""

import math
from collections.abc import Generator
from fractions import Fraction

from tests.naive.lm629_encoder import NaiveEncoder
from tests.naive.lm629_parts import HIGH_WORD_READS, LSB, NaivePid, between, modular, profile_speed

Words = Generator[None, int, None]
INTERRUPTS = range(1, 7)


class NaiveLm629:
    """Same inputs as the chip. `run_to(tick)` does what is due by then; outputs are asked for by tick."""

    def __init__(self, options):
        self.options = options
        self.encoder = NaiveEncoder(options.filter_clocks, options.double_step, hurry=True)
        self.pins = {"cs": 1, "rd": 1, "wr": 1, "ps": 1, "data": 0xFF}
        self.rst = 1
        self.rst_fell = 0
        self.threshold = 0x7FFF
        self.lost = self.lost_starts = self.lost_wheels = 0
        self.port_byte = 0
        self.driven = 0
        self.alive_at = None
        self.signals = set()
        self.index_position = 0
        self.clear("hard")

    def clear(self, reset):
        self.reset = reset
        self.pid = NaivePid(self.options.pid_saturates, self.options.sum_rounding == "down")
        self.excess = False
        self.buffer = {"control": 0, "a": 0, "v": 0, "p": 0}
        self.relative = self.newer_position = False
        self.filter = {"kp": 0, "ki": 0, "kd": 0, "il": 0, "ds": 0}
        self.start = None
        self.start_relative = False
        self.ordered = 0
        self.loop_open = True
        self.update = None
        kept = set() if self.options.reset_clears_lpes or reset == "hard" else {9}
        kept |= set() if self.options.reset_clears_index else {0}
        self.signals &= kept
        self.mask = set()
        self.real = self.velocity_counts = 0
        if self.options.reset_clears_index:
            self.index_position = 0
        self.desired = Fraction(0)
        self.speed = self.a = self.limit = self.target = 0
        self.activity = "none"
        self.mode_bits = 0
        self.breakpoint = None
        self.magnitude = self.sign = 0
        self.busy_until = 0
        self.outlives = set()
        self.lingers_until = 0
        self.words = None
        self.answer = b""
        self.phase, self.high = 0, 0
        self.strobe = ""
        self.strobe_counts = "no"
        self.drop_counts()

    def drop_counts(self):
        """In a reset; a wait for an index may go on (R6), but what was caught is lost."""
        armed = self.encoder.armed
        self.encoder.drop()
        if not self.options.reset_clears_index:
            self.encoder.armed = armed
        if not self.encoder.armed:
            self.signals.discard(0)

    # -------------------------------------------------------------------------------------- time

    def run_to(self, tick):
        while self.alive_at is not None:
            if self.reset and self.alive_at <= tick:
                self.reset = None
                self.next_sample = self.alive_at + 8192
                if not self.options.reset_restarts_samples:
                    self.next_sample -= self.next_sample % 8192
                self.encoder.run_to(self.alive_at)
                self.clear_after_reset()
            elif not self.reset and self.next_sample <= tick:
                self.sample(self.next_sample)
                self.next_sample += 8192
            else:
                return

    def clear_after_reset(self):
        self.drop_counts()
        self.mask = {1, 2, 3, 4, 5} if self.options.reset_interrupts else set()
        self.signals |= {8, 7}
        self.flag(2)
        self.mask = {1, 2, 3, 4, 5}
        if self.options.reset_breakpoint == "fires":
            self.breakpoint = (0, True)
        if self.options.reset_breakpoint == "stays":
            self.signals.add(6)
            self.outlives = {6}

    def flag(self, bit):
        if bit not in self.signals and bit in self.mask:
            self.signals.add(15)
        self.signals.add(bit)

    def complain(self, about):
        if about:
            self.flag(1)

    def sample(self, tick):
        events = set()
        counts, index = self.encoder.take(tick)
        if index is not None:
            self.index_position = modular(self.real + index, 31)
            self.signals.discard(0)
            events.add(3)
        self.velocity_counts = counts
        if self.real + counts != modular(self.real + counts, 31):
            events.add(4)
        passed = self.places_passed(counts)
        self.real = modular(self.real + counts, 31)
        if self.start is not None:
            self.begin_motion(events)
        if self.update is not None:
            self.pid.load(**self.update)
            if self.options.update_clears:
                self.pid.forget()
            self.update = None
            self.signals.discard(13)
        drive = 0
        if not self.loop_open:
            self.profile(events)
            error = modular(math.floor(self.desired) - self.real, 31)
            judged = error if self.options.error_test == "full" else between(-32768, error, 32767)
            before, self.excess = self.excess, abs(judged) > self.threshold
            if self.excess:
                if self.options.error_flag_repeats or not before:
                    events.add(5)
                if 9 in self.signals:
                    self.turn_off(events)
                    self.lost_wheels += 1
            if not self.loop_open:
                drive = self.pid.step(error)
        if self.loop_open:
            self.stand_at_real()
            self.excess = False
            if self.options.open_loop_clears:
                self.pid.forget()
        rounded = math.floor if self.options.output_rounding == "down" else math.trunc
        top = rounded(Fraction(drive, 256))
        self.magnitude = min(127, abs(top))
        if not self.loop_open:
            self.sign = self.options.sign_of_negative if top < 0 else int(not self.options.sign_of_negative)
        elif not self.options.off_keeps_sign:
            self.sign = 0
        if self.breakpoint is not None:
            place, there = self.breakpoint
            if there or place in (passed[-1:] if self.options.breakpoint_exact else passed):
                events.add(6)
                self.breakpoint = None
        for bit in sorted(events):
            self.flag(bit)

    def places_passed(self, counts):
        """Those that the axis comes to one after the other."""
        step = 1 if counts > 0 else -1
        return [modular(self.real + step * count, 31) for count in range(1, abs(counts) + 1)]

    def stand_at_real(self):
        self.desired = Fraction(self.real)
        self.speed = 0
        self.activity = "none"

    def turn_off(self, events):
        self.loop_open = True
        self.signals.add(7)
        events.add(2)

    def begin_motion(self, events):
        assert self.start is not None
        if self.loop_open:
            self.stand_at_real()
        if self.options.start_takes == "sample":
            self.take()
        self.target = self.goal(self.start["p"], self.start_relative)
        if not self.newer_position:
            self.buffer["p"], self.relative = self.target, False
        self.a, self.limit = self.start["a"], self.start["v"]
        control = self.start["control"]
        self.mode_bits = control & 0x1800
        self.show(control)
        self.start = None
        self.loop_open = False
        if control & 0x0100:
            self.turn_off(events)
        elif control & 0x0200:
            self.target = self.real if self.options.abrupt_stop_at == "real" else math.floor(self.desired)
            self.arrive(events)
        else:
            self.activity = "stop" if control & 0x0400 else "velocity" if control & 0x0800 else "position"

    def goal(self, position, relative):
        bases = {
            "real": self.real,
            "desired": math.floor(self.desired),
            "target": math.floor(self.desired) if self.mode_bits & 0x0800 else self.target,
        }
        return modular(position + bases[self.options.relative_base], 31) if relative else position

    def commanded_target(self):
        """That of the last STT, executed or not."""
        if self.start is None or self.options.breakpoint_base == "working":
            return self.target
        if not self.start:  # it will take what is in the buffers by then
            return self.goal(self.buffer["p"], self.relative)
        return self.goal(self.start["p"], self.start_relative)

    def arrive(self, events):
        self.desired = Fraction(self.target)
        self.speed = 0
        self.activity = "none"
        self.signals.add(10)
        events.add(2)

    def move(self, speed, events):
        self.speed = speed
        self.desired += speed * LSB
        wrapped = modular(math.floor(self.desired), 31)
        if wrapped != math.floor(self.desired):
            events.add(4)
            self.desired += wrapped - math.floor(self.desired)

    def profile(self, events):
        if self.activity in ("velocity", "stop"):
            goal = 0 if self.activity == "stop" else self.limit * (1 if self.mode_bits & 0x1000 else -1)
            self.move(between(self.speed - self.a, goal, self.speed + self.a), events)
            if self.activity == "stop" and self.speed == 0:
                self.target = math.floor(self.desired)
                fraction = self.desired - self.target if self.options.stop_keeps_fraction else Fraction(0)
                self.arrive(events)
                self.desired += fraction
        elif self.activity == "position":
            left = self.target - self.desired
            if left == 0 and self.speed == 0:
                self.arrive(events)
                return
            s = 1 if left > 0 or (left == 0 and self.speed > 0) else -1
            v, distance = s * self.speed, abs(left)
            if 0 <= v <= self.a and distance <= min(self.a, self.limit) * LSB:
                self.arrive(events)
            else:
                self.move(s * profile_speed(v, self.a, self.limit, distance), events)

    # -------------------------------------------------------------------------------------- pins
    def set_reset(self, tick, level):
        self.run_to(tick)
        if self.rst and not level:
            self.rst_fell = tick
            self.threshold = 0x7FFF
            self.alive_at = None
            self.encoder.run_to(tick)
            self.clear("hard")
        elif level and not self.rst and tick - self.rst_fell >= 4 * self.options.reset_pulse_clocks:
            self.alive_at = math.ceil(Fraction(tick, 4)) * 4 + 4 * self.options.reset_clocks
        self.rst = level

    def set_encoder(self, tick, a, b):
        self.encoder.set_phases(tick, a, b)

    def set_index(self, tick, level):
        self.encoder.set_index(tick, level)

    def set_bus(self, tick, cs, rd, wr, ps, data):
        self.run_to(tick)
        flags = self.status_at(tick) & 0xFE
        new = "write" if not cs and not wr else "read" if not cs and not rd else ""
        old = "write" if not self.pins["cs"] and not self.pins["wr"] else ""
        old = old or ("read" if not self.pins["cs"] and not self.pins["rd"] else "")
        before = self.pins
        self.pins = {"cs": cs, "rd": rd, "wr": wr, "ps": ps, "data": data}
        ends = bool(old) and new != old
        late = self.strobe_ends(tick, old, before) if ends else None
        if new and new != old:
            self.strobe_begins(tick, new, flags)
        if late is not None:
            late()

    def strobe_begins(self, tick, kind, flags):
        busy = tick < self.busy_until or self.reset is not None
        if kind == "write":
            self.strobe_counts = "no" if busy else "yes"
            if self.options.busy_judged == "end" and self.reset is None:
                self.strobe_counts = "we will see"
            self.lost += self.strobe_counts == "no"
        elif self.pins["ps"] == 0:
            misuse = self.options.status_read_flags and self.words is not None and not busy
            self.strobe_counts = "error" if misuse else "no"
            self.driven = self.status_at(tick) if self.reset else flags | self.status_at(tick) & 1
        else:
            flagged = self.options.undue_data_flags or self.words is not None
            self.strobe_counts = "no" if busy else "yes" if self.answer else "error" if flagged else "no"
            self.driven = self.answer[0] if self.answer and not busy else self.port_byte

    def strobe_ends(self, tick, kind, pins):
        """What the end of a strobe does to the port at once; returns what it does to the chip."""
        if self.strobe_counts == "we will see":
            self.strobe_counts = "no" if tick < self.busy_until else "yes"
            self.lost += self.strobe_counts == "no"
        if self.strobe_counts == "no":
            return lambda: None
        if self.strobe_counts == "error":
            return lambda: self.flag(1)
        if kind == "read":
            self.answer = self.answer[1:]
            self.port_byte = self.driven
            self.phase = 1 - self.phase
            if self.phase == 0:
                self.busy_until = tick + 4 * self.options.busy_clocks
            return lambda: None
        if pins["ps"] == 0:
            unfinished = self.words is not None or bool(self.answer)
            self.words, self.answer = None, b""
            if self.options.command_resets_phase:
                self.phase = 0
            self.busy_until = tick + 4 * self.options.busy_clocks
            return lambda: self.command(tick, pins["data"], unfinished)
        if self.words is None:
            return lambda: self.complain(self.options.undue_data_flags or bool(self.answer))
        self.port_byte = pins["data"]
        self.phase = 1 - self.phase
        if self.phase:
            self.high = pins["data"]
            return lambda: None
        word = self.high << 8 | pins["data"]
        self.busy_until = tick + 4 * self.options.busy_clocks
        return lambda: self.give(word)

    def give(self, word):
        assert self.words is not None
        was_high = self.interrupts()
        try:
            self.words.send(word)
        except StopIteration:
            self.words = None
        if was_high and not self.interrupts() and self.options.hi_falls == "busy":
            self.lingers_until = self.busy_until

    def data_out(self, tick):
        reading = not self.pins["cs"] and not self.pins["rd"] and self.pins["wr"]
        return self.driven if reading else -1

    def status_at(self, tick):
        if self.reset:
            return int(self.reset == "soft" and self.options.software_reset_busy)
        return sum(1 << bit for bit in self.signals if 0 < bit < 8) | (tick < self.busy_until)

    def interrupts(self):
        return bool(self.signals & ({15} if self.options.interrupt == "event" else self.mask))

    def hi_at(self, tick):
        """Pin 17, which may stay while the command that resets it is carried out."""
        return int(self.interrupts() or tick < self.lingers_until)

    def signals_word(self):
        return sum(1 << bit for bit in self.signals - {15}) | self.interrupts() << 15

    def pwm_at(self, tick):
        if self.reset or self.alive_at is None:
            return 0
        place = (tick - self.next_sample) % 2048
        if self.options.pulse_at == "end":
            return int(place >= 2048 - 16 * self.magnitude)
        return int(place < 16 * self.magnitude)

    # -------------------------------------------------------------------------------------- commands

    def command(self, tick, opcode, unfinished):
        self.complain(unfinished and self.options.unfinished_flags)
        words = {
            0x1A: lambda: self.load_threshold(stop=True),
            0x1B: lambda: self.load_threshold(stop=False),
            0x1C: self.mask_interrupts,
            0x1D: self.reset_interrupts,
            0x1E: self.load_filter,
            0x1F: self.load_trajectory,
            0x20: lambda: self.set_breakpoint(relative=False),
            0x21: lambda: self.set_breakpoint(relative=True),
        }
        if opcode in words:
            self.words = words[opcode]()
            next(self.words)
        elif opcode in HIGH_WORD_READS:
            length = 2 * HIGH_WORD_READS[opcode]
            self.answer = (self.reading(tick, opcode) % (1 << 8 * length)).to_bytes(length, "big")
            self.answer = self.answer[self.phase :]  # B3: after half a word the other half
        elif opcode == 0x00:
            self.alive_at = math.ceil(Fraction(tick, 4)) * 4 + 4 * self.options.reset_clocks
            self.encoder.run_to(tick)
            self.clear("soft")
        elif opcode == 0x01:
            self.start_motion()
        elif opcode == 0x02:
            if self.options.home_shifts_buffer and not self.relative:
                self.buffer["p"] = modular(self.buffer["p"] - self.real, 31)
            self.desired = self.home(self.desired)
            self.target = modular(self.target - self.real, 31)
            self.real = 0
        elif opcode == 0x03:
            self.signals.add(0)
            self.encoder.arm(tick)
        elif opcode == 0x04:
            self.update = dict(self.filter)
            self.signals.add(13)
        elif opcode == 0x05:
            self.signals.add(8)
        elif opcode == 0x06:
            self.signals -= {8} if self.options.port12_clears else set()
        else:
            self.complain(self.options.unknown_opcode_flags)

    def home(self, position):
        moved = position - self.real
        return moved + modular(math.floor(moved), 31) - math.floor(moved)

    def reading(self, tick, opcode):
        limited_sum = between(-self.pid.il, self.pid.top(), self.pid.il)
        real = self.real
        if self.options.read_position == "live":
            self.encoder.run_to(tick)
            real = modular(real + self.encoder.counts, 31)
        return {
            0x07: self.speed,
            0x08: math.floor(self.desired),
            0x09: self.index_position,
            0x0A: real,
            0x0B: self.velocity_counts,
            0x0C: self.signals_word(),
            0x0D: self.pid.integral if self.options.sum_reading == "term" else limited_sum,
        }[opcode]

    def show(self, control):
        """What STT does to the signals: bits 10 and 7 go (7 not if it turns the motor off), 11 and 12 are as loaded."""
        self.signals -= {10, 11, 12} if control & 0x0100 else {7, 10, 11, 12}
        self.signals |= {bit for bit in (11, 12) if control >> bit & 1}

    def stopped(self):
        """By the last order, if it was to turn the motor off or to stop abruptly, or by what has come of it."""
        if self.start is not None:
            return self.ordered & 0x0300 != 0
        return bool(self.signals & {7, 10})

    def start_motion(self):
        stopping = self.buffer["control"] & 0x0700 and self.options.stop_lifts_refusal
        if 14 in self.signals and not self.stopped() and not stopping:
            self.flag(1)
            return
        if self.start is not None and self.options.second_start == "follows":
            events = set()
            self.begin_motion(events)
            for bit in sorted(events):
                self.flag(bit)
        elif self.start is not None:
            self.lost_starts += 1
        self.start = {}
        self.ordered = self.buffer["control"]
        if self.options.start_shows == "accepted":
            self.show(self.ordered)
        if self.options.start_takes == "given":
            self.take()
        self.signals.discard(14)

    def take(self):
        self.start = dict(self.buffer)
        self.start_relative = self.relative
        self.buffer["control"] &= 0x1F00 if self.options.stop_bits_stay else 0x1800
        self.newer_position = False

    def fitted(self, value, bits):
        """A parameter without sign."""
        if value < 1 << bits:
            return value
        self.complain(self.options.range_flags)
        return (1 << bits) - 1 if self.options.out_of_range == "clamped" else value % (1 << bits)

    def load_threshold(self, stop):
        self.threshold = self.fitted((yield), 15)
        self.signals.discard(9)
        if stop:
            self.signals.add(9)

    def mask_interrupts(self):
        word = yield
        self.mask = {bit for bit in INTERRUPTS if word >> bit & 1}

    def reset_interrupts(self):
        word = yield
        self.signals -= {15} | {bit for bit in INTERRUPTS if not word >> bit & 1} - self.outlives
        self.outlives = set()

    def load_filter(self):
        control = yield
        self.filter["ds"] = control >> 8
        for bit, name in ((3, "kp"), (2, "ki"), (1, "kd"), (0, "il")):
            if control >> bit & 1:
                self.filter[name] = self.fitted((yield), 15)

    def load_trajectory(self):
        control = yield
        self.buffer["control"] = control & 0x1F00
        if self.options.unsent == "working":
            in_force = {0x20: ("a", self.a), 0x08: ("v", self.limit), 0x02: ("p", self.target)}
            self.buffer |= dict(pair for bit, pair in in_force.items() if not control & bit)
            self.relative = self.relative and bool(control & 0x02)
        for bit, name in ((5, "a"), (3, "v"), (1, "p")):
            if not control >> bit & 1:
                continue
            high = yield
            value = high << 16 | (yield)
            relative = bool(control >> bit - 1 & 1)
            if name == "p":
                value = modular(value, 32)
                if value != modular(value, 31):
                    self.complain(self.options.range_flags)
                    if self.options.out_of_range == "clamped" and not relative:
                        value = between(-(2**30), value, 2**30 - 1)
                self.buffer["p"] = modular(value, 31)
                self.relative, self.newer_position = relative, True
            elif relative:
                working = self.a if name == "a" else self.limit
                base = working if self.options.relative_rates == "working" else self.buffer[name]
                self.buffer[name] = (value + base) % 2**30
            else:
                self.buffer[name] = self.fitted(value, 30)
            if name == "a":
                self.signals.add(14)

    def set_breakpoint(self, relative):
        high = yield
        low = yield
        base = self.commanded_target() if relative else 0
        place = modular(base + (high << 16 | low), 31)
        self.breakpoint = (place, place == self.real)
