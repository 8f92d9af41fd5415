"""Watches what firmware does without noticing: variables that an interrupt may change between two halves.

    main       MOV A,stamp        MOV B,stamp+1         a pair of accesses, of one C line
                          ^ IE lets a routine in here that writes `stamp`, now or at another time: may be torn
Steps are counted over all levels; `level` is 0 in main, 1 and 2 in routines of low and high priority. A place is an
address of internal RAM, or 256 + one of external RAM. What follows for C is in `findings.py`.
"""

from __future__ import annotations

from miro_robot.inspect.sanitizer_layout import CONSTANT, LOCAL, READS, SCALAR, SPECIAL, WRITES, Layout
from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu

_PLACES = 65792
_XRAM = 256
_SCALAR, _LOCAL = SCALAR, LOCAL
_FIRST, _SECOND, _INDIRECT, _DPTR, _PAGE = 1, 2, 3, 4, 5  # see `FORMS`
_SFRS, _EA = 0x80, 0x80
_CALL, _RET, _RETI, _PUSH, _CLEAR, _JBC, _MOVC, _MOVX_READ, _MOVX_WRITE = range(1, 10)  # see `SPECIAL`
_SP, _SCON, _SBUF, _RI_BIT, _RI, _MODES, _NEVER = 0x81, 0x98, 0x99, 0x98, 1, 0xC0, 1 << 61
_TL0, _TH1, _TL2, _TH2 = 0x8A, 0x8D, 0xCC, 0xCD
_DEEPEST, _GROWTHS, _NEAR, _AGAIN, _IN_CODE, _ENOUGH = 128, 3, 8, 12, 0x80, 1 << 30
TORN_READ, TORN_WRITE, LOST, SHARED, CHECKED = 1, 2, 3, 4, 5
REGISTERS, RET_OF_INTERRUPT, RETI_OF_CALL, OVERWRITTEN, UNBALANCED, LEAK = 1, 2, 3, 4, 5, 6
CUT_OFF, UNREAD, TIMER, NO_RAM, NO_CODE, CONST, UNWRITTEN, OVERRUN = 7, 8, 9, 10, 11, 12, 13, 14
_REGISTERS, _RET_OF_INTERRUPT, _RETI_OF_CALL, _OVERWRITTEN = (
    REGISTERS,
    RET_OF_INTERRUPT,
    RETI_OF_CALL,
    OVERWRITTEN,
)
_UNBALANCED, _LEAK, _CUT_OFF, _UNREAD, _TIMER, _NO_RAM = UNBALANCED, LEAK, CUT_OFF, UNREAD, TIMER, NO_RAM
_NO_CODE, _CONST, _UNWRITTEN, _OVERRUN = NO_CODE, CONST, UNWRITTEN, OVERRUN
_TORN_READ, _TORN_WRITE, _LOST, _SHARED, _CHECKED = TORN_READ, TORN_WRITE, LOST, SHARED, CHECKED
_DEC, _DJNZ, _SOON = 0x15, 0xD5, 6
_LONGEST_GAP, _ENDED = 64, 8
_NO_TIMERS = 0x15  # the sources that are none, as bits of IE


class Sanitizer(Watcher):
    """Of one CPU. `pairs`: (kind, first instruction, second) -> [place, sources that could come between, tick of the
    second]. `events`: the same key -> (tick, source << 16 | the instruction that came between, its place) of the first
    time. `notes`: (mistake, instruction, another one, which) -> tick of the first time. `ram`: bytes of external RAM;
    -1: other things answer to MOVX, too.
    """

    def __init__(self, layout: Layout, ram: int = -1) -> None:
        self.reads = READS
        self.writes = WRITES
        self.constant = CONSTANT  # by opcode
        self.line_of = [0] * 65536
        self.kind_of = [0] * 65792
        self.key_of = [0] * 65792
        self.readers = [0] * 394752  # by source and key: 1 + where its routine first did
        self.writers = [0] * 394752
        self.read_step = [0] * 197376  # by level and key: when it last did
        self.write_step = [0] * 197376
        self.read_pc = [0] * 197376
        self.write_pc = [0] * 197376
        self.read_seen = [0] * 197376  # bytes of the variable that this access has had
        self.write_seen = [0] * 197376
        self.zero_step = [0] * 197376
        self.zeroers = [0] * 394752
        self.line = [0] * 3
        self.began = [0] * 3  # step at which the level came to its line
        self.serving = [0] * 3
        self.entered = [0] * 3  # step at which the level's routine began
        self.last_open = [0] * 6
        self.known_pair = [0] * 65536
        self.known_open = [0] * 65536
        self.step = 0
        self.closed = 0
        self.level = 0
        self.open = 0
        self.priorities = -1
        self.tick = 0
        self.pairs: dict[tuple[int, int, int], list[int]] = {}
        self.events: dict[tuple[int, int, int], tuple[int, int, int]] = {}
        self.ram = ram
        self.written = bytearray(65536)  # bytes of external RAM
        self.special = SPECIAL
        self.put_generic = layout.put_generic
        self.notes: dict[tuple[int, int, int, int], int] = {}
        self.a = 0
        self.scon = 0
        self.overruns = 0
        self.depth = 0  # of the functions and routines that are known to be under way
        self.frame_sp = [0] * 128  # SP after the call
        self.frame_back = [0] * 128  # where it has to return to
        self.frame_entry = [0] * 128
        self.frame_source = [0] * 128  # 0 of a call, else 1 + source, and `_ENDED` after its RETI
        self.saved = [0] * 1664  # registers at interrupts, 13 a frame
        self.from_reset = 0  # whether frame 0 is that of reset, and no jump went astray
        self.leak_sp = [0] * 65536
        self.leak_count = [0] * 65536
        self.sent_tick = 0
        self.sent_pc = 0
        self.unread = 0
        self.cleared_pc = -1
        self.level_steps = [0] * 3
        self.half = [0] * 9  # by level and timer: 1 + which half was read first; 3 more once both were
        self.half_step = [0] * 9
        self.half_pc = [0] * 9
        self.other_pc = [0] * 9
        self.copied = [-2] * 65536  # by instruction: what it read last of code
        self.reads_sbuf = 0
        for address, line in layout.lines.items():
            self.line_of[address] = line
        for place, (kind, key) in layout.places.items():
            self.kind_of[place] = kind
            self.key_of[place] = key

    def attached(self, cpu: Cpu) -> None:
        self.interrupts = cpu.peripherals.interrupts
        self.scon = cpu.peripherals.uart.scon
        self.overruns = cpu.peripherals.uart.overruns
        self.from_reset = 1 if cpu.cycles == 0 else 0
        self._look(cpu)

    def resumed(self, cpu: Cpu) -> None:
        """The count of lost characters is no state: it does not go back."""
        self.overruns = max(self.overruns, cpu.peripherals.uart.overruns)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        self.step += 1
        self.level_steps[self.level] += 1
        opcode = cpu.rom[pc]
        line = self.line_of[pc]
        if line != self.line[self.level]:
            self.line[self.level] = line
            self.began[self.level] = self.step
        self.tick = 12 * start
        if opcode in (_DEC, _DJNZ) and self.kind_of[cpu.rom[pc + 1]] == _SCALAR:
            self._decrement(cpu.rom[pc + 1], pc)
        form = self.reads[opcode]
        if form:
            place = self._place(cpu, form, pc, opcode)
            if place < 0:
                self._read_register(cpu, -place, pc)
            elif self.kind_of[place]:
                self._read(place, pc)
        form = self.writes[opcode]
        if form:
            place = self._place(cpu, form, pc, opcode)
            if place < 0:
                self._write_register(cpu, -place, pc)
            elif self.kind_of[place]:
                self._write(place, pc, self.constant[opcode])
                if self.level and place < _XRAM and cpu.iram[place] == 0:
                    self._zeroed(place, pc)
        if self.special[opcode]:
            self._special(cpu, self.special[opcode], pc, opcode)
        uart = cpu.peripherals.uart
        scon = uart.scon
        if uart.overruns > self.overruns:
            self._lost(pc)
        if scon != self.scon:
            if scon & ~self.scon & _RI:
                self._received()
            self.scon = scon
        self.a = cpu.a
        self._look(cpu)

    def ran(self, cpu: Cpu, start: int) -> None:
        """Firmware that never looks at the serial port has lost characters by now."""
        if cpu.peripherals.uart.overruns > self.overruns:
            self._lost(cpu.pc)

    def _lost(self, pc: int) -> None:
        """The first character: the others have the same cause."""
        self.overruns = _ENOUGH
        self._note(_OVERRUN, pc, -1, 0)

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        self.step += 1
        self._look(cpu)
        self.serving[self.level] = source
        self.entered[self.level] = self.step
        self.line[self.level] = -1
        scon = cpu.peripherals.uart.scon
        if scon & ~self.scon & _RI:
            self._received()
        self.scon = scon
        self._enter(cpu, cpu.pc, pc, 1 + source)

    def _place(self, cpu: Cpu, form: int, pc: int, opcode: int) -> int:
        """Of an operand, after its instruction; the negative address of a register of the chip."""
        if form == _INDIRECT:
            return cpu.iram[cpu.bank + (opcode & 1)]
        if form == _DPTR:
            return _XRAM + cpu.dptr
        if form == _PAGE:
            return _XRAM + (cpu.page() << 8 | cpu.iram[cpu.bank + (opcode & 1)])
        direct = cpu.rom[pc + form]
        return direct if direct < _SFRS else -direct

    def _read(self, place: int, pc: int) -> None:
        level = self.level
        key = self.key_of[place]
        at = level * _PLACES + key
        if level and not self.readers[self.serving[level] * _PLACES + key]:
            self.readers[self.serving[level] * _PLACES + key] = pc + 1
        if self.kind_of[place] == _LOCAL:
            # What a routine keeps for its next call has one user.
            if self.write_step[at] > self.entered[level]:
                self._pair(_SHARED, self.write_pc[at], pc, self.write_step[at], key)
        else:
            bit = 1 << (place - key)
            seen = self.read_seen[at]
            if seen & bit or self.read_step[at] < self.began[level]:  # a new access to it
                seen = 0
            if seen:
                self._pair(_TORN_READ, self.read_pc[at], pc, self.read_step[at], key)
            self.read_seen[at] = seen | bit
        self.read_step[at] = self.step
        self.read_pc[at] = self.serving[level] << 16 | pc

    def _write(self, place: int, pc: int, constant: int) -> None:
        """`constant`: what is written does not depend on what was read by another instruction."""
        level = self.level
        key = self.key_of[place]
        at = level * _PLACES + key
        if level and not self.writers[self.serving[level] * _PLACES + key]:
            self.writers[self.serving[level] * _PLACES + key] = pc + 1
        if self.kind_of[place] == _SCALAR:
            bit = 1 << (place - key)
            seen = self.write_seen[at]
            if seen & bit or self.write_step[at] < self.began[level]:
                seen = 0
            if seen:
                self._pair(_TORN_WRITE, self.write_pc[at], pc, self.write_step[at], key)
            self.write_seen[at] = seen | bit
            if not constant and self.read_seen[at] & bit and self.read_step[at] >= self.began[level]:
                self._pair(_LOST, self.read_pc[at], pc, self.read_step[at], key)
        self.write_step[at] = self.step
        self.write_pc[at] = self.serving[level] << 16 | pc

    def _zeroed(self, place: int, pc: int) -> None:
        """A routine left 0 there."""
        key = self.key_of[place]
        self.zero_step[self.level * _PLACES + key] = self.step
        self.zeroers[self.serving[self.level] * _PLACES + key] = pc + 1

    def _decrement(self, place: int, pc: int) -> None:
        """Of what was just looked at: where a routine leaves 0 between both, it becomes 255."""
        at = self.level * _PLACES + self.key_of[place]
        if self.level < 2 and self.read_step[at] and self.step - self.read_step[at] <= _SOON:
            self._pair(_CHECKED, self.read_pc[at], pc, self.read_step[at], self.key_of[place])

    def _pair(self, kind: int, first: int, pc: int, since: int, key: int) -> None:
        """The instructions at `first`, in step `since`, and at `pc`, now, belong together."""
        first &= 0xFFFF
        for higher in range(self.level + 1, 3):
            at = higher * _PLACES + key
            if kind == _CHECKED:
                if self.zero_step[at] > since:
                    self.events.setdefault((kind, first, pc), (self.tick, self.write_pc[at], key))
            elif self.write_step[at] > since:
                self.events.setdefault((kind, first, pc), (self.tick, self.write_pc[at], key))
            elif kind == _TORN_WRITE and self.read_step[at] > since:
                self.events.setdefault((kind, first, pc), (self.tick, self.read_pc[at], key))
        sources = self.open
        if self.closed >= since:
            for source in range(6):
                if self.last_open[source] >= since:
                    sources |= 1 << source
        if sources and (self.known_pair[pc] != kind << 16 | first or sources & ~self.known_open[pc]):
            self.known_pair[pc] = kind << 16 | first
            self.known_open[pc] = sources
            known = self.pairs.setdefault((kind, first, pc), [key, 0, self.tick])
            known[1] |= sources

    def _look(self, cpu: Cpu) -> None:
        """Which sources may interrupt before the next instruction, and at which level that is."""
        interrupts = self.interrupts
        timers = cpu.peripherals.timers.control
        due = (2 if timers & 0x30 else 0) | (8 if timers & 0xC0 else 0)  # those that run, or have run over
        if cpu.peripherals.timer2.control & 0xC4:
            due |= 0x20
        priorities = due << 24 | interrupts.in_service << 16 | interrupts.ip << 8 | interrupts.ie
        blocked = cpu.blocked == cpu.cycles
        if priorities == self.priorities and not blocked:
            return
        self.priorities = -1 if blocked else priorities
        self.level = min(interrupts.in_service, 2)
        open_now = 0
        if interrupts.ie & _EA and self.level < 2 and not blocked:
            open_now = interrupts.ie & (_NO_TIMERS | due)
            if self.level:
                open_now &= interrupts.ip
        if self.open & ~open_now:
            self.closed = self.step - 1
            for source in range(6):
                if self.open >> source & 1 and not open_now >> source & 1:
                    self.last_open[source] = self.step - 1
        self.open = open_now

    def reader(self, source: int, key: int) -> int:
        """Instruction with which the routine of `source` first read it; -1 if it never did."""
        return self.readers[source * _PLACES + key] - 1

    def writer(self, source: int, key: int) -> int:
        """Instruction with which the routine of `source` first wrote it; -1 if it never did."""
        return self.writers[source * _PLACES + key] - 1

    def zeroer(self, source: int, key: int) -> int:
        """Instruction with which the routine of `source` last left 0 there; -1 if it never did."""
        return self.zeroers[source * _PLACES + key] - 1

    def _note(self, mistake: int, pc: int, other: int, which: int) -> None:
        if (mistake, pc, other, which) not in self.notes:
            self.notes[mistake, pc, other, which] = self.tick

    # Registers of the chip

    def _read_register(self, cpu: Cpu, address: int, pc: int) -> None:
        if address == _SBUF:
            self.unread = 0
            self.reads_sbuf = 1
            self.cleared_pc = -1
        elif _TL0 <= address <= _TH1:
            timer = (address - _TL0) & 1
            timers = cpu.peripherals.timers
            if not timers.tmod >> 4 * timer & 2:  # one count over both bytes
                self._half(timer, address > _TL0 + 1, timers.control >> 2 * timer & 0x10, pc)
        elif _TL2 <= address <= _TH2:
            self._half(2, address == _TH2, cpu.peripherals.timer2.control & 4, pc)

    def _half(self, timer: int, high: int, running: int, pc: int) -> None:
        """One half of a count was read. Right is to read the first one again after the other, or to stop the timer."""
        at = 3 * self.level + timer
        passed = self.level_steps[self.level] - self.half_step[at]
        first = self.half[at]
        if first >= 3:  # both were read
            if high + 4 == first and passed <= _AGAIN:
                self.half[at] = 0
                return
            self._note(_TIMER, self.half_pc[at], self.other_pc[at], timer)
        elif first and high + 1 != first and passed <= _NEAR and running:
            self.half[at] = first + 3
            self.other_pc[at] = pc
            self.half_step[at] = self.level_steps[self.level]
            return
        self.half[at] = high + 1
        self.half_pc[at] = pc
        self.half_step[at] = self.level_steps[self.level]

    def _write_register(self, cpu: Cpu, address: int, pc: int) -> None:
        if address == _SP:
            while self.depth and self.frame_sp[self.depth - 1] > cpu.sp:
                self.depth -= 1
        elif address == _SBUF:
            uart = cpu.peripherals.uart
            if self.tick < self.sent_tick < _NEVER:
                self._note(_CUT_OFF, pc, self.sent_pc, 0)
            self.sent_tick = uart.ti_tick() if uart.scon & _MODES else 0
            self.sent_pc = pc
        elif address == _SCON and self.scon & ~cpu.peripherals.uart.scon & _RI:
            self._cleared(pc)

    def _received(self) -> None:
        """RI went up; a character whose RI was cleared and which nobody has read is lost by then."""
        if self.unread and self.cleared_pc >= 0:
            self._note(_UNREAD, self.cleared_pc, -1, 0)
        self.unread = 1
        self.cleared_pc = -1

    def _cleared(self, pc: int) -> None:
        if self.unread:
            self.cleared_pc = pc

    # Calls and returns, code and external RAM

    def _special(self, cpu: Cpu, special: int, pc: int, opcode: int) -> None:
        if special == _CALL:
            self._grown(cpu.sp - 2, pc)
            if cpu.pc == self.put_generic and cpu.b & _IN_CODE:
                self._note(_CONST, pc, -1, 0)
            self._enter(cpu, cpu.pc, pc + (3 if opcode == 0x12 else 2), 0)
        elif special in (_RET, _RETI):
            self._left(cpu, pc, special == _RETI)
        elif special == _PUSH:
            self._grown(cpu.sp, pc)
        elif special == _CLEAR:
            if cpu.rom[pc + 1] == _RI_BIT and self.scon & _RI:
                self._cleared(pc)
        elif special == _JBC:
            if cpu.rom[pc + 1] == _RI_BIT and cpu.pc != (pc + 3) & 0xFFFF:
                if not self.scon & _RI:  # it went up in this instruction
                    self._received()
                self._cleared(pc)
        elif special == _MOVC:
            address = (self.a + (cpu.dptr if opcode == 0x93 else pc + 1)) & 0xFFFF
            if not cpu.is_loaded(address) and not self._in_gap(cpu, address, self.copied[pc]):
                self._note(_NO_CODE, pc, -1, address)
            self.copied[pc] = address
        elif self.ram >= 0:
            page = opcode & 0xF == 2 or opcode & 0xF == 3
            address = cpu.page() << 8 | cpu.iram[cpu.bank + (opcode & 1)] if page else cpu.dptr
            if address >= self.ram:
                self._note(_NO_RAM, pc, -1, address)
            elif special == _MOVX_WRITE:
                self.written[address] = 1
            elif not self.written[address]:
                self._note(_UNWRITTEN, pc, -1, address)

    def _in_gap(self, cpu: Cpu, address: int, last: int) -> bool:
        """A block copy or a checksum goes on from the image into the image; a string without an end goes anywhere."""
        if address != last + 1:
            return False
        after = address
        while after < 0xFFFF and after < address + _LONGEST_GAP and not cpu.is_loaded(after):
            after += 1
        return bool(cpu.is_loaded(after))

    def _grown(self, sp: int, pc: int) -> None:
        """At an instruction of the frame of reset the stack is as high each time, unless something stays on it: bytes,
        or a frame that was left by a jump. Recursion grows too, in a function that was called.
        """
        last = self.leak_sp[pc]
        if self.level or not self.from_reset or (self.depth and not last):
            return
        if last and sp > last:
            self.leak_count[pc] += 1
            if self.leak_count[pc] == _GROWTHS:
                self._note(_LEAK, pc, -1, 0)
        elif sp < last:
            self.leak_count[pc] = 0
        self.leak_sp[pc] = sp

    def _enter(self, cpu: Cpu, entry: int, back: int, source: int) -> None:
        while self.depth and self.frame_sp[self.depth - 1] > cpu.sp - 2:
            self.depth -= 1
        if self.depth == _DEEPEST:
            self.depth = self.from_reset = 0
        at = self.depth
        self.frame_sp[at] = cpu.sp
        self.frame_back[at] = back & 0xFFFF
        self.frame_entry[at] = entry
        self.frame_source[at] = source
        self.depth += 1
        if source:
            for register in range(13):
                self.saved[13 * at + register] = self._register(cpu, register)

    def _register(self, cpu: Cpu, register: int) -> int:
        """R0 to R7, A, B, DPTR, CY, the bank."""
        if register < 8:
            return cpu.iram[cpu.bank + register]
        if register < 10:
            return cpu.a if register == 8 else cpu.b
        if register == 10:
            return cpu.dptr
        return cpu.cy if register == 11 else cpu.bank

    def _left(self, cpu: Cpu, pc: int, by_reti: int) -> None:
        """RET or RETI went somewhere; what was pushed and not popped makes it a jump, unless one byte is left."""
        before = cpu.sp + 2
        below = -1
        for at in range(self.depth - 1, -1 if by_reti else self.depth, -1):
            if self.frame_source[at]:
                self.frame_source[at] |= _ENDED  # the interrupt is over, wherever it goes on
                break
        while self.depth and self.frame_sp[self.depth - 1] > before:
            self.depth -= 1
            below = self.frame_sp[self.depth] - 2
        if self.depth:
            below = self.frame_sp[self.depth - 1]
        if below < 0 or before - below > 1:
            return
        at = self.depth - 1
        if at >= 0 and before - below == 1 and self.frame_back[at] == cpu.pc:
            self.depth = at  # it leaves a byte to its caller
            return
        if before - below == 1:
            self._note(_UNBALANCED, pc, self.frame_entry[max(at, 0)], 0)
        elif at < 0:
            return
        elif self.frame_back[at] != cpu.pc:
            self._note(_OVERWRITTEN, pc, self.frame_entry[at], 0)
        else:
            self.depth = at
            source = self.frame_source[at]
            if source and not source & _ENDED:
                self._note(_RET_OF_INTERRUPT, pc, -1, source - 1)
            elif by_reti and not source and self.frame_entry[at] != pc:
                self._note(_RETI_OF_CALL, pc, self.frame_entry[at], 0)
            for register in range(12, -1, -1) if source else range(0):
                if self.saved[13 * at + register] != self._register(cpu, register):
                    self._note(_REGISTERS, pc, self.frame_entry[at], register)
                    if register == 12:  # those of the other bank are no news
                        break
            return
        self.depth = self.from_reset = 0  # from here on it may be anywhere
