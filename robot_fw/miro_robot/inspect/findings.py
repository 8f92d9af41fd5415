"""The sanitizer's observations as sentences about C: place, variable, and the interrupting line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import PureWindowsPath as AnyPath

import msgspec

from miro_robot.image import Image
from miro_robot.inspect import sanitizer
from miro_robot.inspect.read_again import read_again
from miro_robot.inspect.sanitizer import CHECKED, LOST, SHARED, TORN_READ, TORN_WRITE, Sanitizer
from miro_robot.inspect.sanitizer_layout import XRAM, Layout
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.opcodes import INTERRUPTS

KINDS = {
    "race": "a variable that an interrupt may change between two halves, or whose change it may undo",
    "overlay": "parameters, local and overlaid variables in use at two levels at once",
    "registers": "a routine that returns with registers or the bank changed",
    "return": "RET and RETI in each other's place, return addresses overwritten, bytes too many or too few",
    "stack": "bytes that stay on the stack in each turn of the main loop",
    "uart": "characters cut off or never read",
    "timer": "the halves of a running timer read apart",
    "memory": "MOVX where there is no RAM or nothing was written, MOVC outside of the image, const written",
}
"""Kinds of findings, and what they are."""
_SAYS = {
    TORN_READ: "reads {name} in pieces in {function}",
    TORN_WRITE: "writes {name} in pieces in {function}",
    LOST: "loads {name}, changes and stores it in {function}",
    CHECKED: "looks at {name}, then takes one away in {function}",
    SHARED: "stores {name} for {function}",
}
_NOTES = {
    sanitizer.REGISTERS: ("registers", "returns with {which} changed"),
    sanitizer.RET_OF_INTERRUPT: (
        "return",
        "leaves the {source} interrupt by RET: no other one of its level comes",
    ),
    sanitizer.RETI_OF_CALL: ("return", "leaves a function by RETI: its interrupt counts as over"),
    sanitizer.OVERWRITTEN: ("return", "returns elsewhere: the return address is overwritten"),
    sanitizer.UNBALANCED: ("return", "returns with a byte too many or too few on the stack"),
    sanitizer.LEAK: ("stack", "leaves bytes on the stack in each turn"),
    sanitizer.CUT_OFF: ("uart", "writes SBUF while a character goes out"),
    sanitizer.UNREAD: ("uart", "clears RI, and SBUF is not read before the next character"),
    sanitizer.OVERRUN: ("uart", "loses a character: the one before was still waiting"),
    sanitizer.TIMER: ("timer", "reads the halves of timer {number} apart: the low one may overflow between"),
    sanitizer.NO_RAM: ("memory", "reaches for {address}, where there is no RAM"),
    sanitizer.NO_CODE: ("memory", "reads code at {address}, outside of the image"),
    sanitizer.CONST: ("memory", "writes through a pointer to code"),
    sanitizer.UNWRITTEN: ("memory", "reads external RAM at {address}, which nothing wrote"),
}
_DEAF = {
    sanitizer.UNREAD: "clears RI, and never reads SBUF",
    sanitizer.OVERRUN: "never reads SBUF, where characters come",
}
_REGISTERS = (*(f"R{number}" for number in range(8)), "A", "B", "DPTR", "CY", "the bank")


class Finding(msgspec.Struct, frozen=True, order=True):
    """`did`: it happened at `tick`, else it may, for the first time there. `place`: `robot.c:77`, an address; `other`:
    the other side, "" without one; `variable`: "" without one. `pc`, `other_pc`: their instructions, -1 for none;
    `source`: the interrupt of the other side, -1 without one. `network`, `slot`: of the robot; -1: the network's first.
    """

    kind: str
    place: str
    variable: str
    did: bool
    tick: int
    says: str
    function: str
    other: str = ""
    pc: int = -1
    other_pc: int = -1
    source: int = -1
    network: int = 0
    slot: int = -1

    @property
    def cause(self) -> tuple[str, ...]:
        """Findings with this key have the same cause: for shared bytes, the users and the interrupting routine."""
        if self.kind == "overlay":
            return (self.kind, self.function, f"{self.source}")
        return (self.kind, self.place, self.variable)

    @property
    def key(self) -> str:
        """The beginning of an allow line for this finding."""
        return " ".join(filter(None, (self.kind, self.place, self.variable)))

    def __str__(self) -> str:
        word = "did" if self.did else "may"
        return f"{word} {self.kind}  {self.place} {self.says}" + (f"; {self.other}" if self.other else "")


class Reader:
    """Makes findings of what sanitizers of one image saw."""

    def __init__(self, image: Image, layout: Layout) -> None:
        self.names = SymbolNames(image)
        self.layout = layout
        self.code = image.code

    def findings(self, seen: Sanitizer) -> list[Finding]:
        """One finding for each cause; observed ones have precedence over possible ones."""
        best: dict[tuple[str, ...], Finding] = {}
        for finding in sorted(self._all(seen), key=lambda finding: (not finding.did, finding.tick, finding)):
            best.setdefault(finding.cause, finding)
        return sorted(best.values(), key=lambda finding: (not finding.did, finding))

    def _all(self, seen: Sanitizer) -> Iterator[Finding]:
        again = self._read_again(seen)
        for (kind, first, second), (tick, between, key) in seen.events.items():
            if kind == TORN_READ and any(first in loop and second in loop for loop in again[key]):
                continue
            yield self._race((kind, first, second), key, between & 0xFFFF, tick, between >> 16, did=True)
        for pair, (key, sources_open, tick) in seen.pairs.items():
            if pair[0] == LOST and key in self.layout.elements:
                continue  # a buffer is handed over by a flag, which nobody sees
            if pair[0] == TORN_READ and any(pair[1] in loop and pair[2] in loop for loop in again[key]):
                continue
            touches: Iterable[Callable[[int, int], int]]
            touches = {TORN_WRITE: (seen.writer, seen.reader), CHECKED: (seen.zeroer,)}.get(
                pair[0], (seen.writer,)
            )
            for source in range(len(INTERRUPTS)):
                between = next((at for touch in touches if (at := touch(source, key)) >= 0), -1)
                if sources_open >> source & 1 and between >= 0:
                    yield self._race(pair, key, between, tick, source)

        grouped: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
        for (mistake, pc, other, which), tick in seen.notes.items():
            grouped.setdefault((mistake, pc), []).append((tick, other, which))
        for (mistake, pc), each in grouped.items():
            yield self._mistake(mistake, pc, each, not seen.reads_sbuf)

    def _read_again(self, seen: Sanitizer) -> dict[int, list[range]]:
        """By variable: the loops that read it until two values are equal."""
        torn = {(first, both[0]) for (kind, first, _), both in seen.pairs.items() if kind == TORN_READ}
        torn |= {(first, key) for (kind, first, _), (_, _, key) in seen.events.items() if kind == TORN_READ}
        sizes = Counter(key for _, key in self.layout.places.values())
        loops: dict[int, list[range]] = {key: [] for _, key in sorted(torn)}
        for first, key in sorted(torn):
            bytes_of_it = range(key, key + sizes[key])
            loops[key] += [read_again(self.code, first, bytes_of_it, bank) for bank in (0, 8, 16, 24)]
        return loops

    def _mistake(self, mistake: int, pc: int, each: list[tuple[int, int, int]], deaf: bool) -> Finding:
        """`each`: (tick, the other instruction, which one) of the times that differ; `deaf`: nothing reads SBUF."""
        (kind, says), (tick, other, which) = _NOTES[mistake], min(each)
        says = _DEAF.get(mistake, says) if deaf else says
        changed = [
            name for number, name in enumerate(_REGISTERS) if number in {register for _, _, register in each}
        ]
        words = says.format(
            which=", ".join(changed),
            source=INTERRUPTS[which % len(INTERRUPTS)],
            number=which,
            address=f"{which:04X}h",
        )
        return Finding(
            kind, self.place(pc), "", mistake != sanitizer.TIMER, tick,
            f"{words}, in {self.function(pc)}", self.function(pc),
            "" if other < 0 else f"{self.place(other)} in {self.function(other)} goes with it", pc, other,
        )  # fmt: skip

    def _race(
        self, pair: tuple[int, int, int], key: int, between: int, tick: int, source: int, did: bool = False
    ) -> Finding:
        kind, first, second = pair
        function = self.function(second)
        name = self._variable(key, function)
        return Finding(
            "overlay" if kind == SHARED else "race", self.place(first), name, did, tick,
            _SAYS[kind].format(name=name, function=function), function,
            f"{self.place(between)} in {self.function(between)} ({INTERRUPTS[source]} interrupt) comes between",
            first, between, source,
        )  # fmt: skip

    def _variable(self, key: int, function: str) -> str:
        known = self.layout.local_names.get((key, function)) or self.layout.names.get(key)
        return known or (f"byte {key:02X}h" if key < XRAM else f"external byte {key - XRAM:04X}h")

    def function(self, address: int) -> str:
        return self.names.function(address)[1].removeprefix("_")

    def place(self, address: int) -> str:
        line = self.layout.debug.line_at(address)
        return f"{address:#06x}" if line is None else f"{AnyPath(line.file).name}:{line.line}"
