"""How often each instruction ran, how long it took, and which way its branch went.

What functions, lines and percentages follow from it is in `profile.py` and `coverage.py`.
"""

from __future__ import annotations

from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH

_SPACE = 0x10000


class Counters(Watcher):
    """Counts by code address; one object may watch several CPUs that run the same image.

    `executed_at(a)`: times the instruction at `a` ran; `cycles_at(a)`: machine cycles it took; `jumped_at(a)`: times
    the program went on somewhere else than after it.
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
        """Where instructions ran, ascending."""
        return [address for address in range(_SPACE) if self.executions[address]]
