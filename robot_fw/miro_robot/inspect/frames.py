"""Unwinds the stack: the active functions, from the stack's height that the code implies at each instruction.

              ┌ base: where the return address of the function ends
.. | caller's | low high | what the function pushed so far | free ..
                                                           └ SP: base + height of the instruction that is next
"""

from __future__ import annotations

import msgspec

from miro_robot.image import Image
from miro_robot.inspect.stack_depth import JMP_TABLE, VECTORS, StackReader
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH, goes_on, is_call, target

_MOST_FRAMES = 128  # two bytes each fill internal RAM
RESET_SP = 7
_MOST_SHIFT = 32
_LCALL_BYTES, _ACALL_BYTES = 3, 2


class StackFrame(msgspec.Struct, frozen=True):
    """An active function: `pc`: its next instruction, `entry`: its first executed address, `base`: SP at its entry.

    `place`: the present instruction, for an outer frame the call. `by_interrupt`: called by hardware. `known`: the
    outer frames can be determined.
    """

    pc: int
    place: int
    entry: int
    base: int
    by_interrupt: bool
    known: bool


class Unwinder:
    """Reads the frames of a CPU that runs `image`. `heights`: instruction -> (bytes above the entry, entry), of which
    some are guessed; `from_reset`: instructions that reset leads to.
    """

    def __init__(self, image: Image, names: SymbolNames) -> None:
        self.code = image.code
        self._reader = StackReader(image)
        self._ways: dict[int, list[tuple[int, int]]] = {}  # instruction -> (height, entry) of each way to it
        self._called: set[int] = set()
        self._enter(0)
        # Before the vectors are entered: what only they lead to is not the main program.
        self.from_reset = set(self._ways)
        self.vectors = set()
        for vector in VECTORS:
            if vector not in self.from_reset:  # start-up code may lie where no interrupt is used
                self.vectors.add(vector)
                self._enter(vector)  # also where the vector before runs into it, over NOP
        # Not those that were reached: a label within a function has a height of its own, and would get 0.
        for first, _ in names.functions:
            if first not in self._ways:  # called by a pointer, if at all
                self._enter(first)
        self._enter_nameless(image.used)
        self.heights = {
            address: height
            for address, ways in self._ways.items()
            if (height := _agreed(ways, names.function(address)[0])) is not None
        }

    def _enter(self, entry: int) -> None:
        """Notes the heights of a function, and of all that it calls."""
        waiting = [entry]
        while waiting:
            entry = waiting.pop()
            # Functions call each other in circles.
            if entry in self._called:
                continue
            self._called.add(entry)
            for address, height in self._reader.heights(entry).items():
                self._ways.setdefault(address, []).append((height, entry))
                to = target(self.code, address) if is_call(self.code[address]) else None
                waiting += [] if to is None else [to]

    def _enter_nameless(self, used: tuple[tuple[int, int], ...]) -> None:
        """Notes the heights of library functions that only a pointer calls: each begins where another ends."""
        waiting = sorted(self._ways)
        while waiting:
            address = waiting.pop()
            opcode = self.code[address]
            after = address + LENGTH[opcode]
            # JMP @A+DPTR is followed by its table, which is no function.
            ends = not goes_on(opcode) and opcode != JMP_TABLE
            if ends and after not in self._ways and any(first <= after < end for first, end in used):
                for place, height in self._reader.heights(after).items():
                    if place not in self._ways:
                        self._ways[place] = [(height, after)]
                        waiting.append(place)

    def base(self, cpu: Cpu) -> int:
        """`base` of the CPU's present function; SP itself if the code does not allow to compute it."""
        return cpu.sp - self.heights.get(cpu.pc, (0, 0))[0]

    def frames(self, cpu: Cpu, shifted: int = -1, by: int = 0) -> list[StackFrame]:
        """Active functions, innermost first.

        The last one is `known` if it is that of reset. `by`: bytes that the function of frame `shifted` pushed beyond
        those its code implies.
        """
        frames: list[StackFrame] = []
        pc, place, sp = cpu.pc, cpu.pc, cpu.sp
        # Bounded: return addresses that were overwritten may lead in a circle.
        while len(frames) < _MOST_FRAMES:
            height, entry = self.heights.get(pc, (0, -1))
            base = sp - height - (by if len(frames) == shifted else 0)
            back = cpu.peek_iram(base - 1) | cpu.peek_iram(base) << 8
            by_interrupt = entry in self.vectors
            # The hardware's call is no instruction: what is before the return address says nothing.
            call = back if by_interrupt else self.call_before(back)
            # Without a call before it the word is data: going on would show functions that never ran.
            known = entry >= 0 and (entry == 0 or (base > 0 and call >= 0))
            frames.append(StackFrame(pc, place, entry if entry >= 0 else pc, base, by_interrupt, known))
            if entry == 0 or not known:
                break
            pc, place, sp = back, call, base - 2
        return frames

    def out_of_step(self, cpu: Cpu, bottom: int) -> tuple[int, int] | None:
        """(frame, bytes that its function pushed more than the code says, or fewer) which make the stack whole again.

        `bottom`: SP where the stack is empty, -1 where that is not known. None where nothing is out of step, or no such
        number explains it.
        """
        frames = self.frames(cpu)
        whole = range(0x100) if bottom < 0 else (bottom,)
        if frames[-1].known and frames[-1].base in (*whole, RESET_SP):
            return None
        # The fewest bytes first: with enough of them any stack can be explained.
        for size in range(1, _MOST_SHIFT + 1):
            for by in (size, -size):
                for index in reversed(range(len(frames))):
                    last = self.frames(cpu, index, by)[-1]
                    if last.known and last.base in whole:
                        return index, by
        return None

    def call_before(self, address: int) -> int:
        """Address of the call that returns to `address`; -1 if there is none."""
        for size in (_LCALL_BYTES, _ACALL_BYTES):
            place = (address - size) & 0xFFFF
            # By size: the last two bytes of an LCALL may look like an ACALL.
            if is_call(self.code[place]) and (self.code[place] == 0x12) == (size == _LCALL_BYTES):
                return place
        return -1


def _agreed(ways: list[tuple[int, int]], own: int) -> tuple[int, int] | None:
    """The height that all ways to an instruction agree in; where they do not, that from the function's own begin."""
    for height, entry in ways:
        # Paths into a shared tail arrive with other heights: what the function itself does is the likely one.
        if entry == own:
            return height, entry
    return ways[0] if len({height for height, _ in ways}) == 1 else None
