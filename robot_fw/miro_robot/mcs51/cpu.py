"""The AT89C52 as a board sees it: reset, run, pins in and out, observers, snapshots.

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

Instructions are in `execute.py`, the rest of the chip in `peripherals.py`. README.md in this folder draws how
`Executor`, `Cpu` and their hooks fit together; rules with letters (C1, I1, ..) are in it, and sources like 4316E.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from typing import Protocol

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG
from miro_robot.faults import FaultKind
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.execute import BREAKPOINT, LAST_CYCLE, REACHED, STOPPED, WIRE_FULL, Executor
from miro_robot.mcs51.peripherals import Peripherals

__all__ = ["ASLEEP", "BREAKPOINT", "REACHED", "STOPPED", "WIRE_FULL", "Cpu"]

ASLEEP = 4  # why a run ended, beside those of `execute.py`: with `stop_asleep`, nothing known wakes it

REPLAN = 5  # `replan` was called

_REPLAN = REPLAN
_OUTSIDE = 0x0800  # lines that are no opcode's, see opcodes.py; both: a mark outside
_MARK = 0x1000
_STOP_REQUESTED = 1
_WIRE_FULL = WIRE_FULL
_P0, _PCON, _IE, _IP = 0x80, 0x87, 0xA8, 0xB8
_SMOD, _PD, _IDL = 0x80, 0x02, 0x01  # PCON
_PCON_BITS = 0x8F  # the others are not implemented and read as 0 (C5)
_READ_SAMPLE, _WRITE_RISES = 17, 18  # ticks into a MOVX: S3P1 and S3P2 of its second cycle end (X1)
_FLOATING = 0xFF  # what an undriven external bus reads as (X4)
_MAIN_LOOP_STARVED = int(FaultKind.MAIN_LOOP_STARVED)
_MARK_CYCLES = 2000  # 1 ms: how often it is checked whether the main loop gets time
_ONE_INSTRUCTION = 4  # cycles of the longest: what the hardware lets main level do between two interrupts


on_load: ContextVar[Callable[[Cpu], object] | None] = ContextVar("on_load", default=None)
"""Called with every CPU that gets an image: how coverage of a test session comes to CPUs that tests make."""


class CpuInspector(Protocol):
    """What looks into a running CPU (`miro_robot.inspect`)."""

    def run(self, until_cycle: int) -> int: ...


class Cpu(Executor):
    """An AT89C52 at 24 MHz. `bus` is what it is soldered to; input is pushed through `set_external` and `rxd`."""

    STATE: dict[str, object] = {
        "pcon": ("i", 0, 0xFF),
        "idle": FLAG,
        "powered_down": FLAG,
        "blocked": ("q", -1, LAST_CYCLE),
        "marks": ("q", 0, LAST_CYCLE),
        "peripherals": Peripherals,
    }
    NOT_STATE: tuple[str, ...] = (
        *Executor.NOT_STATE,
        "inspector", "limit", "main_loop_limit", "next_event", "next_mark", "rxd", "stop",
        "stop_asleep", "txd",
    )  # fmt: skip

    def __init__(self, bus: Bus | None = None) -> None:
        Executor.__init__(self, Bus() if bus is None else bus)
        self.peripherals = Peripherals(self.bus)
        self.rxd = self.peripherals.uart.rxd
        self.txd = self.peripherals.uart.txd
        self.next_event = 0
        self.main_loop_limit = 0  # cycles after which interrupts that leave it no time are a fault; 0: never
        self.next_mark = NEVER_TICK
        self.marks = 0  # marks passed since interrupts took over
        self.stop_asleep = 0  # 1: a run ends with ASLEEP in the cycle from which on nothing known wakes it
        self.inspector: CpuInspector | None = None
        self._erase()
        self.reset()

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
        """All code memory reads FFh, and none of it is loaded."""
        for address in range(0x10002):
            self.rom[address] = 0xFF
        for address in range(0x10000):
            self.lines[address] = _OUTSIDE

    def write_code(self, address: int, value: int) -> None:
        """One byte of code memory, which from now on counts as loaded."""
        self.rom[address] = value
        if address < 2:
            self.rom[0x10000 + address] = value
        self.lines[address] = _MARK if self.lines[address] & _MARK else self.line_at(address)

    def is_loaded(self, address: int) -> bool:
        """Whether executing at `address` is legal."""
        return not self.lines[address & 0xFFFF] & _OUTSIDE

    def code_at(self, address: int) -> int:
        return self.rom[address & 0xFFFF]

    @property
    def code(self) -> bytes:
        """The 64 KB of code memory."""
        return bytes([self.rom[address] for address in range(0x10000)])

    # Control

    def run(self, until_cycle: int) -> int:
        """As `Executor.run`; an inspector that is attached runs it in its own way, with the same result."""
        if self.inspector is None:
            return Executor.run(self, until_cycle)
        return self.inspector.run(until_cycle)

    def go_on(self, until_cycle: int) -> int:
        """As `Executor.go_on`; an inspector makes runs of the pieces."""
        if self.inspector is None:
            return Executor.go_on(self, until_cycle)
        return self.inspector.run(until_cycle)

    def reset(self) -> None:
        """RST: registers and PC as after power-on, ports FF; RAM and time stay (C7)."""
        now = self.cycles
        self.peripherals.clear(now)
        self.clear()
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

    def step(self) -> int:
        """One instruction or interrupt entry; an idle CPU advances by a cycle."""
        return self.run(self.cycles + 1)

    def run_until_pc(self, address: int, until_cycle: int) -> int:
        """Like `run`, but returns BREAKPOINT before the instruction at `address` is executed."""
        return self.run_until_any((address,), until_cycle)

    def run_until_any(self, addresses: tuple[int, ...], until_cycle: int) -> int:
        """The same for several addresses; `pc` tells which it was."""
        self.mark(addresses)
        try:
            return self.run(until_cycle)
        finally:
            self.unmark(addresses)

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

    # Observers

    def asleep(self) -> bool:
        """Whether only a reset or a new input can make it execute another instruction."""
        idle_for_ever = self.idle != 0 and self.peripherals.next_event(self.cycles) == NEVER_TICK
        return self.powered_down != 0 or idle_for_ever

    def peek_iram(self, address: int) -> int:
        """A byte of internal RAM (0..255)."""
        return self.iram[address & 0xFF]

    def poke_iram(self, address: int, value: int) -> None:
        """Writes internal RAM between two instructions."""
        self.iram[address & 0xFF] = value & 0xFF

    def sfr(self, address: int) -> int:
        """A special function register (80h..FFh; ports: their latch) as of now, without side effects."""
        return self.register(address, self.cycles)

    # The run loop's view of time

    def begin_run(self) -> None:
        self.next_mark = (
            (self.cycles // _MARK_CYCLES + 1) * _MARK_CYCLES if self.main_loop_limit else NEVER_TICK
        )
        self.peripherals.look_again()  # more may have been put on RXD since the last run
        self.next_event = 0

    def end_run(self) -> None:
        """TXD is final up to now; RXD before it is no longer needed."""
        self.peripherals.sync(self.cycles)
        self.peripherals.settle()
        now = 12 * self.cycles
        if self.txd.settled_tick < now:
            self.txd.settled_tick = now
        self.rxd.forget(now - 24)

    def boundary(self) -> int:
        """Between two instructions, when `cycles` reached `limit`; 1 ends the run."""
        now = self.cycles
        if now >= self.next_mark:
            self._watch_main_loop(now)
        if self.stop or now >= self.until:
            return 1
        if self.txd.full:
            self.stop = _WIRE_FULL
            return 1
        if now >= self.next_event and self._attend(now):
            return 1 if self.stop else 0
        event = self._next_look()
        if (self.idle or self.powered_down) and now < event:
            if not self._taken_over():  # nor will it be at a mark
                event = self.next_event if self.next_event < self.until else self.until
            self.idle_cycles += event - now
            self.cycles = event
        self.limit = event
        return 0

    def _next_look(self) -> int:
        """The cycle of the next event, mark or end of the run, whichever comes first: instructions go on until then."""
        event = self.next_event if self.next_event < self.until else self.until
        return event if event < self.next_mark else self.next_mark

    def _attend(self, now: int) -> int:
        """Everything due at the start of cycle `now`: 1 if that was an interrupt, or ends the run.

        A run ends before the pins of `now` are sampled: its state is that of any run that ends there.
        """
        peripherals = self.peripherals
        peripherals.sync(now)
        blocked = self.blocked == now or self.powered_down != 0
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

    def _note_end(self, now: int) -> None:
        """Whether a mark, or sleep that nothing known ends, ends the run at the start of cycle `now`."""
        if not self.idle and not self.powered_down:
            if self.lines[self.pc] & _MARK:
                self.stop = BREAKPOINT
        elif self.stop_asleep:
            self.peripherals.settle()
            if self.asleep():
                self.stop = ASLEEP

    def _look_for_sleep(self, now: int) -> None:
        """Looks up again when less may be known of what ends idle mode: then nothing may be left."""
        self.peripherals.settle()
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

    def _taken_over(self) -> bool:
        """Whether an interrupt is in service, or one just was: silicon grants main level one instruction after RETI,
        which does not count as time of its own.
        """
        return self.peripherals.interrupts.in_service != 0 or self.cycles - self.blocked <= _ONE_INSTRUCTION

    def _enter(self, source: int) -> None:
        """The hardware LCALL: two cycles, and the end of idle mode."""
        if not self._taken_over():
            self.marks = 0
        self.idle = 0
        self.pcon &= 0xFF ^ _IDL
        self.enter_edges()
        self.peripherals.taken(source, self.cycles)
        self.start = self.cycles
        self.at = self.pc
        self.cycles += 2
        self.pc = self.call(self.pc, 8 * source + 3)
        self._expect(self.cycles)

    def end_of_interrupt(self) -> None:
        self.leave_edges()
        self.peripherals.interrupts.leave()
        self._block()

    def _block(self) -> None:
        """No interrupt before one more instruction has been executed: after RETI and writes to IE, IP."""
        self.blocked = self.cycles
        self._expect(self.cycles + 1)

    def _expect(self, earliest: int) -> None:
        """What is due next may have changed; nothing that the pins ask for has."""
        self.next_event = self.peripherals.next_event(earliest)
        self.limit = 0 if self.stop or self.txd.full else self._next_look()

    # Special function registers

    def register(self, address: int, cycle: int) -> int:
        """A register, ports at their latches, with everything below `cycle` done."""
        value = self.core_register(address)
        return value if value >= 0 else self._other_register(address, cycle)

    def _other_register(self, address: int, cycle: int) -> int:
        return self.pcon if address == _PCON else self.peripherals.read(address, cycle)

    def read_sfr(self, address: int) -> int:
        if address & 0xCF == 0x80:
            return self.peripherals.pin_levels((address - _P0) >> 4, self.start)
        return self._other_register(address, self.start + 1)

    def read_latch(self, address: int) -> int:
        return self.register(address, self.start + 1)

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
            self.peripherals.ports.latches[port] = value  # the pins follow with the next cycle
            if port & 1:  # P1 and P3 carry sampled inputs
                self.next_event = 0
                self.limit = 0
            self.bus.port_written(port, value, 12 * self.cycles)

    # External bus

    def page(self) -> int:
        return self.peripherals.ports.latches[2] << 8

    def movx_read(self, address: int) -> int:
        """Without a strobe (P3.7 latched low, X3) nothing drives the bus."""
        value = _FLOATING
        if self.peripherals.ports.latches[3] & 0x80:
            value = self.bus.movx_read(address, 12 * self.start + _READ_SAMPLE) & 0xFF
        self.write_port(0, 0xFF)
        return value

    def movx_write(self, address: int, value: int) -> None:
        """Without a strobe (P3.6 latched low, X3) nothing is written."""
        if self.peripherals.ports.latches[3] & 0x40:
            self.bus.movx_write(address, value, 12 * self.start + _WRITE_RISES)
        self.write_port(0, 0xFF)

    # State

    def before_save(self) -> None:
        """Brings the peripherals up to where the core is. Marks count only while interrupts hold the CPU."""
        self.peripherals.sync(self.cycles)
        self.peripherals.settle()
        self.peripherals.timers.store()
        if not self._taken_over():
            self.marks = 0

    def after_load(self) -> None:
        """Raises ValueError unless the peripherals stand where the core does."""
        if self.bank & ~0x18 or self.user_flags & ~0x22:
            raise ValueError(f"PSW has bank {self.bank:02X}h and flags {self.user_flags:02X}h")
        self.peripherals.check_times(self.cycles)

    def __repr__(self) -> str:
        return (
            f"Cpu(pc={self.pc:04X}h, cycles={self.cycles}, a={self.a:02X}h, psw={self.psw():02X}h, "
            f"sp={self.sp:02X}h, dptr={self.dptr:04X}h{', idle' if self.idle else ''})"
        )
