"""The base of every board with a processor: a log of its events, the faults of its firmware, and runs to marks.

Subclasses add the circuit: `board.py` has the robot's two LM629, `empty_board.py` external RAM.
"""

from __future__ import annotations

from typing import Any

from miro_exact.clock import CYCLE_TICKS
from miro_robot.event_log import REACHED, RECEIVED, SENT, EventLog
from miro_robot.faults import FirmwareFault
from miro_robot.image import Image, Symbols
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import BREAKPOINT, Cpu


class ProcessorBoard(Bus):
    """A processor on a board. `faults`: the first of `fault_count`, which is a field of the subclass, in its table, as
    `powered` is. `stuck_low`, `stuck_high`: by port, pins that are shorted to ground, and to the supply, a fault.
    """

    STATE: dict[str, Any] = {"cpu": Cpu, "stuck_low": ("4i", 0, 0xFF), "stuck_high": ("4i", 0, 0xFF)}
    NOT_HASHED: tuple[str, ...] = ("stuck_low", "stuck_high")  # what comes of them is hashed
    NOT_STATE: tuple[str, ...] = ("log", "faults", "symbols", "stop_on_fault")
    fault_count = 0
    powered = 1

    def __init__(self, stop_on_fault: bool) -> None:
        self.cpu = Cpu(self)
        self.log = EventLog()
        self.stop_on_fault = stop_on_fault
        self.stuck_low, self.stuck_high = [0] * 4, [0] * 4
        self.faults: list[FirmwareFault] = []
        self.symbols: Symbols | None = None

    def load(self, image: Image) -> None:
        """Puts the firmware into the CPU's flash; its symbols name the places of faults."""
        self.cpu.load(image.code, image.used)
        self.cpu.bound_stack(*image.symbols.stack)
        self.symbols = image.symbols

    def run(self, until_tick: int) -> int:
        """Moves everything on to `until_tick`. Returns 0, or the CPU's reason for stopping early."""
        raise NotImplementedError

    def run_to_any(self, addresses: tuple[int, ...], until_tick: int) -> int:
        """Like `run`, but notes REACHED before each instruction at one of `addresses`, and continues."""
        cpu = self.cpu
        while True:
            cpu.mark(addresses)
            try:
                stopped = self.run(until_tick)
            finally:
                cpu.unmark(addresses)
            if stopped != BREAKPOINT:
                return stopped
            self.log.note(REACHED, cpu.cycles * CYCLE_TICKS, cpu.instructions, cpu.pc)
            # Past the marked instruction, at which the next run would end at once.
            stopped = self.run(cpu.cycles * CYCLE_TICKS + 1)
            if stopped or cpu.cycles * CYCLE_TICKS >= until_tick:
                return stopped

    def set_reset(self, level: int) -> None:
        """The level of the CPU's RST pin from now on, between two instructions: 1 holds it in reset."""
        raise NotImplementedError

    def set_power(self, on: int) -> None:
        """Switches the supply off or on, between two instructions."""
        raise NotImplementedError

    def dip(self) -> None:
        """The supply falls for no time: all begins again, RAM keeps what it has."""
        if self.powered:
            ram = [self.cpu.peek_iram(address) for address in range(256)]
            self.set_power(0)
            for address, byte in enumerate(ram):
                self.cpu.poke_iram(address, byte)
            self.set_power(1)

    def hold_pin(self, port: int, bit: int, level: int) -> None:
        """Fault, between two instructions: a port pin is shorted to ground (0), to the supply (1), or is whole (-1)."""
        raise NotImplementedError

    def _hold_pin(self, port: int, bit: int, level: int, outside: int) -> None:
        """Sets the processor's view of a shorted pin. `outside`: on the pins of that port."""
        mask = 1 << bit
        self.stuck_low[port] = self.stuck_low[port] & ~mask | (mask if level == 0 else 0)
        self.stuck_high[port] = self.stuck_high[port] & ~mask | (mask if level == 1 else 0)
        self.cpu.hold_pins(port, self.stuck_low[port], self.stuck_high[port], outside)

    def is_stuck(self) -> bool:
        """True if any pin is shorted."""
        return self.cpu.peripherals.ports.is_stuck()

    def after_load(self) -> None:
        """The processor has the shorted pins."""
        for port in range(4):
            self.cpu.peripherals.ports.hold(port, self.stuck_low[port], self.stuck_high[port])

    def byte_received(self, value: int, stop: int, tick: int) -> None:
        """Notes a character that the serial port delivered."""
        self.log.note(RECEIVED, tick, stop, value)

    def byte_sent(self, value: int, tick: int) -> None:
        """Notes a character that the serial port sent."""
        self.log.note(SENT, tick, 0, value)
