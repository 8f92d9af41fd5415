"""The AT89C52: a chip that runs, its instructions and the loop that executes them.

Registers, memory and pins are the chip's (`chip.py`), timers and serial port its peripherals' (drawn in README.md).

Timing inside an instruction (4316E section 2.4; what it leaves open is rule C1 in README.md): operands are read in the
instruction's first cycle, `start`; results are written at the end of its last, `cycles`. The loop compares `cycles`
with `limit` once per instruction and knows nothing else about time.

The loop has one shape, a head and one choice among the rows, because the build copies the head to the end of each row
(`threaded` in setup.py); what the head asks has to be rare. Operands are read where they are needed: `rom[at + 1]` and
`rom[at + 2]`.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_robot.faults import FaultKind
from miro_robot.mcs51.chip import ASLEEP, BREAKPOINT, REACHED, REPLAN, STOPPED, WIRE_FULL, Chip, on_load

__all__ = ["ASLEEP", "BREAKPOINT", "REACHED", "REPLAN", "STOPPED", "WIRE_FULL", "Cpu", "on_load"]

_REACHED, _BREAKPOINT, _WIRE_FULL, _ASLEEP, _REPLAN = REACHED, BREAKPOINT, WIRE_FULL, ASLEEP, REPLAN
_MARK = 0x1000  # line that ends a run before its instruction
_UNDEFINED_OPCODE = int(FaultKind.UNDEFINED_OPCODE)
_STACK_OVERFLOW = int(FaultKind.STACK_OVERFLOW)
_STACK_UNDERFLOW = int(FaultKind.STACK_UNDERFLOW)
_OUTSIDE_IMAGE = int(FaultKind.OUTSIDE_IMAGE)
_MAIN_LOOP_STARVED = int(FaultKind.MAIN_LOOP_STARVED)
_INTERRUPT_NOT_LEFT = int(FaultKind.INTERRUPT_NOT_LEFT)
_MOV_DATA = 0x75
_P2 = 0xA0
_CORE = 0xD0  # the core's registers that have bits (PSW, ACC, B) lie from here on
_IDL = 0x01  # PCON
_SPREAD_FROM, _SPREAD_TO = 0x9E35, 0x3C6F  # odd, so that different branches differ in the low bits
_DEPTH = 8  # interrupts in service whose branches are kept; RETI may be forgotten, so more can come
_MARK_CYCLES = 2000  # 1 ms: how often it is checked whether the main loop gets time


class Cpu(Chip):
    """An AT89C52 at 24 MHz. Input is pushed through `set_external` and `rxd`."""

    # Runs

    def run(self, until_cycle: int) -> int:
        """Executes until `cycles` >= `until_cycle`; may end up to 3 cycles late, when an instruction does.

        Returns REACHED, STOPPED (`request_stop`), BREAKPOINT or WIRE_FULL (more than 2048 edges of TXD wait for
        the listener that it has; it does not go on before these are heard). An inspector that is attached runs it in
        its own way, with the same result.
        """
        return self.run_alone(until_cycle) if self.inspector is None else self.inspector.run(until_cycle)

    def run_alone(self, until_cycle: int) -> int:
        """Like `run`, without an inspector."""
        self.begin_run()
        stopped = self.execute(until_cycle)
        self.end_run()
        return stopped

    def go_on(self, until_cycle: int) -> int:
        """A piece of a run, between `begin_run` and `end_run`: what runs in many pieces looks at its lines once.

        An inspector makes runs of the pieces.
        """
        return self.execute(until_cycle) if self.inspector is None else self.inspector.run(until_cycle)

    def step(self) -> int:
        """Executes one instruction or interrupt entry; an idle CPU advances by a cycle."""
        return self.run(self.cycles + 1)

    def run_until_any(self, addresses: tuple[int, ...], until_cycle: int) -> int:
        """Like `run`, but returns BREAKPOINT before the instruction at one of `addresses`; `pc` is that address."""
        self.mark(addresses)
        try:
            return self.run(until_cycle)
        finally:
            self.unmark(addresses)

    def begin_run(self) -> None:
        self.next_mark = (
            (self.cycles // _MARK_CYCLES + 1) * _MARK_CYCLES if self.main_loop_limit else NEVER_TICK
        )
        self.peripherals.look_again()  # more may have been put on RXD since the last run
        # What was due was planned before the caller changed pins or wires: the first boundary plans again.
        self.next_event = 0

    def end_run(self) -> None:
        """TXD is final up to now; RXD before it is no longer needed."""
        self.peripherals.settle(self.cycles)
        now = 12 * self.cycles
        if self.txd.settled_tick < now:
            self.txd.settled_tick = now
        self.rxd.forget(now - 24)

    def boundary(self) -> int:
        """Between two instructions, when `cycles` reached `limit`; 1 ends the run."""
        now = self.cycles
        # Before the end of the run is looked for: a fault found here may be what ends it.
        if now >= self.next_mark:
            self._watch_main_loop(now)
        if self.stop or now >= self.until:
            return 1
        # The listener has to read first: another edge would pass what the ring may hold (line.py).
        if self.txd.full:
            self.stop = _WIRE_FULL
            return 1
        if now >= self.next_event and self._attend(now):
            # Replanned while pins were sampled: ends at the next boundary, for PC may be at a vector now.
            return 1 if self.stop not in (0, _REPLAN) else 0
        event = self._next_look()
        if (self.idle or self.powered_down) and now < event:
            if not self._taken_over():  # nor will it be at a mark
                event = min(self.next_event, self.until)
            self.idle_cycles += event - now
            self.cycles = event
        self.limit = event
        return 0

    def _attend(self, now: int) -> int:
        """Everything due at the start of cycle `now`: 1 if that was an interrupt, or ends the run.

        A run ends before the pins of `now` are sampled: its state is that of any run that ends there.
        """
        peripherals = self.peripherals
        peripherals.sync(now)
        blocked = self.blocked == now or self.powered_down != 0
        # Polled before marks are: an LCALL takes the place of the instruction, so a mark on that is not reached.
        source = -1 if blocked else peripherals.interrupts.choose(now)
        if source < 0:
            self._note_end(now)
        if self.stop:
            return 1
        peripherals.apply_pushes(now)
        peripherals.sample_pins(now)
        if source >= 0:
            self._enter(source)
            return 1
        if self.powered_down:
            self.next_event = peripherals.ports.next_cycle
            return 0
        self.next_event = peripherals.next_event(now + 1 if blocked else now)
        if self.next_event <= now:  # all of now is done: nothing that is due may hold time up
            self.next_event = now + 1
        if self.stop_asleep and self.idle:
            self._look_for_sleep(now)
        return 0

    def executes_next(self) -> bool:
        """True if it continues with the instruction at `pc`: it does not sleep, and no interrupt is entered before."""
        if self.idle or self.powered_down:
            return False
        self.peripherals.sync(self.cycles)
        return self.blocked == self.cycles or self.peripherals.interrupts.choose(self.cycles) < 0

    def _note_end(self, now: int) -> None:
        """Sets `stop` if a mark, or sleep that nothing known ends, ends the run before cycle `now`."""
        if not self.idle and not self.powered_down:
            if self.lines[self.pc] & _MARK:
                self.stop = _BREAKPOINT
        elif self.stop_asleep:
            self.peripherals.settle(now)
            if self.asleep():
                self.stop = _ASLEEP

    def _look_for_sleep(self, now: int) -> None:
        """Looks up again when less may be known of what ends idle mode: then nothing may be left."""
        self.peripherals.settle(now)
        turn = self.peripherals.serial_turn()
        if self.next_event >= NEVER_TICK:
            self.next_event = now + 1
        elif turn < self.next_event:
            self.next_event = turn

    def _watch_main_loop(self, now: int) -> None:
        """Once a millisecond: a fault if interrupts held the CPU at all marks for `main_loop_limit` cycles."""
        self.next_mark = (now // _MARK_CYCLES + 1) * _MARK_CYCLES
        if self._taken_over():
            self.marks += 1
            if (self.marks - 1) * _MARK_CYCLES >= self.main_loop_limit:
                self.marks = 1
                self.fault(_MAIN_LOOP_STARVED)

    def _enter(self, source: int) -> None:
        """The hardware LCALL: two cycles, and the end of idle mode."""
        # Asked before this interrupt counts as in service, else the main level that it interrupts is not seen.
        if not self._taken_over():
            self.marks = 0
        self.idle = 0
        self.pcon &= 0xFF ^ _IDL
        self.enter_edges()
        self.peripherals.taken(source, self.cycles)
        self.start = self.cycles
        self.at = self.pc
        self.cycles += 2
        # in_service is 1 (low), 2 (high) or 3 (high over low): shifted by a bit it is the level just entered.
        self.interrupt_returns[self.peripherals.interrupts.in_service >> 1] = self.sp << 16 | self.pc
        # Vectors 03h, 0Bh, 13h, 1Bh, 23h, 2Bh: eight bytes apart, in polling order (4316E section 2.16).
        self.pc = self.call(self.pc, 8 * source + 3)
        self._expect(self.cycles)

    def end_of_interrupt(self, pc: int) -> None:
        """RETI went to `pc`."""
        for level in range(2):
            if self.interrupt_returns[level] == self.sp << 16 | pc:
                self.interrupt_returns[level] = -1  # taken: from now on any RET may go there
        self.leave_edges()
        self.peripherals.interrupts.leave()
        self._block()

    def return_in_service(self, pc: int) -> None:
        """RET went to `pc` while an interrupt is in service.

        A fault if it took the return address that the interrupt pushed from its place. Returns from functions that the
        routine calls, jumps by PUSH and RET, other stacks, and routines that lowered their level by the RETI of a
        subroutine are none.
        """
        level = self.peripherals.interrupts.in_service >> 1
        if self.interrupt_returns[level] == self.sp << 16 | pc:
            self.interrupt_returns[level] = -1
            self.fault(_INTERRUPT_NOT_LEFT)

    # Instructions

    def execute(self, until_cycle: int) -> int:
        """The loop over instructions: ends at `until_cycle`, or when `stop` is set."""
        self.until = until_cycle
        self.stop = _REACHED
        self.limit = 0
        iram = self.iram
        rom = self.rom
        now = self.cycles
        pc = self.pc
        count = self.instructions
        while True:
            if now >= self.limit:
                self.pc = pc
                if self.boundary():
                    break
                now = self.cycles
                pc = self.pc
                continue
            self.at = pc
            at = pc
            line = self.lines[pc]
            if line & 0x1800:  # no opcode's: a breakpoint, or outside the image
                if line & _MARK:
                    self.stop = _BREAKPOINT
                    break
                self.fault(_OUTSIDE_IMAGE)
                line = self.line_at(pc)
            pc = line >> 16
            self.start = now
            now += (line >> 8) & 0xFF
            self.cycles = now
            count += 1
            row = line & 0xFF
            if row == 0x00:  # NOP
                pass
            elif row == 0x01:  # AJMP addr11
                pc = (pc & 0xF800) | ((rom[at] & 0xE0) << 3) | rom[at + 1]
            elif row == 0x02:  # LJMP addr16
                pc = (rom[at + 1] << 8) | rom[at + 2]
            elif row == 0x03:  # RR A
                self.a = (self.a >> 1) | ((self.a & 1) << 7)
            elif row == 0x04:  # INC A
                self.a = (self.a + 1) & 0xFF
            elif row == 0x05:  # INC dir
                self.write(rom[at + 1], (self.read_latched(rom[at + 1]) + 1) & 0xFF)
            elif row == 0x06:  # INC @Ri
                address = iram[self.bank + (rom[at] & 1)]
                iram[address] = (iram[address] + 1) & 0xFF
            elif row == 0x08:  # INC Rn
                iram[self.bank + (rom[at] & 7)] = (iram[self.bank + (rom[at] & 7)] + 1) & 0xFF
            elif row == 0x10:  # JBC bit,rel
                # JBC reads the latch: it is in the list of read-modify-write instructions (4316E section 2.5).
                if self.latched_bit(rom[at + 1]):
                    self.write_bit(rom[at + 1], 0)
                    pc = self.branch(pc, rom[at + 2])
            elif row == 0x11:  # ACALL addr11
                pc = self.call(pc, (pc & 0xF800) | ((rom[at] & 0xE0) << 3) | rom[at + 1])
            elif row == 0x12:  # LCALL addr16
                pc = self.call(pc, (rom[at + 1] << 8) | rom[at + 2])
            elif row == 0x13:  # RRC A
                value = self.a
                self.a = (value >> 1) | (self.cy << 7)
                self.cy = value & 1
            elif row == 0x14:  # DEC A
                self.a = (self.a - 1) & 0xFF
            elif row == 0x15:  # DEC dir
                self.write(rom[at + 1], (self.read_latched(rom[at + 1]) - 1) & 0xFF)
            elif row == 0x16:  # DEC @Ri
                address = iram[self.bank + (rom[at] & 1)]
                iram[address] = (iram[address] - 1) & 0xFF
            elif row == 0x18:  # DEC Rn
                iram[self.bank + (rom[at] & 7)] = (iram[self.bank + (rom[at] & 7)] - 1) & 0xFF
            elif row == 0x20:  # JB bit,rel
                if self.read_bit(rom[at + 1]):
                    pc = self.branch(pc, rom[at + 2])
            elif row == 0x22:  # RET
                value = self.pop() << 8
                pc = value | self.pop()
                if self.peripherals.interrupts.in_service:
                    self.return_in_service(pc)
            elif row == 0x23:  # RL A
                self.a = ((self.a << 1) & 0xFF) | (self.a >> 7)
            elif row == 0x24:  # ADD A,#imm
                self.add(rom[at + 1], 0)
            elif row == 0x25:  # ADD A,dir
                self.add(self.read(rom[at + 1]), 0)
            elif row == 0x26:  # ADD A,@Ri
                self.add(iram[iram[self.bank + (rom[at] & 1)]], 0)
            elif row == 0x28:  # ADD A,Rn
                self.add(iram[self.bank + (rom[at] & 7)], 0)
            elif row == 0x30:  # JNB bit,rel
                if not self.read_bit(rom[at + 1]):
                    pc = self.branch(pc, rom[at + 2])
            elif row == 0x32:  # RETI
                value = self.pop() << 8
                pc = value | self.pop()
                self.end_of_interrupt(pc)
            elif row == 0x33:  # RLC A
                value = self.a
                self.a = ((value << 1) & 0xFF) | self.cy
                self.cy = value >> 7
            elif row == 0x34:  # ADDC A,#imm
                self.add(rom[at + 1], self.cy)
            elif row == 0x35:  # ADDC A,dir
                value = self.read(rom[at + 1])  # which may be PSW: CY is taken after
                self.add(value, self.cy)
            elif row == 0x36:  # ADDC A,@Ri
                self.add(iram[iram[self.bank + (rom[at] & 1)]], self.cy)
            elif row == 0x38:  # ADDC A,Rn
                self.add(iram[self.bank + (rom[at] & 7)], self.cy)
            elif row == 0x40:  # JC rel
                if self.cy:
                    pc = self.branch(pc, rom[at + 1])
            elif row == 0x42:  # ORL dir,A
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) | self.a)
            elif row == 0x43:  # ORL dir,#imm
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) | rom[at + 2])
            elif row == 0x44:  # ORL A,#imm
                self.a |= rom[at + 1]
            elif row == 0x45:  # ORL A,dir
                self.a |= self.read(rom[at + 1])
            elif row == 0x46:  # ORL A,@Ri
                self.a |= iram[iram[self.bank + (rom[at] & 1)]]
            elif row == 0x48:  # ORL A,Rn
                self.a |= iram[self.bank + (rom[at] & 7)]
            elif row == 0x50:  # JNC rel
                if not self.cy:
                    pc = self.branch(pc, rom[at + 1])
            elif row == 0x52:  # ANL dir,A
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) & self.a)
            elif row == 0x53:  # ANL dir,#imm
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) & rom[at + 2])
            elif row == 0x54:  # ANL A,#imm
                self.a &= rom[at + 1]
            elif row == 0x55:  # ANL A,dir
                self.a &= self.read(rom[at + 1])
            elif row == 0x56:  # ANL A,@Ri
                self.a &= iram[iram[self.bank + (rom[at] & 1)]]
            elif row == 0x58:  # ANL A,Rn
                self.a &= iram[self.bank + (rom[at] & 7)]
            elif row == 0x60:  # JZ rel
                if self.a == 0:
                    pc = self.branch(pc, rom[at + 1])
            elif row == 0x62:  # XRL dir,A
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) ^ self.a)
            elif row == 0x63:  # XRL dir,#imm
                self.write(rom[at + 1], self.read_latched(rom[at + 1]) ^ rom[at + 2])
            elif row == 0x64:  # XRL A,#imm
                self.a ^= rom[at + 1]
            elif row == 0x65:  # XRL A,dir
                self.a ^= self.read(rom[at + 1])
            elif row == 0x66:  # XRL A,@Ri
                self.a ^= iram[iram[self.bank + (rom[at] & 1)]]
            elif row == 0x68:  # XRL A,Rn
                self.a ^= iram[self.bank + (rom[at] & 7)]
            elif row == 0x70:  # JNZ rel
                if self.a != 0:
                    pc = self.branch(pc, rom[at + 1])
            elif row == 0x72:  # ORL C,bit
                self.cy |= self.read_bit(rom[at + 1])
            elif row == 0x73:  # JMP @A+DPTR
                pc = self.fork((self.a + self.dptr) & 0xFFFF)
            elif row == 0x74:  # MOV A,#imm
                self.a = rom[at + 1]
            elif row == 0x75:  # MOV dir,#imm
                self.write(rom[at + 1], rom[at + 2])
            elif row == 0x76:  # MOV @Ri,#imm
                iram[iram[self.bank + (rom[at] & 1)]] = rom[at + 1]
            elif row == 0x78:  # MOV Rn,#imm
                iram[self.bank + (rom[at] & 7)] = rom[at + 1]
            elif row == 0x80:  # SJMP rel
                pc = self.branch(pc, rom[at + 1])
            elif row == 0x82:  # ANL C,bit
                self.cy &= self.read_bit(rom[at + 1])
            elif row == 0x83:  # MOVC A,@A+PC
                self.a = rom[(pc + self.a) & 0xFFFF]
            elif row == 0x84:  # DIV AB
                self.divide()
            elif row == 0x85:  # MOV dst,src
                self.write(rom[at + 2], self.read(rom[at + 1]))
            elif row == 0x86:  # MOV dir,@Ri
                self.write(rom[at + 1], iram[iram[self.bank + (rom[at] & 1)]])
            elif row == 0x88:  # MOV dir,Rn
                self.write(rom[at + 1], iram[self.bank + (rom[at] & 7)])
            elif row == 0x90:  # MOV DPTR,#imm16
                self.dptr = (rom[at + 1] << 8) | rom[at + 2]
            elif row == 0x92:  # MOV bit,C
                self.write_bit(rom[at + 1], self.cy)
            elif row == 0x93:  # MOVC A,@A+DPTR
                self.a = rom[(self.dptr + self.a) & 0xFFFF]
            elif row == 0x94:  # SUBB A,#imm
                self.subtract(rom[at + 1])
            elif row == 0x95:  # SUBB A,dir
                self.subtract(self.read(rom[at + 1]))
            elif row == 0x96:  # SUBB A,@Ri
                self.subtract(iram[iram[self.bank + (rom[at] & 1)]])
            elif row == 0x98:  # SUBB A,Rn
                self.subtract(iram[self.bank + (rom[at] & 7)])
            elif row == 0xA0:  # ORL C,/bit
                self.cy |= self.read_bit(rom[at + 1]) ^ 1
            elif row == 0xA2:  # MOV C,bit
                self.cy = self.read_bit(rom[at + 1])
            elif row == 0xA3:  # INC DPTR
                self.dptr = (self.dptr + 1) & 0xFFFF
            elif row == 0xA4:  # MUL AB
                value = self.a * self.b
                self.a = value & 0xFF
                self.b = value >> 8
                # MUL always clears CY; OV tells that the product needs B (4316E, MUL).
                self.cy = 0
                self.ov = 1 if value > 0xFF else 0
            elif row == 0xA5:  # undefined: runs as NOP (C2)
                self.fault(_UNDEFINED_OPCODE)
            elif row == 0xA6:  # MOV @Ri,dir
                value = self.read(rom[at + 1])
                iram[iram[self.bank + (rom[at] & 1)]] = value
            elif row == 0xA8:  # MOV Rn,dir
                value = self.read(rom[at + 1])
                iram[self.bank + (rom[at] & 7)] = value
            elif row == 0xB0:  # ANL C,/bit
                self.cy &= self.read_bit(rom[at + 1]) ^ 1
            elif row == 0xB2:  # CPL bit
                self.write_bit(rom[at + 1], self.latched_bit(rom[at + 1]) ^ 1)
            elif row == 0xB3:  # CPL C
                self.cy ^= 1
            elif row == 0xB4:  # CJNE A,#imm,rel
                pc = self.compare(pc, self.a, rom[at + 1], rom[at + 2])
            elif row == 0xB5:  # CJNE A,dir,rel
                value = self.read(rom[at + 1])
                pc = self.compare(pc, self.a, value, rom[at + 2])
            elif row == 0xB6:  # CJNE @Ri,#imm,rel
                pc = self.compare(pc, iram[iram[self.bank + (rom[at] & 1)]], rom[at + 1], rom[at + 2])
            elif row == 0xB8:  # CJNE Rn,#imm,rel
                pc = self.compare(pc, iram[self.bank + (rom[at] & 7)], rom[at + 1], rom[at + 2])
            elif row == 0xC0:  # PUSH dir: SP counts first, so PUSH SP stores the new one (C4)
                self.claim()
                value = self.read(rom[at + 1])
                iram[self.sp] = value
            elif row == 0xC2:  # CLR bit
                self.write_bit(rom[at + 1], 0)
            elif row == 0xC3:  # CLR C
                self.cy = 0
            elif row == 0xC4:  # SWAP A
                self.a = ((self.a << 4) & 0xF0) | (self.a >> 4)
            elif row == 0xC5:  # XCH A,dir
                value = self.read(rom[at + 1])
                address = self.a
                self.a = value
                self.write(rom[at + 1], address)
            elif row == 0xC6:  # XCH A,@Ri
                address = iram[self.bank + (rom[at] & 1)]
                value = iram[address]
                iram[address] = self.a
                self.a = value
            elif row == 0xC8:  # XCH A,Rn
                value = iram[self.bank + (rom[at] & 7)]
                iram[self.bank + (rom[at] & 7)] = self.a
                self.a = value
            elif row == 0xD0:  # POP dir: SP counts first, so POP SP ends with the byte popped (C4)
                value = self.pop()
                self.write(rom[at + 1], value)
            elif row == 0xD2:  # SETB bit
                self.write_bit(rom[at + 1], 1)
            elif row == 0xD3:  # SETB C
                self.cy = 1
            elif row == 0xD4:  # DA A
                self.decimal_adjust()
            elif row == 0xD5:  # DJNZ dir,rel
                value = (self.read_latched(rom[at + 1]) - 1) & 0xFF
                self.write(rom[at + 1], value)
                if value:
                    pc = self.branch(pc, rom[at + 2])
            elif row == 0xD6:  # XCHD A,@Ri
                address = iram[self.bank + (rom[at] & 1)]
                value = iram[address]
                iram[address] = (value & 0xF0) | (self.a & 0x0F)
                self.a = (self.a & 0xF0) | (value & 0x0F)
            elif row == 0xD8:  # DJNZ Rn,rel
                value = (iram[self.bank + (rom[at] & 7)] - 1) & 0xFF
                iram[self.bank + (rom[at] & 7)] = value
                if value:
                    pc = self.branch(pc, rom[at + 1])
            elif row == 0xE0:  # MOVX A,@DPTR
                self.a = self.movx_read(self.dptr)
            elif row == 0xE2:  # MOVX A,@Ri
                self.a = self.movx_read(self.page() << 8 | iram[self.bank + (rom[at] & 1)])
            elif row == 0xE4:  # CLR A
                self.a = 0
            elif row == 0xE5:  # MOV A,dir
                self.a = self.read(rom[at + 1])
            elif row == 0xE6:  # MOV A,@Ri
                self.a = iram[iram[self.bank + (rom[at] & 1)]]
            elif row == 0xE8:  # MOV A,Rn
                self.a = iram[self.bank + (rom[at] & 7)]
            elif row == 0xF0:  # MOVX @DPTR,A
                self.movx_write(self.dptr, self.a)
            elif row == 0xF2:  # MOVX @Ri,A
                self.movx_write(self.page() << 8 | iram[self.bank + (rom[at] & 1)], self.a)
            elif row == 0xF4:  # CPL A
                self.a ^= 0xFF
            elif row == 0xF5:  # MOV dir,A
                self.write(rom[at + 1], self.a)
            elif row == 0xF6:  # MOV @Ri,A
                iram[iram[self.bank + (rom[at] & 1)]] = self.a
            elif row == 0xF8:  # MOV Rn,A
                iram[self.bank + (rom[at] & 7)] = self.a
        self.pc = pc
        self.instructions = count
        return self.stop

    # Addressing

    def read(self, address: int) -> int:
        """Direct address, ports at their pins."""
        return self.iram[address] if address < 0x80 else self.read_register(address)

    def read_register(self, address: int) -> int:
        value = self.core_register(address)
        return value if value >= 0 else self.read_sfr(address)

    def core_register(self, address: int) -> int:
        """A register of the core itself, -1 if it is another."""
        if address == 0xE0:
            return self.a
        elif address == 0xD0:
            return self.psw()
        elif address == 0x82:
            return self.dptr & 0xFF
        elif address == 0x83:
            return self.dptr >> 8
        elif address == 0xF0:
            return self.b
        elif address == 0x81:
            return self.sp
        return -1

    def sfr(self, address: int) -> int:
        """A special function register (80h..FFh; ports: their latch) as of now, without side effects."""
        self.peripherals.observed = 1
        value = self.register(address, self.cycles)
        self.peripherals.observed = 0
        return value

    def register(self, address: int, cycle: int) -> int:
        """A register, ports at their latches, with everything below `cycle` done."""
        value = self.core_register(address)
        return value if value >= 0 else self._other_register(address, cycle)

    def read_latch(self, address: int) -> int:
        return self.register(address, self.start + 1)

    def read_latched(self, address: int) -> int:
        """Direct address as read-modify-write instructions see it: ports at their latches."""
        return self.iram[address] if address < 0x80 else self.read_latch(address)

    def write(self, address: int, value: int) -> None:
        if address < 0x80:
            self.iram[address] = value
        else:
            self.write_register(address, value)

    def write_register(self, address: int, value: int) -> None:
        if address == 0xE0:
            self.a = value
        elif address == 0xD0:
            self.write_psw(value)
        elif address == 0x82:
            self.dptr = (self.dptr & 0xFF00) | value
        elif address == 0x83:
            self.dptr = (self.dptr & 0x00FF) | (value << 8)
        elif address == 0xF0:
            self.b = value
        elif address == 0x81:
            self.set_sp(value)
        else:
            self.write_sfr(address, value)

    def read_bit(self, bit: int) -> int:
        if bit < 0x80:
            byte = self.iram[0x20 + (bit >> 3)]
        elif bit < _CORE:
            byte = self.read_sfr(bit & 0xF8)
        else:
            byte = self.read_register(bit & 0xF8)
        return (byte >> (bit & 7)) & 1

    def latched_bit(self, bit: int) -> int:
        byte = self.iram[0x20 + (bit >> 3)] if bit < 0x80 else self.read_latch(bit & 0xF8)
        return (byte >> (bit & 7)) & 1

    def write_bit(self, bit: int, level: int) -> None:
        if bit < 0x80:
            address = 0x20 + (bit >> 3)
            kept = self.iram[address] & (0xFF ^ (1 << (bit & 7)))
            self.iram[address] = kept | (level << (bit & 7))
        elif bit < _CORE:
            self.write_sfr_bit(bit & 0xF8, 1 << (bit & 7), level)
        else:
            self.write_register_bit(bit & 0xF8, 1 << (bit & 7), level)

    def write_register_bit(self, address: int, mask: int, level: int) -> None:
        """Only the one bit changes."""
        value = self.core_register(address)
        if value < 0:
            self.write_sfr_bit(address, mask, level)
        else:
            self.write_register(address, value | mask if level else value & (0xFF ^ mask))

    # Flow

    # The loop keeps PC in a variable of its own: these take the address after the instruction and give the new one.

    def branch(self, pc: int, offset: int) -> int:
        return self.fork((pc + (offset ^ 0x80) - 0x80) & 0xFFFF)

    def fork(self, target: int) -> int:
        """A jump that was a choice, or is as short as one."""
        if self.edge_mask:
            self.count_edge(target)
        return target

    def call(self, pc: int, target: int) -> int:
        """PCL first, then PCH: LCALL, ACALL and interrupts alike."""
        self.claim()
        self.iram[self.sp] = pc & 0xFF
        self.claim()
        self.iram[self.sp] = pc >> 8
        return target

    def claim(self) -> None:
        """SP counts up; a byte is about to be stored there."""
        self.sp = (self.sp + 1) & 0xFF
        if self.sp > self.highest_sp:
            self.highest_sp = self.sp
        # Equal, not beyond: one fault for a stack that overflows, not one for each byte that follows.
        if self.sp == self.stack_end:
            self.fault(_STACK_OVERFLOW)

    def pop(self) -> int:
        value = self.iram[self.sp]
        empty = self.sp == self.stack_floor
        self.sp = (self.sp - 1) & 0xFF
        if empty:
            self.fault(_STACK_UNDERFLOW)
        return value

    def set_sp(self, value: int) -> None:
        """An instruction writes SP. Leaving the stack is a fault, and so is a sum that goes round the top of RAM:
        a step up by less than half of RAM that ends lower. A number in the instruction (MOV SP,#data) is no sum.
        """
        before, self.sp = self.sp, value
        for level in range(2):
            if value < (self.interrupt_returns[level] >> 16) + 2:  # given up, as where a routine jumps to 0
                self.interrupt_returns[level] = -1
        end = self.stack_end or 0x100
        if value > self.highest_sp:
            self.highest_sp = value
        if self.stack_floor <= before < end:  # else it has not been set up yet, or was outside already
            round_the_top = value < before - 0x80 and self.rom[self.at] != _MOV_DATA
            # A step down of more than half of RAM is a sum that went round FFh; a smaller one frees locals.
            if round_the_top or value >= end:
                self.fault(_STACK_OVERFLOW)
            elif value < self.stack_floor:
                self.fault(_STACK_UNDERFLOW)

    # ALU

    def add(self, operand: int, carry: int) -> None:
        a = self.a
        total = a + operand + carry
        self.ac = ((a ^ operand ^ total) >> 4) & 1
        # Signed overflow: both operands have the sign that the sum lacks.
        self.ov = (((a ^ total) & (operand ^ total)) >> 7) & 1
        self.cy = total >> 8
        self.a = total & 0xFF

    def subtract(self, operand: int) -> None:
        a = self.a
        # Nine bits of two's complement: the ninth is the borrow.
        total = (a - operand - self.cy) & 0x1FF
        self.ac = ((a ^ operand ^ total) >> 4) & 1
        self.ov = (((a ^ operand) & (a ^ total)) >> 7) & 1
        self.cy = total >> 8
        self.a = total & 0xFF

    def compare(self, pc: int, left: int, right: int, offset: int) -> int:
        """CJNE: the new PC."""
        self.cy = 1 if left < right else 0
        return pc if left == right else self.branch(pc, offset)

    def divide(self) -> None:
        """Dividing by zero leaves A and B as they were (undefined on silicon: C3) and sets OV."""
        self.cy = 0
        self.ov = 1 if self.b == 0 else 0
        if self.b:
            quotient = self.a // self.b
            self.b = self.a - quotient * self.b
            self.a = quotient

    def decimal_adjust(self) -> None:
        value = self.a
        if self.ac or (value & 0x0F) > 9:
            value += 0x06
        if self.cy or value > 0x9F:  # also when the first step carried
            value += 0x60
        # DA sets CY and never clears it, so that a carry of the addition before it stays (4316E, DA).
        if value > 0xFF:
            self.cy = 1
        self.a = value & 0xFF

    # Edges between branches

    def watch_edges(self, edges: memoryview) -> None:
        """Counts from now on how often each edge between two taken branches is passed, in `edges`.

        A writable buffer of 2^n bytes, at most 65536; a count goes from 255 to 1. One byte: counts nothing.
        """
        size = len(edges)
        if size & (size - 1) or not 1 <= size <= 0x10000:
            raise ValueError(f"a map of {size} bytes: give it 1, 2, 4 .. 65536")
        self.edges = memoryview(edges).cast("B")
        self.edge_mask = size - 1
        self.begin_edges()

    def begin_edges(self) -> None:
        """Resets the last branch, after the core was restored to another moment."""
        self.edge_before = 0
        self.edge_depth = 0
        self.highest_sp = self.sp

    def count_edge(self, target: int) -> None:
        """A branch goes to `target`. The index is that of AFL: this place, and the one before shifted by a bit."""
        place = (self.at * _SPREAD_FROM + target * _SPREAD_TO) >> 3
        index = (place ^ self.edge_before) & self.edge_mask
        # Shifted, so that A to B and B to A are two edges, and tight loops are not all one (AFL).
        self.edge_before = (place & self.edge_mask) >> 1
        count = self.edges[index] + 1
        # 255 is followed by 1: an edge that was passed 256 times must not look like one that never was.
        self.edges[index] = (count & 0xFF) + (count >> 8)

    def enter_edges(self) -> None:
        """An interrupt is taken: its branches do not follow those of the program that it interrupts."""
        if self.edge_depth < _DEPTH:
            self.edge_outer[self.edge_depth] = self.edge_before
        self.edge_depth += 1
        self.edge_before = 0

    def leave_edges(self) -> None:
        """The routine is over: what comes next follows the branch before it."""
        if self.edge_depth:
            self.edge_depth -= 1
            if self.edge_depth < _DEPTH:
                self.edge_before = self.edge_outer[self.edge_depth]
