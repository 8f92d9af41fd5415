"""The AT89C52 but for its instructions: registers, memory, pins, reset, power, snapshots.

               +---------v---------+
      T2  P1.0 | 1              40 | VCC
    T2EX  P1.1 | 2           39-32 | P0.0-P0.7  address low and data of MOVX; open drain, pulled up
     P1.2-P1.7 | 3-8            31 | /EA        high: 8 KB of program inside
           RST | 9              30 | ALE        not modelled (X5)
     RXD  P3.0 | 10             29 | /PSEN      not modelled (X5)
     TXD  P3.1 | 11          28-21 | P2.7-P2.0  address high of MOVX
   /INT0  P3.2 | 12                |
   /INT1  P3.3 | 13                |   RST      `reset`
      T0  P3.4 | 14                |   P0-P3    in: `set_external`, out: `Bus.port_written`
      T1  P3.5 | 15                |   RXD      `rxd`, a Line that the outside writes
     /WR  P3.6 | 16                |   TXD      `txd`, a Line that the chip writes
     /RD  P3.7 | 17                |   /RD /WR  `Bus.movx_read`, `Bus.movx_write`
         XTAL2 | 18                |   XTAL1    24 MHz, the tick of everything
         XTAL1 | 19                |
           GND | 20                |   A pin of P3 is its latch AND its second function.
               +-------------------+

   pins -> ports -> INT0 INT1, T0 T1, T2 T2EX, RXD -> timers, serial port -> flags -> interrupts -> LCALL
                                   instructions -> SFRs -> timers, serial port, latches -> pins

What instructions do, and the loop that executes them, is in `cpu.py`. README.md in this folder draws both; rules with
letters (C1, I1, ..) are in it, and sources like 4316E.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, Protocol

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.opcodes import LINE
from miro_robot.mcs51.peripherals import Peripherals

LAST_CYCLE = 1 << 55
"""Ticks and the counts of a timer up to then fit into 64 bits."""

REACHED, STOPPED, BREAKPOINT, WIRE_FULL, ASLEEP, REPLAN = range(6)
"""Why a run ended. ASLEEP: with `stop_asleep`, nothing known wakes it; REPLAN: `replan` was called."""

_STOP_REQUESTED, _REPLAN = STOPPED, REPLAN
_OUTSIDE = 0x0800  # lines that are no opcode's, see opcodes.py; both: a mark outside
_MARK = 0x1000
_LINE = list(LINE)
_P0, _PCON, _IE, _IP = 0x80, 0x87, 0xA8, 0xB8
_SMOD, _PD, _IDL = 0x80, 0x02, 0x01  # PCON
_PCON_BITS = 0x8F  # the others are not implemented and read as 0 (C5)
_SAMPLED_P1, _SAMPLED_P3 = 0x03, 0x3F  # bits that something on the chip looks at between two instructions
_READ_SAMPLE, _WRITE_RISES = 17, 18  # ticks into a MOVX: S3P1 and S3P2 of its second cycle end (X1)
_FLOATING = 0xFF  # what an undriven external bus reads as (X4)
_ONE_INSTRUCTION = 4  # cycles of the longest: what the hardware lets main level do between two interrupts

on_load: ContextVar[Callable[[Any], object] | None] = ContextVar("on_load", default=None)
"""Called with every CPU that gets an image; a test session's coverage attaches to CPUs through it."""


class CpuInspector(Protocol):
    """The interface of observers of a running CPU (`miro_robot.inspect`)."""

    def run(self, until_cycle: int) -> int: ...


class Chip:
    """An AT89C52 at 24 MHz; `cycles` counts since power-on. `bus` is what it is soldered to."""

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
        "pcon": ("i", 0, 0xFF),
        "idle": FLAG,
        "powered_down": FLAG,
        "blocked": ("q", -1, LAST_CYCLE),
        "marks": ("q", 0, LAST_CYCLE),
        "interrupt_returns": ("2i", -1, 0xFFFFFF),
        "peripherals": Peripherals,
    }
    NOT_HASHED = ("interrupt_returns",)  # it follows from what was executed, and decides about faults alone
    NOT_STATE: tuple[str, ...] = (
        *("rom", "lines"),  # the image: constant, unless code lies in RAM, whose owner then restores it
        *("stack_floor", "stack_end"),  # where the image's map says that the stack is
        *("at", "start"),  # the instruction in progress: snapshots are taken between two
        *("edges", "edge_mask", "edge_before", "edge_outer", "edge_depth", "highest_sp"),  # what was seen
        *("bus", "rxd", "txd", "inspector", "main_loop_limit", "stop_asleep", "inner_xram"),
        *("limit", "until", "stop", "next_event", "next_mark"),
    )

    def __init__(self, bus: Bus | None = None) -> None:
        self.bus = Bus() if bus is None else bus
        self.peripherals = Peripherals(self.bus)
        self.rxd = self.peripherals.uart.rxd
        self.txd = self.peripherals.uart.txd
        self.rom = bytearray(0x10002)  # 64 KB, and the first two bytes again for operands that wrap
        self.lines = [0] * 65536  # per address: `line_at`, or a special line
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
        self.next_event = 0
        self.main_loop_limit = 0  # cycles after which interrupts that leave it no time are a fault; 0: never
        self.next_mark = NEVER_TICK
        self.marks = 0  # marks passed since interrupts took over
        self.inner_xram = 0  # bytes of RAM for MOVX on the chip
        self.stop_asleep = 0  # 1: a run ends with ASLEEP in the cycle from which on nothing known wakes it
        self.interrupt_returns = [
            -1,
            -1,
        ]  # by level: SP after the return of its last interrupt << 16 | where to
        self.inspector: CpuInspector | None = None
        self._erase()
        self.reset()

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

    def bound_stack(self, first: int, last: int) -> None:
        """Limits the stack to internal RAM from `first` to `last` (default: all of it). SP outside of it is a fault."""
        self.stack_floor = max(first - 1, 0)
        self.stack_end = (last + 1) & 0xFF

    def stack_said(self) -> str:
        """Text with SP and the range of the stack, for people."""
        last = (self.stack_end - 1) & 0xFF
        return f"SP {self.sp:02X}h, its stack is {self.stack_floor + 1:02X}h to {last:02X}h"

    # Image

    def load(self, image: bytes, used: tuple[tuple[int, int], ...] | None = None) -> None:
        """Puts `image` at address 0; executing outside `used` ((first, end) ranges; default: all of it) is a fault."""
        self._erase()
        for address in range(min(len(image), 0x10000)):
            self.rom[address] = image[address]
        self.rom[0x10000], self.rom[0x10001] = self.rom[0], self.rom[1]
        for first, end in ((0, len(image)),) if used is None else used:
            for address in range(first, end):
                self.lines[address] = self.line_at(address)
        loaded = on_load.get()
        if loaded is not None:
            loaded(self)

    def _erase(self) -> None:
        """Erases code memory: all of it reads FFh, and none is loaded."""
        for address in range(0x10002):
            self.rom[address] = 0xFF
        for address in range(0x10000):
            self.lines[address] = _OUTSIDE

    def line_at(self, address: int) -> int:
        """Row and cycles of the opcode at `address` and, in the upper half, the address after its instruction."""
        line = _LINE[self.rom[address]]
        return line & 0x07FF | ((address + (line >> 13)) & 0xFFFF) << 16

    def write_code(self, address: int, value: int) -> None:
        """Writes one byte of code memory, which then counts as loaded."""
        self.rom[address] = value
        if address < 2:
            self.rom[0x10000 + address] = value
        self.lines[address] = _MARK if self.lines[address] & _MARK else self.line_at(address)

    def is_loaded(self, address: int) -> bool:
        """True if executing at `address` is legal."""
        return not self.lines[address & 0xFFFF] & _OUTSIDE

    def code_at(self, address: int) -> int:
        return self.rom[address & 0xFFFF]

    @property
    def code(self) -> bytes:
        """The 64 KB of code memory."""
        return bytes([self.rom[address] for address in range(0x10000)])

    # Control

    def reset(self) -> None:
        """RST: registers and PC as after power-on, ports FF; RAM and time stay (C7)."""
        self.peripherals.clear(self.cycles)
        self.pc = 0  # while instructions are executed: as of the last `boundary`
        self.a = 0
        self.b = 0
        self.sp = 7
        self.dptr = 0
        self.write_psw(0)
        self.pcon = 0
        self.idle = 0
        self.powered_down = 0
        self.blocked = -1  # boundary at which no interrupt is taken: after RETI and writes to IE, IP (I1)
        for port in range(4):
            self.write_port(port, 0xFF)
        self.peripherals.clock_serial()

    def hold(self) -> None:
        """RST goes high and stays: nothing is executed until `reset`, its falling edge."""
        self.reset()
        self.peripherals.freeze(self.cycles)
        self.powered_down = 1

    def mark(self, addresses: tuple[int, ...]) -> None:
        """From now on a run ends before each instruction at one of `addresses`, with BREAKPOINT."""
        for address in addresses:
            self.lines[address] = _MARK | (self.lines[address] & _OUTSIDE)

    def unmark(self, addresses: tuple[int, ...]) -> None:
        """Takes the marks away."""
        for address in addresses:
            self.lines[address] = _OUTSIDE if self.lines[address] & _OUTSIDE else self.line_at(address)

    def request_stop(self) -> None:
        """Ends the run after the instruction in progress; for callbacks of the bus."""
        self.stop = _STOP_REQUESTED
        self.limit = 0

    def replan(self) -> None:
        """Ends a piece of a run after the instruction in progress, for the caller of `go_on` to make another one."""
        if self.stop == 0:
            self.stop = _REPLAN
        self.limit = 0

    def set_external(self, port: int, levels: int, tick: int) -> None:
        """From `tick` on the outside puts `levels` on the pins of P0..P3 (1: released or high)."""
        ports = self.peripherals.ports
        if ports.next_cycle == NEVER_TICK and not port & 1 and tick <= 12 * self.cycles + 9:
            ports.outside[port] = levels
        else:
            self.peripherals.push(port, levels, tick)
            self.next_event = 0
            self.limit = 0

    def hold_pins(self, port: int, low: int, high: int, outside: int) -> None:
        """Fault, between two instructions: pins are shorted (`Ports.hold`). `outside`: on the pins of that port."""
        self.before_save()  # what was sampled before the fault was sampled without it
        self.peripherals.ports.hold(port, low, high)
        self.set_external(port, outside, 12 * self.cycles)

    def rxd_changed(self) -> None:
        """More is on RXD than when the run began."""
        self.peripherals.look_again()
        self.next_event = 0
        self.limit = 0

    # Observers

    def asleep(self) -> bool:
        """True if only a reset or a new input can make it execute another instruction."""
        idle_for_ever = self.idle != 0 and self.peripherals.next_event(self.cycles) == NEVER_TICK
        return self.powered_down != 0 or idle_for_ever

    def peek_iram(self, address: int) -> int:
        """A byte of internal RAM (0..255)."""
        return self.iram[address & 0xFF]

    def poke_iram(self, address: int, value: int) -> None:
        """Writes internal RAM between two instructions."""
        self.iram[address & 0xFF] = value & 0xFF

    # What is due

    def fault(self, kind: int) -> None:
        self.faults += 1
        self.bus.fault(kind, self.at, 12 * self.cycles)

    def _next_look(self) -> int:
        """The cycle of the next event, mark or end of the run, whichever comes first: instructions go on until then."""
        return min(self.next_event, self.until, self.next_mark)

    def _taken_over(self) -> bool:
        """True if an interrupt is in service, or one just was: silicon grants main level one instruction after RETI,
        which does not count as time of its own.
        """
        return self.peripherals.interrupts.in_service != 0 or self.cycles - self.blocked <= _ONE_INSTRUCTION

    def _block(self) -> None:
        """Blocks interrupts until one more instruction has been executed: after RETI and writes to IE, IP."""
        self.blocked = self.cycles
        self._expect(self.cycles + 1)

    def _expect(self, earliest: int) -> None:
        """The next event may have changed, but not the interrupt requests of pins."""
        self.next_event = self.peripherals.next_event(earliest)
        self.limit = 0 if self.stop or self.txd.full else self._next_look()

    # Special function registers

    def _other_register(self, address: int, cycle: int) -> int:
        return self.pcon if address == _PCON else self.peripherals.read(address, cycle)

    def read_sfr(self, address: int) -> int:
        if address & 0xCF == 0x80:
            return self.peripherals.pin_levels((address - _P0) >> 4, self.start)
        return self._other_register(address, self.start + 1)

    def write_sfr_bit(self, address: int, mask: int, level: int) -> None:
        if address & 0xCF == 0x80:
            port = (address - _P0) >> 4
            value = self.peripherals.ports.latches[port]
            self.write_port(port, value | mask if level else value & (0xFF ^ mask))
        else:
            self._written(address, self.peripherals.write_bit(address, mask, level, self.cycles))

    def write_sfr(self, address: int, value: int) -> None:
        if address == _PCON:
            self.write_pcon(value)
        elif address & 0xCF == 0x80:
            self.write_port((address - _P0) >> 4, value)
        else:
            self._written(address, self.peripherals.write(address, value, self.cycles))

    def _written(self, address: int, sooner: int) -> None:
        """After a write to a register of the peripherals. `sooner`: an event may come sooner by it."""
        if address in (_IE, _IP):
            self.marks = self.marks if self.peripherals.interrupts.in_service else 0
            self._block()
        elif sooner:
            self._expect(self.cycles)

    def write_pcon(self, value: int) -> None:
        """Power-down wins over idle; the AT89C52 leaves it by reset only (data sheet 0313H)."""
        if (value ^ self.pcon) & _SMOD:
            self.peripherals.write_smod(value >> 7, self.cycles)
            self.next_event = 0
        self.pcon = value & _PCON_BITS
        if value & _PD:
            self.peripherals.freeze(self.cycles)
            self.powered_down = 1
            self.next_event = 0
        elif value & _IDL:
            self.idle = 1
            if self.stop_asleep:  # an event that has become later must not keep it awake
                self.next_event = 0
        self.limit = 0

    def write_port(self, port: int, value: int) -> None:
        if value != self.peripherals.ports.latches[port]:
            if port == 3:
                self.peripherals.write_p3(value, self.cycles)
            elif port == 1:
                self.peripherals.sync(self.cycles)
            if port & 1:  # P1 and P3 carry sampled inputs
                self.peripherals.sample_latches(self.cycles)
                if (value ^ self.peripherals.ports.latches[port]) & (
                    _SAMPLED_P1 if port == 1 else _SAMPLED_P3
                ):
                    self.next_event = 0
                    self.limit = 0
            self.peripherals.ports.latches[port] = value  # the pins follow with the next cycle
            self.bus.port_written(port, value, 12 * self.cycles)

    def movx_read(self, address: int) -> int:
        """Without a strobe (P3.7 latched low, X3) nothing drives the bus. The chip's own RAM needs no bus."""
        if address < self.inner_xram:
            return self.bus.inner_read(address)
        value = _FLOATING
        if self.peripherals.ports.latches[3] & 0x80:
            value = self.bus.movx_read(address, 12 * self.start + _READ_SAMPLE) & 0xFF
        else:
            self.bus.movx_without_strobe(address, 0)
        self.write_port(0, 0xFF)
        return value

    def movx_write(self, address: int, value: int) -> None:
        """Without a strobe (P3.6 latched low, X3) nothing is written. The chip's own RAM needs no bus."""
        if address < self.inner_xram:
            self.bus.inner_write(address, value)
        else:
            if self.peripherals.ports.latches[3] & 0x40:
                self.bus.movx_write(address, value, 12 * self.start + _WRITE_RISES)
            else:
                self.bus.movx_without_strobe(address, 1)
            self.write_port(0, 0xFF)

    def page(self) -> int:
        """High byte of the address of MOVX @Ri: the pins of P2 keep showing its latch (4316E section 2.6).

        With RAM of its own an STC89C52 reaches that alone in this way (STC89C51RC data sheet, section 4.3).
        """
        return 0 if self.inner_xram else self.peripherals.ports.latches[2]

    # State

    def before_save(self) -> None:
        """Brings the peripherals up to where the core is. Marks count only while interrupts hold the CPU."""
        self.peripherals.settle(self.cycles)
        self.peripherals.sample_latches(self.cycles)
        self.peripherals.timers.store()
        if not self._taken_over():
            self.marks = 0

    def after_load(self) -> None:
        """Raises ValueError unless the peripherals stand where the core does."""
        if self.bank & ~0x18 or self.user_flags & ~0x22:
            raise ValueError(f"PSW has bank {self.bank:02X}h and flags {self.user_flags:02X}h")
        self.peripherals.check_times(self.cycles)
        self.peripherals.written = self.cycles

    def __repr__(self) -> str:
        return (
            f"Cpu(pc={self.pc:04X}h, cycles={self.cycles}, a={self.a:02X}h, psw={self.psw():02X}h, "
            f"sp={self.sp:02X}h, dptr={self.dptr:04X}h{', idle' if self.idle else ''})"
        )
