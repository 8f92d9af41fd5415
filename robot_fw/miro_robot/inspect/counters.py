"""Counts of a CPU: executions, cycles and branch directions of each instruction; interrupts, sleep, and stack depth.

Functions, lines and percentages are computed from them in `profile.py` and `coverage.py`.

The latency of an interrupt is counted as Atmel's 8051 Hardware Manual does (4316E, section 2.16, response time): full
machine cycles between the one in which the flag is latched and the first one of the routine; 3 at least. A request that
stays up through its own routine counts from that routine's end.
"""

from __future__ import annotations

import msgspec

from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import INTERRUPTS, LENGTH

_SPACE = 0x10000


class Counters(Watcher):
    """Counts by code address; one object may watch several CPUs that run the same image.

    `executed_at(a)`: times the instruction at `a` ran; `cycles_at(a)`: machine cycles it took; `jumped_at(a)`: times
    the program continued elsewhere than behind it.
    """

    def __init__(self) -> None:
        self.length_of = LENGTH
        self.executions = [0] * 65536
        self.cycles = [0] * 65536
        self.jumps = [0] * 65536

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        self.executions[pc] += 1
        self.cycles[pc] += cpu.cycles - start
        if cpu.pc != (pc + self.length_of[cpu.code_at(pc)]) & 0xFFFF:
            self.jumps[pc] += 1

    def executed_at(self, address: int) -> int:
        return self.executions[address & 0xFFFF]

    def cycles_at(self, address: int) -> int:
        return self.cycles[address & 0xFFFF]

    def jumped_at(self, address: int) -> int:
        return self.jumps[address & 0xFFFF]

    def addresses(self) -> list[int]:
        """Addresses of executed instructions, ascending."""
        return [address for address in range(_SPACE) if self.executions[address]]


_RETI = 0x32
_CALL_CYCLES = 2  # of the hardware's LCALL
_DEPTH = 8


class InterruptProfile(msgspec.Struct):
    """Latency and duration in machine cycles; ticks of 24 MHz at which the worst ones began.

    `total_cycles`: from the call of the routine to the end of its RETI, routines that came in between included.
    `unfinished_cycles`: of a routine that was called at `unfinished_tick` and has not come to its RETI, 0 without one.
    """

    source: str
    count: int = 0
    worst_latency: int = 0
    worst_latency_tick: int = 0
    worst_duration: int = 0
    worst_duration_tick: int = 0
    total_cycles: int = 0
    unfinished_cycles: int = 0
    unfinished_tick: int = 0

    @property
    def never_left(self) -> bool:
        """True if the routine that is under way takes longer than any that came to its end."""
        return self.unfinished_cycles > self.worst_duration


class Activity(Watcher):
    """Cycles asleep, stack and the six interrupts of one CPU, from when it is attached.

    `cycles`: how long it was watched, `asleep_cycles` of them in idle mode or power-down. `interrupts`: by number.
    """

    def __init__(self) -> None:
        self.cycles = 0
        self.asleep_cycles = 0
        self.highest_sp = 0
        self.highest_sp_tick = 0
        self.interrupts = [InterruptProfile(name) for name in INTERRUPTS]
        self.ended = [0] * 6  # cycle at which the source's routine was last over
        self.began = [0] * 8  # of the routines in service, outermost first
        self.serving = [0] * 8
        self.depth = 0

    def attached(self, cpu: Cpu) -> None:
        self.highest_sp = cpu.sp
        self.highest_sp_tick = 12 * cpu.cycles

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        if cpu.sp > self.highest_sp:
            self.highest_sp = cpu.sp
            self.highest_sp_tick = 12 * cpu.cycles
        if self.depth and cpu.code_at(pc) == _RETI:
            self._leave(cpu.cycles)

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        if cpu.sp > self.highest_sp:
            self.highest_sp = cpu.sp
            self.highest_sp_tick = 12 * cpu.cycles
        profile = self.interrupts[source]
        profile.count += 1
        asked = cpu.peripherals.interrupts.since[source]
        if asked < self.ended[source]:
            asked = self.ended[source] - 1
        latency = start + _CALL_CYCLES - asked - 1
        if latency > profile.worst_latency:
            profile.worst_latency = latency
            profile.worst_latency_tick = 12 * asked
        if self.depth < _DEPTH:
            self.began[self.depth] = start
            self.serving[self.depth] = source
            self.depth += 1

    def _leave(self, cycle: int) -> None:
        self.depth -= 1
        source = self.serving[self.depth]
        duration = cycle - self.began[self.depth]
        self.ended[source] = cycle
        profile = self.interrupts[source]
        profile.total_cycles += duration
        profile.unfinished_cycles = 0
        if duration > profile.worst_duration:
            profile.worst_duration = duration
            profile.worst_duration_tick = 12 * self.began[self.depth]

    def slept(self, cpu: Cpu, start: int, end: int) -> None:
        self.asleep_cycles += end - start

    def ran(self, cpu: Cpu, start: int) -> None:
        self.cycles += cpu.cycles - start
        for level in range(self.depth):
            profile = self.interrupts[self.serving[level]]
            profile.unfinished_cycles = cpu.cycles - self.began[level]
            profile.unfinished_tick = 12 * self.began[level]
