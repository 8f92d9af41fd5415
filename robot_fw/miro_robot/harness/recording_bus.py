"""A bus with 64 KB of RAM that keeps what the serial port received and sent, and the oracle of such a machine."""

from __future__ import annotations

from array import array

from miro_exact.clock import NEVER_TICK
from miro_robot.harness.harness import LiveOracle
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.uart import STOPPED_TICK
from miro_robot.mcs51.xram import XramBus

KEPT = 4096
"""Characters of each direction that are kept."""
NO_FAULT = 1
"""What a `BareOracle` finds."""
LONGEST_ANSWER_TICKS = 24_000_000
"""How long a run goes on, behind the moment at which the firmware sleeps, while it still sends."""
_KEPT, _NO_FAULT, _LONGEST = KEPT, NO_FAULT, LONGEST_ANSWER_TICKS
_NEVER, _STOPPED = NEVER_TICK, STOPPED_TICK


class RecordingBus(XramBus):
    """Keeps the first 4096 characters of each direction since `begin`, and the first fault, which stops the CPU."""

    NOT_STATE = (
        *("code_of", "faulted", "sent", "cpu"),
        *("received_values", "received_stops", "received_ticks", "received"),  # what was seen
        *("sent_values", "sent_ticks", "sent_count"),
        *("fault_kind", "fault_pc", "fault_tick", "reset_tick"),
    )

    def __init__(self) -> None:
        XramBus.__init__(self, _nothing, _nothing)
        self.cpu: Cpu | None = None
        self.received_values = bytearray(KEPT)
        self.received_stops = bytearray(KEPT)
        self.received_ticks = array("q", bytes(8 * KEPT))
        self.received = 0
        self.sent_values = bytearray(KEPT)
        self.sent_ticks = array("q", bytes(8 * KEPT))
        self.sent_count = 0
        self.fault_kind = 0
        self.fault_pc = 0
        self.fault_tick = 0
        self.reset_tick = -1  # of the last reset, -1 without one

    def begin(self) -> None:
        """Forgets what it kept."""
        self.received = 0
        self.sent_count = 0
        self.fault_kind = 0
        self.reset_tick = -1

    def byte_received(self, value: int, stop: int, tick: int) -> None:
        if self.received < _KEPT:
            self.received_values[self.received] = value
            self.received_stops[self.received] = stop
            self.received_ticks[self.received] = tick
            self.received += 1

    def byte_sent(self, value: int, tick: int) -> None:
        if self.sent_count < _KEPT:
            self.sent_values[self.sent_count] = value
            self.sent_ticks[self.sent_count] = tick
            self.sent_count += 1

    def fault(self, kind: int, pc: int, tick: int) -> None:
        if self.fault_kind == 0:
            self.fault_kind = kind
            self.fault_pc = pc
            self.fault_tick = tick
        if self.cpu is not None:
            self.cpu.request_stop()

    def heard(self) -> list[tuple[int, int, int]]:
        """What the serial port received: value, bit RB8 (the stop bit in mode 1), tick of RI."""
        return [
            (self.received_values[at], self.received_stops[at], self.received_ticks[at])
            for at in range(self.received)
        ]

    def said(self) -> list[tuple[int, int]]:
        """What the serial port sent: value, tick of TI."""
        return [(self.sent_values[at], self.sent_ticks[at]) for at in range(self.sent_count)]


class BareOracle(LiveOracle):
    """Finds faults of the CPU on `bus`, and lets a run go on while the serial port sends."""

    NOT_STATE = ("bus", "cpu", "code", "tick", "slept_tick")

    def __init__(self, bus: RecordingBus, cpu: Cpu) -> None:
        LiveOracle.__init__(self)
        self.bus = bus
        self.cpu = cpu
        self.slept_tick = _NEVER

    def begin(self, tick: int) -> None:
        self.code = 0
        self.tick = 0
        self.slept_tick = _NEVER
        self.bus.begin()

    def restarted(self, tick: int) -> None:
        self.bus.reset_tick = tick

    def look(self, tick: int) -> None:
        if self.bus.fault_kind and self.code == 0:
            self.code = _NO_FAULT
            self.tick = self.bus.fault_tick

    def waits(self) -> bool:
        now = 12 * self.cpu.cycles
        if self.slept_tick == _NEVER:
            self.slept_tick = now
        if self.cpu.powered_down or now - self.slept_tick > _LONGEST:
            return False
        return self.cpu.peripherals.uart.ti_tick() < _STOPPED


def _nothing(*_: int) -> None:
    """Nobody is told: everything is kept."""
