"""A bus with 64 KB of RAM that keeps what the serial port received and sent, and the oracle of such a machine."""

from __future__ import annotations

from typing import Any

from miro_exact.clock import NEVER_TICK
from miro_robot.harness.harness import LiveOracle
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.uart import STOPPED_TICK
from miro_robot.mcs51.xram import XramBus

LONGEST_ANSWER_TICKS = 24_000_000
"""Longest continuation of a run, after the firmware has gone to sleep, while it still sends; in ticks."""
_LONGEST = LONGEST_ANSWER_TICKS
_KEPT = 4096  # characters of each direction
_NO_FAULT = 1  # failure code of a `BareOracle`


class RecordingBus(XramBus):
    """Records the first 4096 characters of each direction since `begin`, and the first fault, which stops the CPU.

    `received`: characters that the serial port received: value, bit RB8 (the stop bit in mode 1), tick of RI. `sent`:
    characters that it sent: value, tick of TI.
    """

    NOT_STATE = ("cpu", "received", "sent", "fault_kind", "fault_pc", "fault_tick", "resets")

    def __init__(self) -> None:
        XramBus.__init__(self)
        self.cpu: Cpu | None = None
        self.fault_pc = 0
        self.fault_tick = 0
        self.begin()

    def begin(self) -> None:
        """Clears the records."""
        self.received: list[tuple[int, int, int]] = []
        self.sent: list[tuple[int, int]] = []
        self.fault_kind = 0
        self.resets: list[int] = []  # when the reset pin went down

    def byte_received(self, value: int, stop: int, tick: int) -> None:
        if len(self.received) < _KEPT:
            self.received.append((value, stop, tick))

    def byte_sent(self, value: int, tick: int) -> None:
        if len(self.sent) < _KEPT:
            self.sent.append((value, tick))

    def fault(self, kind: int, pc: int, tick: int) -> None:
        if self.fault_kind == 0:
            self.fault_kind = kind
            self.fault_pc = pc
            self.fault_tick = tick
        if self.cpu is not None:
            self.cpu.request_stop()


class BareOracle(LiveOracle):
    """Finds faults of the CPU on `bus`, and lets a run go on while the serial port sends.

    `bus`: a `RecordingBus`, or a board that has `begin`, `fault_kind`, `fault_tick` and `resets` like one.
    """

    NOT_STATE = ("*",)

    def __init__(self, bus: Any, cpu: Cpu) -> None:
        LiveOracle.__init__(self)
        self.bus = bus
        self.cpu = cpu
        self.slept_tick = NEVER_TICK

    def begin(self, tick: int) -> None:
        LiveOracle.begin(self, tick)
        self.slept_tick = NEVER_TICK
        self.bus.begin()

    def restarted(self, tick: int) -> None:
        self.bus.resets.append(tick)

    def look(self, tick: int) -> None:
        if self.bus.fault_kind and self.code == 0:
            self.code = _NO_FAULT
            self.tick = self.bus.fault_tick

    def waits(self) -> bool:
        now = 12 * self.cpu.cycles
        if self.slept_tick == NEVER_TICK:
            self.slept_tick = now
        if self.cpu.powered_down or now - self.slept_tick > _LONGEST:
            return False
        return self.cpu.peripherals.uart.ti_tick() < STOPPED_TICK
