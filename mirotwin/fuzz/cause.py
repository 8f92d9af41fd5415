"""Finds the cause of a fault: the instruction that went wrong first, by which crashes are distinguished.

One overflow overwrites return addresses with input bytes, so the same mistake ends in faults all over the image. They
share the instruction that overwrote the stack:

    store ──overwrites──► return address ──RET──► anywhere ──► the fault
      └ the cause          └ else the RET, where nobody saw the store

The search runs instruction by instruction, some hundred times slower than a normal run, so it is used for failing
inputs only.
"""

from __future__ import annotations

import msgspec

from miro_robot.image import Image
from miro_robot.inspect.frames import Unwinder
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import is_call

_RET = 0x22


class Cause(msgspec.Struct, frozen=True):
    """The instruction at `pc` and its mistake `what`; "" for the fault itself."""

    pc: int
    what: str = ""


class CauseWatcher(Watcher):
    """`cause`: the first instruction that went wrong, None where none was observed."""

    def __init__(self, image: Image, names: SymbolNames) -> None:
        self._unwinder = Unwinder(image, names)
        self._frames: list[
            tuple[int, int]
        ] = []  # of calls under way: where the return address ends, and itself
        self.cause: Cause | None = None

    def attached(self, cpu: Cpu) -> None:
        self.begin(cpu)

    def begin(self, cpu: Cpu) -> None:
        """Starts the search at the present state of `cpu`."""
        self.cause = None
        frames = [frame for frame in self._unwinder.frames(cpu) if frame.known and frame.entry]
        self._frames = [(frame.base, _word(cpu, frame.base)) for frame in reversed(frames)]

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        self._called(cpu, pc)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        if self.cause is not None:
            return
        opcode = cpu.code_at(pc)
        if is_call(opcode):
            self._called(cpu, _word(cpu, cpu.sp))
        if not cpu.is_loaded(cpu.pc) or (opcode == _RET and self._came_from_no_call(cpu)):
            self.cause = Cause(pc, "goes where no program is")
        while self._frames and self._frames[-1][0] > cpu.sp:
            self._frames.pop()
        if any(_word(cpu, place) != back for place, back in self._frames):
            self.cause = Cause(pc, "overwrites a return address")

    def _called(self, cpu: Cpu, back: int) -> None:
        while self._frames and self._frames[-1][0] >= cpu.sp - 1:
            self._frames.pop()
        self._frames.append((cpu.sp, back))

    def _came_from_no_call(self, cpu: Cpu) -> bool:
        """True if a return jumped to where no path through the code leads and before which no call stands."""
        return cpu.pc not in self._unwinder.heights and self._unwinder.call_before(cpu.pc) < 0


def _word(cpu: Cpu, place: int) -> int:
    return cpu.peek_iram(place - 1) | cpu.peek_iram(place) << 8
