"""A board with nothing on it but the processor and 64 KB of external RAM.

A program has ended when no input can make it do anything more: in power-down, asleep with nothing that could wake it,
or in a jump to itself while no interrupt is enabled. ENDED is noted when its last character has been sent. Only a reset
makes it go on.

RAM counts by pages of 256 bytes: those that were never written are no part of the state. A digest is made of those that
were written since the last one, which holds the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_exact.state import FLAG, TICK, Items, Octets
from miro_robot.board_spec import BoardSpec
from miro_robot.event_log import ENDED, FAULT, REACHED
from miro_robot.faults import STACK_FAULTS, FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.chip_registers import ChipRegisters, registers_of
from miro_robot.mcs51.chips import CHIPS
from miro_robot.mcs51.cpu import ASLEEP, BREAKPOINT, REPLAN, STOPPED
from miro_robot.mcs51.opcodes import jumps_to_itself, jumps_to_themselves
from miro_robot.mcs51.uart import STOPPED_TICK
from miro_robot.processor_board import ProcessorBoard

FAULTS_KEPT = 1000
"""Number of faults that are recorded; further ones are only counted, so that a loop of faults does not fill
the memory.
"""
_CHECK_CYCLES = 200_000  # after which a jump to itself that interrupts left is looked at again
_EA, _SOURCES = 0x80, 0x3F  # of IE
_IE = 0xA8
_DATA_BITS, _ROLLOVERS = 8, 16  # of a character; of the serial clock in a bit
_PAGE = 256  # bytes, and so many pages
_BYTES = 0x10000
_FLOATING = 0xFF  # what an undriven bus reads as (X4)
_MOVX_WITHOUT_STROBE = int(FaultKind.MOVX_WITHOUT_STROBE)
_OLD, _FRESH = 1, 2  # of a page: it was written, .. since the last digest


class EmptyBoard(ProcessorBoard):
    """`run(tick)` moves the processor on; `cpu.rxd` must be settled beyond that tick.

    `stop_at`: addresses; a run stops before an instruction there. `stop_at_end`: ... when the program has ended.
    `sent(value, tick, bits, bit_ticks)` gets every character, at the end of so many bits. `listening(tick)` is asked
    when the receiver of the serial port is switched on, and says whether the run has to come back for new input
    (REPLAN). `input_tick`: that of the next level that the outside puts on a pin; NEVER_TICK if none will come.
    """

    HAS_XRAM = True
    STATE: dict[str, Any] = {
        "fault_count": TICK,
        "held": FLAG,
        "powered": FLAG,
        "dead": FLAG,
        "ended": FLAG,
        "next_check": TICK,
        "ends": Items("q", _BYTES, 0, 0xFFFF),
        "pages": Octets(_PAGE * (1 + 2 * _PAGE)),
        "fresh_pages": Octets(_PAGE * (1 + 2 * _PAGE)),
        "registers": ChipRegisters,
    }
    NOT_HASHED: tuple[str, ...] = ("pages", "registers")
    NOT_STATE: tuple[str, ...] = (
        *("spec", "shared", "image", "loops", "stop_at", "stop_at_end"),
        *("sent", "listening", "input_tick", "forced", "again"),
        *("lacking", "lacking_cycle"),
        *("xram_end", "ram", "memory", "touched", "written", "wrote"),  # what `pages` are made of
    )  # fmt: skip

    def __init__(
        self,
        spec: BoardSpec,
        image: Image,
        stop_on_fault: bool = True,
        stop_at: tuple[int, ...] = (),
        stop_at_end: bool = False,
    ) -> None:
        ProcessorBoard.__init__(self, stop_on_fault)
        self.spec = spec
        self.shared = spec.code_in_xram
        self.image = image
        self.stop_at = stop_at
        self.stop_at_end = stop_at_end
        self.sent: Callable[[int, int, int, int], object] | None = None
        self.listening: Callable[[int], bool] | None = None
        self.input_tick = NEVER_TICK
        self.forced = 0  # the processor is reset by its pin or the supply
        self.again = 0  # `listening` wants the run to come back
        self.held = 0
        self.powered = 1
        self.dead = 0  # it has ended; what it sent may still be on its way
        self.ended = 0  # ... and that is over, too
        self.next_check = 0  # cycle at which to set `ends` again
        self.ends: tuple[int, ...] = ()  # jumps to themselves that may be its end
        self.loops = jumps_to_themselves(image.code, image.used)
        self.ram = bytearray(image.code if self.shared else _BYTES)
        self.memory = self.ram
        self.xram_end = spec.xram_bytes if spec.xram == "external" else 0
        if self.shared:
            self.xram_end = _BYTES
        self.written = bytearray(_BYTES)  # with code_in_xram: 1 where the program has put code
        self.wrote = self.written
        self.touched = bytearray(_PAGE)
        self.lacking = [0] * 256  # instructions that accessed registers that the chip lacks, by address
        self.lacking_cycle = 0  # of the last that was counted
        self.load(image)
        chip = CHIPS[spec.chip]
        self.cpu.inner_xram = chip.xram_bytes if spec.xram == "internal" else 0
        self.cpu.peripherals.has_timer2 = int(chip.has_timer2)
        self.registers = registers_of(spec.chip, self.cpu)
        self.cpu.pc = spec.start

    def load(self, image: Image) -> None:
        """Puts the program into the processor's code memory; its symbols name the places of faults."""
        ProcessorBoard.load(self, image)
        first, last = image.symbols.stack if self.spec.bound_stack else (0, 0xFF)
        self.cpu.bound_stack(first, min(last, CHIPS[self.spec.chip].iram_bytes - 1))

    # Time

    def run(self, until_tick: int) -> int:
        """Moves on to `until_tick`. Returns 0; STOPPED after a fault, before `stop_at`, at the end; REPLAN."""
        return self._run((), until_tick)

    def run_to_any(self, addresses: tuple[int, ...], until_tick: int) -> int:
        """Like `run`, but notes REACHED before each instruction at one of `addresses`, and continues."""
        return self._run(addresses, until_tick)

    def _run(self, addresses: tuple[int, ...], until_tick: int) -> int:
        cpu = self.cpu
        until_cycle = (until_tick + CYCLE_TICKS - 1) // CYCLE_TICKS
        faults = self.fault_count
        marks = (*addresses, *self.stop_at) if self.stop_at else addresses
        registers = self.registers
        end_cycle = until_cycle
        while cpu.cycles < end_cycle:
            if registers is not None:
                if registers.due_cycle <= cpu.cycles:
                    self._registers_due()
                until_cycle = min(end_cycle, registers.due_cycle)
            if registers is not None and registers.pause:
                self._sleep_on(until_cycle)
                reason = 0
            elif self.dead:
                if self._say_ended():
                    return STOPPED
                cycle = until_cycle if self.ended else min(self._silent_cycle(), until_cycle)
                reason = self._run_on(addresses, cycle)
            else:
                if cpu.cycles >= self.next_check:
                    self._look_for_ends()
                reason = self._run_on((*self.ends, *marks), min(self.next_check, until_cycle))
            if reason == BREAKPOINT and cpu.pc in self.stop_at:
                return STOPPED
            if reason == BREAKPOINT:
                self._pass_mark(addresses)
            elif reason == ASLEEP:
                if cpu.powered_down or not ((self._may_wake() and self._interruptible()) or self._watched()):
                    self.dead = 1
                else:
                    self._sleep_on(min(self.next_check, until_cycle))
            if self.stop_on_fault and self.fault_count > faults:
                return STOPPED
            if self.again:
                self.again = 0
                return REPLAN
        return 0

    def _run_on(self, marks: tuple[int, ...], until_cycle: int) -> int:
        """To a mark, to sleep that nothing ends if that is of interest, or to `until_cycle`."""
        cpu = self.cpu
        if self.dead or self.held or not self.powered:
            return cpu.run_until_any(marks, until_cycle) if marks else cpu.run(until_cycle)
        cpu.stop_asleep = 1
        reason = cpu.run_until_any(marks, until_cycle) if marks else cpu.run(until_cycle)
        cpu.stop_asleep = 0
        return reason

    def _may_wake(self) -> bool:
        """True if the level of a pin may change without announcement."""
        return self.input_tick != NEVER_TICK

    def _sleep_on(self, until_cycle: int) -> None:
        """Runs without asking what could wake the CPU."""
        self.cpu.run(until_cycle)

    def _pass_mark(self, addresses: tuple[int, ...]) -> None:
        """The instruction at a mark; a jump to itself is the end, or a place where the program waits for interrupts."""
        cpu = self.cpu
        address = cpu.pc
        if address in addresses:
            self.log.note(REACHED, cpu.cycles * CYCLE_TICKS, cpu.instructions, address)
        self._step()
        if self.dead or address not in self.ends:
            return
        if cpu.pc == address and not self._interruptible() and not self._watched():
            self.dead = 1
        else:
            self.ends = tuple([end for end in self.ends if end != address])

    def _step(self) -> None:
        """Executes one instruction."""
        self.cpu.step()

    def _look_for_ends(self) -> None:
        code_at = self._code_at
        self.ends = tuple([address for address in self.loops if jumps_to_itself(code_at, address)])
        self.next_check = self.cpu.cycles + _CHECK_CYCLES

    def marks(self) -> tuple[int, ...]:
        """Addresses at which the board itself sets marks, for each run: for the debugger."""
        return (*self.ends, *self.stop_at)

    def _code_at(self, address: int) -> int:
        return self.cpu.code_at(address)

    def _say_ended(self) -> bool:
        """Notes the end, if it has come; whether the run stops."""
        now = self.cpu.cycles
        if not self.ended and now >= self._silent_cycle():
            self.ended = 1
            self.log.note(ENDED, now * CYCLE_TICKS, 0, self.cpu.pc)
        return bool(self.ended and self.stop_at_end)

    def _silent_cycle(self) -> int:
        """The cycle in which the last character has been sent; 0 if nothing is being sent."""
        peripherals = self.cpu.peripherals
        tick = min(peripherals.uart.ti_tick(), peripherals.shift.flag_tick())
        return 0 if self.cpu.powered_down or tick >= STOPPED_TICK else tick // CYCLE_TICKS + 1

    def _interruptible(self) -> bool:
        enabled = self.cpu.sfr(_IE)
        return bool(enabled & _EA and enabled & _SOURCES)

    # RST and supply

    def set_reset(self, level: int) -> None:
        """The level of the CPU's RST pin from now on, between two instructions: 1 holds it in reset."""
        self.forced = 1
        if level and not self.held:
            self.cpu.hold()
        elif self.held and not level and self.powered:
            self.cpu.reset()
        self.forced = 0
        if self.registers is not None and (level or self.held):
            self.registers.clear()
        self.held = level
        self._begin_again()

    def set_power(self, on: int) -> None:
        """Switches the supply off or on, between two instructions: on, all begins as at first, with zeros in RAM."""
        if on == self.powered:
            return
        self.forced = 1
        self.powered = on
        if on and not self.held:
            self.cpu.reset()
        if not on:
            self.cpu.hold()
            for address in range(256):
                self.cpu.poke_iram(address, 0)
            self.pages = b""
            if self.registers is not None:
                self.registers.begin()
            if self.shared:
                self._put_code()
        self.forced = 0
        self._begin_again()

    def dip(self) -> None:
        """See `ProcessorBoard`; external RAM keeps what it has, too."""
        pages, fresh_pages = self.pages, self.fresh_pages
        ProcessorBoard.dip(self)
        self.pages = pages
        self.fresh_pages = fresh_pages
        if self.shared:
            self._put_code()

    def hold_reset(self, level: int) -> None:
        """The chip holds itself in reset from now on (1), or lets go."""
        self.forced = 1
        if level:
            self.cpu.hold()
        else:
            self.cpu.reset()
        self.forced = 0
        self._begin_again()

    def _registers_due(self) -> None:
        """Between two instructions: begins or ends a reset that the chip's own registers request."""
        registers = self.registers
        if registers is not None and self.powered and not self.held:
            wanted = registers.due()
            if wanted:
                self.hold_reset(wanted & 1)
            if wanted & 1:
                registers.hold()

    def _watched(self) -> bool:
        """True if a watchdog will reset the processor."""
        return self.registers is not None and self.registers.watches() != 0

    def _begin_again(self) -> None:
        self.dead = 0
        self.ended = 0
        self.next_check = 0

    # From the processor

    def movx_read(self, address: int, tick: int) -> int:
        return self.memory[address] if address < self.xram_end else _FLOATING

    def movx_write(self, address: int, value: int, tick: int) -> None:
        if address < self.xram_end:
            self._store(address, value)

    def inner_read(self, address: int) -> int:
        return self.memory[address]

    def inner_write(self, address: int, value: int) -> None:
        self._store(address, value)

    def movx_without_strobe(self, address: int, write: int) -> None:
        """Reports a fault on described boards only: for a bare processor the use of P3.6 and P3.7 is unknown."""
        if self.spec.of_file and not self.forced:
            detail = f"MOVX {'write' if write else 'read'} of {address:#06x}, P3.{6 if write else 7} is 0"
            self._note_fault(_MOVX_WITHOUT_STROBE, self.cpu.at, self.cpu.cycles * CYCLE_TICKS, detail)

    def _store(self, address: int, value: int) -> None:
        self.memory[address] = value
        self.touched[address >> 8] = _FRESH
        if self.shared:
            self.wrote[address] = 1
            self.cpu.write_code(address, value)

    def extra_read(self, address: int) -> int:
        value = -1 if self.registers is None else self.registers.read(address)
        if value >= 0:
            return value
        if not self.cpu.peripherals.observed:
            self._note_lacking(address)
        return _FLOATING

    def extra_write(self, address: int, value: int) -> None:
        if self.registers is None or not self.registers.write(address, value):
            self._note_lacking(address)

    def _note_lacking(self, address: int) -> None:
        """Counts an instruction once, also where a wait goes back and it is executed again."""
        if self.cpu.cycles > self.lacking_cycle:
            self.lacking_cycle = self.cpu.cycles
            self.lacking[address] += 1

    def lacking_registers(self) -> dict[int, int]:
        """Instructions that accessed registers that the chip lacks, by address."""
        return {address: self.lacking[address] for address in range(256) if self.lacking[address]}

    def receiver_on(self, tick: int) -> None:
        if self.listening is not None and self.listening(tick):
            self.again = 1
            self.cpu.request_stop()

    def byte_sent(self, value: int, tick: int) -> None:
        ProcessorBoard.byte_sent(self, value, tick)
        if self.sent is not None:
            self.sent(value, tick, *self._bits())

    def _bits(self) -> tuple[int, int]:
        """Bits before the stop bit, and the length of each, of what the serial port sends now."""
        uart = self.cpu.peripherals.uart
        mode = uart.mode()
        if mode == 0:
            return _DATA_BITS, CYCLE_TICKS
        return _DATA_BITS + (1 if mode == 1 else 2), _ROLLOVERS * uart.tx_period

    def fault(self, kind: int, pc: int, tick: int) -> None:
        """Notes a firmware fault; the run stops after this instruction if it has to."""
        if not self.forced:
            self._note_fault(kind, pc, tick, self._stack_said() if kind in STACK_FAULTS else "")

    def _stack_said(self) -> str:
        """Text with SP and the range of the stack, and the source of that range if it is not the map."""
        source = self.image.symbols.stack_source if self.spec.bound_stack else ""
        return f"{self.cpu.stack_said()}{f' by {source}' if source else ''}"

    def _note_fault(self, kind: int, pc: int, tick: int, detail: str) -> None:
        self.fault_count += 1
        self.log.note(FAULT, tick, kind, pc)
        if len(self.faults) < FAULTS_KEPT:
            symbol = self.image.symbols.name_at(pc)
            self.faults.append(FirmwareFault(FaultKind(kind), tick, pc, symbol, detail))
        if self.stop_on_fault:
            self.cpu.request_stop()

    # RAM

    def xram(self) -> bytes:
        """The whole RAM, 64 KB."""
        return bytes(self.ram)

    def changed_code(self) -> list[int]:
        """Addresses of the image whose bytes the program has replaced; only `code_in_xram` lets it."""
        if not self.shared:
            return []
        code = self.image.code
        return [at for first, end in self.image.used for at in range(first, end) if self.ram[at] != code[at]]

    def begin_period(self) -> None:
        """A digest was made: no page is fresh."""
        for page in range(_PAGE):
            if self.touched[page]:
                self.touched[page] = _OLD

    @property
    def pages(self) -> bytes:
        """The pages that were written: number, content, and with `code_in_xram` which bytes of it are code."""
        return self._content(_OLD)

    @pages.setter
    def pages(self, pages: bytes) -> None:
        """Raises ValueError for what is no list of pages, in order."""
        size = 1 + _PAGE + (_PAGE if self.shared else 0)
        numbers = [pages[start] for start in range(0, len(pages), size)]
        if len(pages) % size or numbers != sorted(set(numbers)):
            raise ValueError(f"{len(pages)} bytes are no pages of RAM, in order")
        for page in range(_PAGE):
            if self.touched[page]:
                first = page * _PAGE
                fresh = self.image.code[first : first + _PAGE] if self.shared else bytes(_PAGE)
                self.ram[first : first + _PAGE] = fresh
                self.written[first : first + _PAGE] = bytes(_PAGE)
                self.touched[page] = 0
        for index, page in enumerate(numbers):
            first, start = page * _PAGE, index * size + 1
            self.ram[first : first + _PAGE] = pages[start : start + _PAGE]
            if self.shared:
                self.written[first : first + _PAGE] = pages[start + _PAGE : start + 2 * _PAGE]
            self.touched[page] = _OLD

    @property
    def fresh_pages(self) -> bytes:
        """The pages of RAM that were written since the last digest."""
        return self._content(_FRESH)

    @fresh_pages.setter
    def fresh_pages(self, pages: bytes) -> None:
        """After `pages`. Raises ValueError for what is not of these."""
        for start in range(0, len(pages), 1 + _PAGE + (_PAGE if self.shared else 0)):
            if not self.touched[pages[start]]:
                raise ValueError(f"page {pages[start]} of RAM was not written")
            self.touched[pages[start]] = _FRESH
        if self.fresh_pages != pages:
            raise ValueError("the pages written last are not those of RAM")

    def _content(self, least: int) -> bytes:
        pages = []
        for page in range(_PAGE):
            if self.touched[page] >= least:
                first = page * _PAGE
                pages.append(bytes([page]) + self.ram[first : first + _PAGE])
                if self.shared:
                    pages.append(bytes(self.written[first : first + _PAGE]))
        return b"".join(pages)

    def after_load(self) -> None:
        """Code lies where it lay, in RAM if program and data share it."""
        ProcessorBoard.after_load(self)
        if self.shared:
            self._put_code()

    def _put_code(self) -> None:
        self.cpu.load(self.image.code, self.image.used)
        for address in range(_BYTES):
            if self.written[address]:
                self.cpu.write_code(address, self.ram[address])

    def __repr__(self) -> str:
        cpu = self.cpu
        return (
            f"EmptyBoard({self.spec.name}, cycle={cpu.cycles}, pc={cpu.pc:04X}h, faults={self.fault_count})"
        )
