"""Checks that firmware which sleeps when idle sleeps again at the end of a run."""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.uart import STOPPED_TICK


class Sleep:
    """The sleep of the processor of a board alone. The driver of the run stops at each `next_tick`.

    `sleeps`: it slept before `begin_tick`; None while that is not known. `late_cycles`: cycles slept so far at 30 ms
    (at 24 MHz) before `end_tick`; -1 while unknown.
    """

    def __init__(self, cpu: Cpu, begin_tick: int, end_tick: int) -> None:
        self.cpu = cpu
        self.end_tick = end_tick
        self.look_tick = begin_tick
        self.sleeps: bool | None = None
        self.late_cycles = -1

    def next_tick(self, tick: int) -> int:
        """Looks if that is due, the run being at `tick`; where the run has to stop next."""
        if tick >= self.look_tick and self.sleeps is None:
            from miro_robot.harness.harness import SETTLE_TICKS  # only boards alone need it loaded

            self.sleeps = bool(self.cpu.idle or self.cpu.idle_cycles)
            self.look_tick = max(self.look_tick, self.end_tick - SETTLE_TICKS)
        if tick >= self.look_tick:
            self.late_cycles = self.cpu.idle_cycles
            self.look_tick = NEVER_TICK
        return self.look_tick

    @property
    def slept(self) -> bool:
        """True if it has slept since the second look."""
        return self.late_cycles >= 0 and self.cpu.idle_cycles > self.late_cycles

    @property
    def answers(self) -> bool:
        """True if firmware that sleeps in time is at something, or sends."""
        cpu = self.cpu
        at_rest = cpu.powered_down or (cpu.idle and cpu.peripherals.uart.ti_tick() >= STOPPED_TICK)
        return bool(self.sleeps and self.slept and not at_rest)
