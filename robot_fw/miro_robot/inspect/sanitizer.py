"""Watches what firmware does without noticing: variables that an interrupt may change between two halves.

    main       MOV A,stamp        MOV B,stamp+1         a pair of accesses, of one C line
                          ^ IE lets a routine in here that writes `stamp`, now or at another time: may be torn
Steps are counted over all levels; `level` is 0 in main, 1 and 2 in routines of low and high priority. A place is an
address of internal RAM, or 256 + one of external RAM. What follows for C is in `findings.py`.
"""

from __future__ import annotations

from miro_robot.inspect.sanitizer_layout import CONSTANT, LOCAL, READS, SCALAR, WRITES, Layout
from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu

_PLACES = 65792
_XRAM = 256
_SCALAR, _LOCAL = SCALAR, LOCAL
_FIRST, _SECOND, _INDIRECT, _DPTR, _PAGE = 1, 2, 3, 4, 5  # see `FORMS`
_SFRS, _EA = 0x80, 0x80
TORN_READ, TORN_WRITE, LOST, SHARED = 1, 2, 3, 4
_TORN_READ, _TORN_WRITE, _LOST, _SHARED = TORN_READ, TORN_WRITE, LOST, SHARED


class Sanitizer(Watcher):
    """Of one CPU. `pairs`: (kind, first instruction, second) -> [place, sources that
    could come between, tick of the second].

    `events`: the same key -> (tick, source << 16 | the instruction that came between, its place) of the first time.
    """

    def __init__(self, layout: Layout) -> None:
        self.reads = READS
        self.writes = WRITES
        self.constant = CONSTANT  # by opcode
        self.line_of = [0] * 65536
        self.kind_of = [0] * 65792
        self.key_of = [0] * 65792
        self.readers = [0] * 394752  # by source and key: 1 + where its routine first did
        self.writers = [0] * 394752
        self.read_step = [0] * 197376  # by level and key: when it last did
        self.write_step = [0] * 197376
        self.read_pc = [0] * 197376
        self.write_pc = [0] * 197376
        self.read_seen = [0] * 197376  # bytes of the variable that this access has had
        self.write_seen = [0] * 197376
        self.line = [0] * 3
        self.began = [0] * 3  # step at which the level came to its line
        self.serving = [0] * 3
        self.last_open = [0] * 6
        self.known_pair = [0] * 65536
        self.known_open = [0] * 65536
        self.step = 0
        self.closed = 0
        self.level = 0
        self.open = 0
        self.priorities = -1
        self.tick = 0
        self.pairs: dict[tuple[int, int, int], list[int]] = {}
        self.events: dict[tuple[int, int, int], tuple[int, int, int]] = {}
        for address, line in layout.lines.items():
            self.line_of[address] = line
        for place, (kind, key) in layout.places.items():
            self.kind_of[place] = kind
            self.key_of[place] = key

    def attached(self, cpu: Cpu) -> None:
        self.interrupts = cpu.peripherals.interrupts
        self._look(cpu)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        self.step += 1
        opcode = cpu.rom[pc]
        line = self.line_of[pc]
        if line != self.line[self.level]:
            self.line[self.level] = line
            self.began[self.level] = self.step
        form = self.reads[opcode]
        if form:
            place = self._place(cpu, form, pc, opcode)
            if place >= 0 and self.kind_of[place]:
                self.tick = 12 * start
                self._read(place, pc)
        form = self.writes[opcode]
        if form:
            place = self._place(cpu, form, pc, opcode)
            if place >= 0 and self.kind_of[place]:
                self.tick = 12 * start
                self._write(place, pc, self.constant[opcode])
        self._look(cpu)

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        self.step += 1
        self._look(cpu)
        self.serving[self.level] = source
        self.line[self.level] = -1

    def _place(self, cpu: Cpu, form: int, pc: int, opcode: int) -> int:
        """Of an operand, after its instruction; -1 for a register of the chip."""
        if form == _INDIRECT:
            return cpu.iram[cpu.bank + (opcode & 1)]
        if form == _DPTR:
            return _XRAM + cpu.dptr
        if form == _PAGE:
            return _XRAM + (cpu.page() << 8 | cpu.iram[cpu.bank + (opcode & 1)])
        direct = cpu.rom[pc + form]
        return direct if direct < _SFRS else -1

    def _read(self, place: int, pc: int) -> None:
        level = self.level
        key = self.key_of[place]
        at = level * _PLACES + key
        if level and not self.readers[self.serving[level] * _PLACES + key]:
            self.readers[self.serving[level] * _PLACES + key] = pc + 1
        if self.kind_of[place] == _LOCAL:
            if self.write_step[at]:
                self._pair(_SHARED, self.write_pc[at], pc, self.write_step[at], key)
        else:
            bit = 1 << (place - key)
            seen = self.read_seen[at]
            if seen & bit or self.read_step[at] < self.began[level]:  # a new access to it
                seen = 0
            if seen:
                self._pair(_TORN_READ, self.read_pc[at], pc, self.read_step[at], key)
            self.read_seen[at] = seen | bit
        self.read_step[at] = self.step
        self.read_pc[at] = self.serving[level] << 16 | pc

    def _write(self, place: int, pc: int, constant: int) -> None:
        """`constant`: what is written does not depend on what was read by another instruction."""
        level = self.level
        key = self.key_of[place]
        at = level * _PLACES + key
        if level and not self.writers[self.serving[level] * _PLACES + key]:
            self.writers[self.serving[level] * _PLACES + key] = pc + 1
        if self.kind_of[place] == _SCALAR:
            bit = 1 << (place - key)
            seen = self.write_seen[at]
            if seen & bit or self.write_step[at] < self.began[level]:
                seen = 0
            if seen:
                self._pair(_TORN_WRITE, self.write_pc[at], pc, self.write_step[at], key)
            self.write_seen[at] = seen | bit
            if not constant and self.read_seen[at] & bit and self.read_step[at] >= self.began[level]:
                self._pair(_LOST, self.read_pc[at], pc, self.read_step[at], key)
        self.write_step[at] = self.step
        self.write_pc[at] = self.serving[level] << 16 | pc

    def _pair(self, kind: int, first: int, pc: int, since: int, key: int) -> None:
        """The instructions at `first`, in step `since`, and at `pc`, now, belong together."""
        first &= 0xFFFF
        for higher in range(self.level + 1, 3):
            at = higher * _PLACES + key
            if self.write_step[at] > since:
                self.events.setdefault((kind, first, pc), (self.tick, self.write_pc[at], key))
            elif kind == _TORN_WRITE and self.read_step[at] > since:
                self.events.setdefault((kind, first, pc), (self.tick, self.read_pc[at], key))
        sources = self.open
        if self.closed >= since:
            for source in range(6):
                if self.last_open[source] >= since:
                    sources |= 1 << source
        if sources and (self.known_pair[pc] != kind << 16 | first or sources & ~self.known_open[pc]):
            self.known_pair[pc] = kind << 16 | first
            self.known_open[pc] = sources
            known = self.pairs.setdefault((kind, first, pc), [key, 0, self.tick])
            known[1] |= sources

    def _look(self, cpu: Cpu) -> None:
        """Which sources may interrupt before the next instruction, and at which level that is."""
        interrupts = self.interrupts
        priorities = interrupts.in_service << 16 | interrupts.ip << 8 | interrupts.ie
        blocked = cpu.blocked == cpu.cycles
        if priorities == self.priorities and not blocked:
            return
        self.priorities = -1 if blocked else priorities
        self.level = min(interrupts.in_service, 2)
        open_now = 0
        if interrupts.ie & _EA and self.level < 2 and not blocked:
            open_now = interrupts.ie & 0x3F
            if self.level:
                open_now &= interrupts.ip
        if self.open & ~open_now:
            self.closed = self.step - 1
            for source in range(6):
                if self.open >> source & 1 and not open_now >> source & 1:
                    self.last_open[source] = self.step - 1
        self.open = open_now

    def reader(self, source: int, key: int) -> int:
        """Where the routine of `source` first read it; -1 if it never did."""
        return self.readers[source * _PLACES + key] - 1

    def writer(self, source: int, key: int) -> int:
        """Where the routine of `source` first wrote it; -1 if it never did."""
        return self.writers[source * _PLACES + key] - 1
