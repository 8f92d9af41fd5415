"""A bare board for `mirotwin fw run`: the CPU, 64 KB of external RAM, a terminal on the serial port, levels on pins.

What comes in on RXD is in `input.py`, what comes in on other pins in `pins.py`, the robot's board with its motion
controllers in `board.py`.

A program has ended when no input can make it do anything more: in power-down, asleep with nothing that could wake it,
or in a jump to itself while no interrupt is enabled. The run goes on until the last character has been sent.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK, Items, Rows
from miro_robot.bare.input import InputPiece, SerialInput
from miro_robot.bare.pins import PinEvent, PinInput
from miro_robot.faults import STACK_FAULTS, FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.cpu import ASLEEP, BREAKPOINT, Cpu
from miro_robot.mcs51.opcodes import jumps_to_itself
from miro_robot.mcs51.uart import STOPPED_TICK
from miro_robot.mcs51.xram import XramBus

CRYSTAL_HZ = 24_000_000
CRYSTAL_RANGE_HZ = (32_768, 100_000_000)
_SLICE = 200_000  # cycles after which a jump to itself that interrupts left is looked at again
_FAULTS_KEPT = 100
_EA, _SOURCES = 0x80, 0x3F  # of IE


class Ended(StrEnum):
    """Why a run ended."""

    UNTIL = "until"  # the address asked for is next
    CYCLES = "cycles"  # the limit is reached
    FAULT = "fault"
    PAUSED = "paused"  # where the caller wanted to look; it can go on
    HALTED = "halted"  # nothing can ever make it go on: a jump to itself or asleep, with no interrupt to come


class BareMachine:
    """One AT89C52 with RAM and a terminal.

    `stdin` is sent to the serial port byte by byte, see `SerialInput`: plain bytes from when the program listens on;
    `wait`: each as soon as it has taken the one before.
    The rate is the one the receiver is programmed for, or `baud`, which also serves a program that measures its first
    character. `live`: `input.add` may add more at any time. `pins` are put on the ports.
    `output` gets the characters sent. With `code_in_xram`, program and data share one 64 KB space (EA low).
    The first instruction is at `start`, as after a jump there by a monitor.
    A machine cycle is 12 periods of the crystal, a tick one. Raises ValueError for parameters out of range.
    """

    STATE = {
        "bus": XramBus,
        "cpu": Cpu,
        "loaded": ("65536B", 0, 1),
        "faults": Rows(
            *(_FAULTS_KEPT, "q", ("q", 0, NEVER_TICK), ("q", 0, 0xFFFF)),
            split=lambda fault: (int(fault.kind), fault.tick, fault.pc),
            make=lambda cells: FirmwareFault(FaultKind(cells[0]), cells[1], cells[2]),
        ),
        "faults_lost": TICK,
        "input": SerialInput,
        "pins": PinInput,
        "next_feed": TICK,
        "next_check": TICK,
        "ends": Items("q", 0x10000, 0, 0xFFFF),
        "dead": "?",
    }
    NOT_STATE = ("image", "loops", "output", "stop_on_fault")

    def __init__(
        self,
        image: Image,
        code_in_xram: bool = False,
        stdin: bytes | tuple[InputPiece, ...] = b"",
        baud: int | None = None,
        output: Callable[[bytes], object] | None = None,
        stop_on_fault: bool = True,
        crystal_hz: int = CRYSTAL_HZ,
        gap_ticks: int = 0,
        live: bool = False,
        pins: tuple[PinEvent, ...] = (),
        start: int = 0,
        wait: bool = False,
    ) -> None:
        least, most = CRYSTAL_RANGE_HZ
        if not least <= crystal_hz <= most:
            raise ValueError(f"crystal {crystal_hz} Hz is outside {least}..{most}")
        self.image = image
        self.output = output
        self.stop_on_fault = stop_on_fault
        self.loops = [  # jumps to themselves, among them some in the middle of instructions
            address
            for first, end in image.used
            for address in range(first, end)
            if jumps_to_itself(image.code.__getitem__, address)
        ]
        self.faults: list[FirmwareFault] = []  # the first hundred
        self.faults_lost = 0  # how many more there were
        self.next_feed = 0  # cycle at which to look after the inputs
        self.next_check = 0  # ... and at which to set `ends` again
        self.ends: tuple[int, ...] = ()  # jumps to themselves that may be its end
        self.loaded = bytearray(0x10000)  # 1 where executing is legal; up to date while the state is saved
        self.dead = False  # it has ended; what it sent may still be on its way
        self.bus = XramBus(self._sent, self._faulted, self._receiver_on)
        self.cpu = Cpu(self.bus)
        self.cpu.stop_asleep = 1
        self.cpu.load(image.code, image.used)
        self.cpu.bound_stack(*image.symbols.stack)
        self.cpu.pc = start
        if code_in_xram:
            self.bus.fill(image.code)
            self.bus.code_of = self.cpu
        pieces = (InputPiece(stdin),) if isinstance(stdin, bytes) else stdin
        self.input = SerialInput(self.cpu, pieces, baud, crystal_hz, gap_ticks, live, wait)
        self.pins = PinInput(self.cpu, pins)
        if self.pins.uses_rxd and (live or self.input.pieces):
            raise ValueError("P3.0 is RXD and cannot be a pin while serial input is sent there")

    def run(
        self,
        until: int | None = None,
        max_cycles: int | None = None,
        progress: Callable[[int], object] | None = None,
        pause: int | None = None,
    ) -> Ended:
        """Until the instruction at `until` is next, the program has ended, `cycles` >= `max_cycles`, or a fault.

        `pause`: cycle at which to come back for the time being.
        `progress` is called with the cycle count every now and then.
        """
        limit = NEVER_TICK if max_cycles is None else max_cycles
        stop = limit if pause is None else min(limit, pause)
        faults = len(self.faults) + self.faults_lost
        while self.cpu.cycles < stop:
            if self.dead:
                if self.cpu.cycles >= self._silent_cycle():
                    return Ended.HALTED
                self._sleep_on(min(self._silent_cycle(), stop))
                continue
            if self._run_on(until, stop):
                return Ended.UNTIL
            if self.stop_on_fault and len(self.faults) + self.faults_lost > faults:
                return Ended.FAULT
            if progress is not None:
                progress(self.cpu.cycles)
        return Ended.CYCLES if self.cpu.cycles >= limit else Ended.PAUSED

    def _run_on(self, until: int | None, stop: int) -> bool:
        """To the next look at the inputs, or what comes before; whether that is `until`."""
        cpu = self.cpu
        if cpu.cycles >= self.next_feed:
            self.next_feed = min(self.input.feed(), self.pins.feed())
        if cpu.cycles >= self.next_check:
            self.ends = tuple(address for address in self.loops if jumps_to_itself(cpu.code_at, address))
            self.next_check = cpu.cycles + _SLICE
        end = min(self.next_feed, self.next_check, stop)
        reason = cpu.run_until_any(self.ends if until is None else (*self.ends, until), end)
        if reason == BREAKPOINT and cpu.pc == until:
            return True
        if reason == BREAKPOINT:
            self._jump_to_itself()
        elif reason == ASLEEP and (
            cpu.powered_down or self.pins.next_tick == NEVER_TICK or not self._interruptible()
        ):
            self.dead = True
        elif reason == ASLEEP:
            self._sleep_on(end)
        return False

    def _jump_to_itself(self) -> None:
        """Executes it once: the end, or a place where the program waits for interrupts."""
        address = self.cpu.pc
        self.cpu.step()
        if self.cpu.pc == address and not self._interruptible():
            self.dead = True
        else:
            self.ends = tuple(end for end in self.ends if end != address)

    def _sleep_on(self, until_cycle: int) -> None:
        """Runs without asking what could wake the CPU."""
        self.cpu.stop_asleep = 0
        self.cpu.run(until_cycle)
        self.cpu.stop_asleep = 1

    def _silent_cycle(self) -> int:
        """The cycle in which the last character has been sent; 0 if nothing is being sent."""
        peripherals = self.cpu.peripherals
        tick = min(peripherals.uart.ti_tick(), peripherals.shift.flag_tick())
        return 0 if self.cpu.powered_down or tick >= STOPPED_TICK else tick // 12 + 1

    def _interruptible(self) -> bool:
        enabled = self.cpu.sfr(0xA8)
        return bool(enabled & _EA and enabled & _SOURCES)

    def changed_code(self) -> list[int]:
        """Addresses of the image whose bytes the program has replaced; only `code_in_xram` lets it."""
        if self.bus.code_of is None:
            return []
        now, image = self.bus.content(), self.image
        return [at for first, end in image.used for at in range(first, end) if now[at] != image.code[at]]

    def dump(self) -> dict[str, object]:
        """Registers and memories; SFRs by two hex digits, ports at their latches."""
        cpu = self.cpu
        return {
            "pc": cpu.pc,
            "cycles": cpu.cycles,
            "instructions": cpu.instructions,
            "iram_hex": bytes(cpu.peek_iram(address) for address in range(0x100)).hex(),
            "sfr": {f"{address:02x}": cpu.sfr(address) for address in range(0x80, 0x100)},
            "xram_hex": self.bus.content().hex(),
        }

    def _sent(self, value: int, tick: int) -> None:
        self.input.heard(value, tick)
        if self.output is not None:
            self.output(bytes([value]))

    def _receiver_on(self, tick: int) -> None:
        """What waits for the receiver begins now, not only at the next look."""
        if self.input.waits_for_receiver:
            self.next_feed = 0
            self.cpu.request_stop()

    def _faulted(self, kind: int, pc: int, tick: int) -> None:
        if len(self.faults) < _FAULTS_KEPT:
            symbol = self.image.symbols.name_at(pc)
            detail = self.cpu.stack_said() if kind in STACK_FAULTS else ""
            self.faults.append(FirmwareFault(FaultKind(kind), tick, pc, symbol, detail))
        else:
            self.faults_lost += 1
        if self.stop_on_fault:
            self.cpu.request_stop()

    def before_save(self) -> None:
        for address in range(0x10000):
            self.loaded[address] = self.cpu.is_loaded(address)

    def after_load(self) -> None:
        """Code lies where it lay, in RAM if program and data share it; places of faults get their names."""
        code = self.bus.content() if self.bus.code_of is not None else self.image.code
        self.cpu.load(self.image.code, ())
        for address, loaded in enumerate(self.loaded):
            if loaded:
                self.cpu.write_code(address, code[address])
        names = self.image.symbols
        for index, fault in enumerate(self.faults):
            self.faults[index] = FirmwareFault(fault.kind, fault.tick, fault.pc, names.name_at(fault.pc))
