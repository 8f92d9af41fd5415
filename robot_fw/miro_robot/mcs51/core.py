"""Registers and memory of the core, and the hooks through which instructions reach the rest of the chip.

Instructions are in `execute.py`. README.md in this folder draws the three classes `Core`, `Executor`, `Cpu` and their
hooks.
"""

from __future__ import annotations

from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.opcodes import LINE

LAST_CYCLE = 1 << 55
"""Ticks and the counts of a timer up to then fit into 64 bits."""


_SPREAD_FROM, _SPREAD_TO = 0x9E35, 0x3C6F  # odd, so that different branches differ in the low bits
_DEPTH = 8  # interrupts in service whose branches are kept; RETI may be forgotten, so more can come


class Core:
    """What instructions work on; `cycles` counts since power-on."""

    STATE: dict[str, object] = {
        "iram": "256B",
        "pc": ("i", 0, 0xFFFF),
        "a": ("i", 0, 0xFF),
        "b": ("i", 0, 0xFF),
        "sp": ("i", 0, 0xFF),
        "dptr": ("i", 0, 0xFFFF),
        "cy": FLAG,
        "ac": FLAG,
        "ov": FLAG,
        "user_flags": ("i", 0, 0x22),
        "bank": ("i", 0, 0x18),
        "cycles": ("q", 0, LAST_CYCLE),
        "instructions": TICK,
        "idle_cycles": TICK,
        "faults": TICK,
    }
    NOT_STATE: tuple[str, ...] = (
        "bus",
        "rom",  # the image: constant while it runs, unless code lies in RAM, whose owner then restores it
        "lines",
        "line_of",
        "stack_floor",  # where the image's map says that the stack is
        "stack_end",
        "at",
        "start",  # the instruction in progress: snapshots are taken between two
        "limit",
        "until",
        "stop",
        *("edges", "edge_mask", "edge_before", "edge_outer", "edge_depth", "highest_sp"),  # what was seen
    )

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.rom = bytearray(0x10002)  # 64 KB, and the first two bytes again for operands that wrap
        self.lines = [0] * 65536  # per address: `line_at`, or a special line
        self.line_of = list(LINE)
        self.iram = bytearray(256)
        self.pc = 0  # while instructions are executed: as of the last `boundary`
        self.a = 0
        self.b = 0
        self.sp = 7
        self.dptr = 0
        self.cy = 0
        self.ac = 0
        self.ov = 0
        self.user_flags = 0  # F0 and UD, in their places in PSW
        self.bank = 0  # address of R0: 00, 08, 10 or 18
        self.cycles = 0  # machine cycles since power-on; during an instruction: its end
        self.start = 0  # first cycle of the instruction in progress
        self.at = 0  # its address
        self.limit = 0  # cycle at which the loop has to look up
        self.until = 0
        self.stop = 0
        self.instructions = 0  # as of the last run
        self.idle_cycles = 0
        self.faults = 0
        self.edges = memoryview(bytearray(1))
        self.edge_mask = 0  # 0: edges are not counted
        self.edge_before = 0
        self.edge_outer = [0] * 8
        self.edge_depth = 0
        self.highest_sp = 0  # of a stack that grew since it was last set
        self.stack_floor = 0  # SP of an empty stack
        self.stack_end = 0  # the first address past it: 00 is past FF

    def watch_edges(self, edges: memoryview) -> None:
        """Counts from now on how often each edge between two taken branches is passed, in `edges`.

        A writable buffer of 2^n bytes, at most 65536; a count goes from 255 to 1. One byte: counts nothing.
        """
        size = len(edges)
        if size & (size - 1) or not 1 <= size <= 0x10000:
            raise ValueError(f"a map of {size} bytes: give it 1, 2, 4 .. 65536")
        self.edges = memoryview(edges).cast("B")
        self.edge_mask = size - 1
        self.begin_edges()

    def bound_stack(self, first: int, last: int) -> None:
        """The stack may use internal RAM from `first` to `last`; all of it unless told. SP leaving it is a fault."""
        self.stack_floor = max(first - 1, 0)
        self.stack_end = (last + 1) & 0xFF

    def stack_said(self) -> str:
        """Where SP is and where the stack may be, for people."""
        last = (self.stack_end - 1) & 0xFF
        return f"SP {self.sp:02X}h, its stack is {self.stack_floor + 1:02X}h to {last:02X}h"

    def begin_edges(self) -> None:
        """No branch has been taken yet: after the core was put back to another moment."""
        self.edge_before = 0
        self.edge_depth = 0
        self.highest_sp = self.sp

    def count_edge(self, target: int) -> None:
        """A branch goes to `target`. The index is that of AFL: this place, and the one before shifted by a bit."""
        place = (self.at * _SPREAD_FROM + target * _SPREAD_TO) >> 3
        index = (place ^ self.edge_before) & self.edge_mask
        self.edge_before = (place & self.edge_mask) >> 1
        count = self.edges[index] + 1
        self.edges[index] = (count & 0xFF) + (count >> 8)

    def enter_edges(self) -> None:
        """An interrupt is taken: its branches do not follow those of the program that it interrupts."""
        if self.edge_depth < _DEPTH:
            self.edge_outer[self.edge_depth] = self.edge_before
        self.edge_depth += 1
        self.edge_before = 0

    def leave_edges(self) -> None:
        """The routine is over: what comes next follows the branch before it."""
        if self.edge_depth:
            self.edge_depth -= 1
            if self.edge_depth < _DEPTH:
                self.edge_before = self.edge_outer[self.edge_depth]

    def line_at(self, address: int) -> int:
        """Row and cycles of the opcode at `address` and, in the upper half, the address after its instruction."""
        line = self.line_of[self.rom[address]]
        return line & 0x07FF | ((address + (line >> 13)) & 0xFFFF) << 16

    # Hooks: what `Cpu` adds to the bare instructions

    def begin_run(self) -> None:
        """Before the first instruction of a run: what the outside may have changed meanwhile."""

    def end_run(self) -> None:
        """After the last instruction of a run."""

    def boundary(self) -> int:
        """`cycles` reached `limit`, which is 0 at first: 1 ends the run, else set it."""
        self.limit = self.until
        return 1 if self.cycles >= self.until else 0

    def end_of_interrupt(self) -> None:
        """RETI was executed."""

    def read_sfr(self, address: int) -> int:
        """Direct 80..FF in cycle `start`, ports at their pins."""
        return 0

    def read_latch(self, address: int) -> int:
        """Direct 80..FF for read-modify-write."""
        return 0

    def write_sfr(self, address: int, value: int) -> None:
        """Direct 80..FF at the end of the instruction."""

    def write_sfr_bit(self, address: int, mask: int, level: int) -> None:
        """One bit of direct 80..FF at the end of the instruction."""

    def page(self) -> int:
        """High address byte of MOVX @Ri, in place."""
        return 0

    def movx_read(self, address: int) -> int:
        """Byte from the external data bus."""
        return 0xFF

    def movx_write(self, address: int, value: int) -> None:
        """Byte to the external data bus."""
