"""The core: registers, memory, the instructions, the loop that executes them, and hooks to the rest of the chip.

Special function registers, time passing in peripherals, interrupts and idle mode are in `Cpu` (cpu.py), which fills
in the hooks (drawn in README.md).

Timing inside an instruction (4316E section 2.4; what it leaves open is rule C1 in README.md): operands are read in the
instruction's first cycle, `start`; results are written at the end of its last, `cycles`. The loop compares `cycles`
with `limit` once per instruction and knows nothing else about time.

The loop has one shape, a head and one choice among the rows, because the build copies the head to the end of each row
(`threaded` in setup.py); what the head asks has to be rare. Operands are read where they are needed: `rom[at + 1]` and
`rom[at + 2]`.
"""

from __future__ import annotations

from miro_exact.state import FLAG, TICK
from miro_robot.faults import FaultKind
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.opcodes import LINE

LAST_CYCLE = 1 << 55
"""Ticks and the counts of a timer up to then fit into 64 bits."""

_BREAKPOINT = 0x1000  # line that ends a run before its instruction
_UNDEFINED_OPCODE = int(FaultKind.UNDEFINED_OPCODE)
_STACK_OVERFLOW = int(FaultKind.STACK_OVERFLOW)
_STACK_UNDERFLOW = int(FaultKind.STACK_UNDERFLOW)
_MOV_DATA = 0x75
_CORE = 0xD0  # the core's registers that have bits (PSW, ACC, B) lie from here on
_OUTSIDE_IMAGE = int(FaultKind.OUTSIDE_IMAGE)

REACHED, STOPPED, BREAKPOINT, WIRE_FULL = range(4)  # why a run ended
_REACHED = 0
_SPREAD_FROM, _SPREAD_TO = 0x9E35, 0x3C6F  # odd, so that different branches differ in the low bits
_DEPTH = 8  # interrupts in service whose branches are kept; RETI may be forgotten, so more can come


class Executor:
    """A core that executes instructions; `cycles` counts since power-on."""

    STATE: dict[str, object] = {
        "iram": "256B",
        "pc": ("i", 0, 0xFFFF),
        "a": ("i", 0, 0xFF),
        "b": ("i", 0, 0xFF),
        "sp": ("i", 0, 0xFF),
        "dptr": ("i", 0, 0xFFFF),
        "cy": FLAG,
        "ac": FLAG,
        "ov": FLAG,
        "user_flags": ("i", 0, 0x22),
        "bank": ("i", 0, 0x18),
        "cycles": ("q", 0, LAST_CYCLE),
        "instructions": TICK,
        "idle_cycles": TICK,
        "faults": TICK,
    }
    NOT_STATE: tuple[str, ...] = (
        "bus",
        "rom",  # the image: constant while it runs, unless code lies in RAM, whose owner then restores it
        "lines",
        "line_of",
        "stack_floor",  # where the image's map says that the stack is
        "stack_end",
        "at",
        "start",  # the instruction in progress: snapshots are taken between two
        "limit",
        "until",
        "stop",
        *("edges", "edge_mask", "edge_before", "edge_outer", "edge_depth", "highest_sp"),  # what was seen
    )

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.rom = bytearray(0x10002)  # 64 KB, and the first two bytes again for operands that wrap
        self.lines = [0] * 65536  # per address: `line_at`, or a special line
        self.line_of = list(LINE)
        self.iram = bytearray(256)
        self.cycles = 0  # machine cycles since power-on; during an instruction: its end
        self.start = 0  # first cycle of the instruction in progress
        self.at = 0  # its address
        self.limit = 0  # cycle at which the loop has to look up
        self.until = 0
        self.stop = 0
        self.instructions = 0  # as of the last run
        self.idle_cycles = 0
        self.faults = 0
        self.edges = memoryview(bytearray(1))
        self.edge_mask = 0  # 0: edges are not counted
        self.edge_before = 0
        self.edge_outer = [0] * 8
        self.edge_depth = 0
        self.highest_sp = 0  # of a stack that grew since it was last set
        self.stack_floor = 0  # SP of an empty stack
        self.stack_end = 0  # the first address past it: 00 is past FF
        self.clear()

    def clear(self) -> None:
        """Registers and PC as after reset."""
        self.pc = 0  # while instructions are executed: as of the last `boundary`
        self.a = 0
        self.b = 0
        self.sp = 7
        self.dptr = 0
        self.write_psw(0)

    def psw(self) -> int:
        """P is the parity of ACC, whatever was written."""
        folded = self.a ^ (self.a >> 4)
        parity = (0x6996 >> (folded & 0x0F)) & 1
        return (self.cy << 7) | (self.ac << 6) | self.user_flags | self.bank | (self.ov << 2) | parity

    def write_psw(self, value: int) -> None:
        self.cy = value >> 7
        self.ac = (value >> 6) & 1
        self.ov = (value >> 2) & 1
        self.bank = value & 0x18  # address of R0: 00, 08, 10 or 18
        self.user_flags = value & 0x22  # F0 and UD, in their places

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

    def bound_stack(self, first: int, last: int) -> None:
        """The stack may use internal RAM from `first` to `last`; all of it unless told. SP leaving it is a fault."""
        self.stack_floor = max(first - 1, 0)
        self.stack_end = (last + 1) & 0xFF

    def stack_said(self) -> str:
        """Where SP is and where the stack may be, for people."""
        last = (self.stack_end - 1) & 0xFF
        return f"SP {self.sp:02X}h, its stack is {self.stack_floor + 1:02X}h to {last:02X}h"

    def begin_edges(self) -> None:
        """No branch has been taken yet: after the core was put back to another moment."""
        self.edge_before = 0
        self.edge_depth = 0
        self.highest_sp = self.sp

    def count_edge(self, target: int) -> None:
        """A branch goes to `target`. The index is that of AFL: this place, and the one before shifted by a bit."""
        place = (self.at * _SPREAD_FROM + target * _SPREAD_TO) >> 3
        index = (place ^ self.edge_before) & self.edge_mask
        self.edge_before = (place & self.edge_mask) >> 1
        count = self.edges[index] + 1
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

    def line_at(self, address: int) -> int:
        """Row and cycles of the opcode at `address` and, in the upper half, the address after its instruction."""
        line = self.line_of[self.rom[address]]
        return line & 0x07FF | ((address + (line >> 13)) & 0xFFFF) << 16

    def run(self, until_cycle: int) -> int:
        """Executes until `cycles` >= `until_cycle`; may end up to 3 cycles late, when an instruction does.

        Returns REACHED, STOPPED (`request_stop`), BREAKPOINT or WIRE_FULL (more than 2048 edges of TXD wait for
        the listener that it has; it does not go on before these are heard).
        """
        self.begin_run()
        stopped = Executor.go_on(self, until_cycle)
        self.end_run()
        return stopped

    def go_on(self, until_cycle: int) -> int:
        """A piece of a run, between `begin_run` and `end_run`: what runs in many pieces looks at its lines once."""
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
                if line & _BREAKPOINT:
                    self.stop = BREAKPOINT
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
                self.end_of_interrupt()
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
                self.a = self.movx_read(self.page() | iram[self.bank + (rom[at] & 1)])
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
                self.movx_write(self.page() | iram[self.bank + (rom[at] & 1)], self.a)
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
        end = self.stack_end or 0x100
        if value > self.highest_sp:
            self.highest_sp = value
        if self.stack_floor <= before < end:  # else it has not been set up yet, or was outside already
            round_the_top = value < before - 0x80 and self.rom[self.at] != _MOV_DATA
            if round_the_top or value >= end:
                self.fault(_STACK_OVERFLOW)
            elif value < self.stack_floor:
                self.fault(_STACK_UNDERFLOW)

    # ALU

    def add(self, operand: int, carry: int) -> None:
        a = self.a
        total = a + operand + carry
        self.ac = ((a ^ operand ^ total) >> 4) & 1
        self.ov = (((a ^ total) & (operand ^ total)) >> 7) & 1
        self.cy = total >> 8
        self.a = total & 0xFF

    def subtract(self, operand: int) -> None:
        a = self.a
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
        if value > 0xFF:
            self.cy = 1
        self.a = value & 0xFF

    def fault(self, kind: int) -> None:
        self.faults += 1
        self.bus.fault(kind, self.at, 12 * self.cycles)

    # Hooks: what `Cpu` adds to the bare instructions

    def begin_run(self) -> None:
        """Before the first instruction of a run: what the outside may have changed meanwhile."""

    def end_run(self) -> None:
        """After the last instruction of a run."""

    def boundary(self) -> int:
        """`cycles` reached `limit`, which is 0 at first: 1 ends the run, else set it."""
        self.limit = self.until
        return 1 if self.cycles >= self.until else 0

    def end_of_interrupt(self) -> None:
        """RETI was executed."""

    def read_sfr(self, address: int) -> int:
        """Direct 80..FF in cycle `start`, ports at their pins."""
        return 0

    def read_latch(self, address: int) -> int:
        """Direct 80..FF for read-modify-write."""
        return 0

    def write_sfr(self, address: int, value: int) -> None:
        """Direct 80..FF at the end of the instruction."""

    def write_sfr_bit(self, address: int, mask: int, level: int) -> None:
        """One bit of direct 80..FF at the end of the instruction."""

    def page(self) -> int:
        """High address byte of MOVX @Ri, in place."""
        return 0

    def movx_read(self, address: int) -> int:
        """Byte from the external data bus."""
        return 0xFF

    def movx_write(self, address: int, value: int) -> None:
        """Byte to the external data bus."""
