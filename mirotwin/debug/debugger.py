"""Debugs a timeline in both directions: breakpoints, steps by line and by instruction, search for the last writer.

A step by line stops where another C line begins. A search runs at full speed from mark to mark; a frame is identified
by SP and the static height of the instruction, so calls and interrupts in between cost little.
"""

from __future__ import annotations

import bisect
from array import array
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image.symbol_files import SourceLine
from miro_robot.inspect.frames import StackFrame
from miro_robot.inspect.writes import Bytes
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH, SFRS, byte_of_bit, is_call
from miro_sim.world.conditions import Condition, When
from mirotwin.debug.expression import NoValue, Term, Value, expression, number
from mirotwin.debug.symbols import SIZES, Moment, Symbols
from mirotwin.debug.timeline import Core, Hit, Position, Timeline, Trap

BEGINS, INTERRUPTED, STEPPED = "the run begins here", "interrupted", "step"
_BY_THE_WAY = {SFRS[name] for name in ("ACC", "B", "DPL", "DPH", "PSW")}
ACCESSES = {"write": "is written", "read": "is read", "readWrite": "is read or written"}
_FLAGS = 0xC5  # of PSW: CY, AC, OV, P
_COUNTS: dict[str, Callable[[int, int], bool]] = {
    "": int.__eq__, "=": int.__eq__, "==": int.__eq__, ">": int.__gt__, ">=": int.__ge__, "<": int.__lt__,
    "<=": int.__le__, "%": lambda index, every: index % every == 0,
}  # fmt: skip


class Breakpoint(msgspec.Struct, eq=False):
    """Stops, or with `log` tells something, before an instruction at one of `addresses`: where `condition` is true,
    `watched` is accessed as `access` says, and `count` fits how often that was so since the run began.

    `text`: as it was entered; `note`: a remark on its place; `kind`: an editor's, which it sets together.
    `once`: it is removed where it stops.
    `hits`: those that are counted, up to `counted_to`; each a number that grows with its cycle and its processor.
    """

    number: int
    text: str
    addresses: Collection[int]
    condition: Term | None = None
    count: Callable[[int], bool] | None = None
    watched: Bytes | None = None
    access: str = "write"
    note: str = ""
    kind: str = ""
    log: Callable[[Moment], str] | None = None
    hits: array[int] = msgspec.field(default_factory=lambda: array("q"))
    counted_to: int = 0
    once: bool = False


class LogOutput(NamedTuple):
    """Text of a log, with its cycle, processor and address."""

    cycle: int
    core: int
    text: str
    address: int


class _Line(NamedTuple):
    """A C line that is under way in the frame at `base`; `entered`: at the first instruction of its function."""

    base: int
    line: SourceLine | None
    level: int
    entered: bool


class Debugger:
    """The debugger of one run. `everyone`: breakpoints are for all processors, else for the one in focus.

    `fault_kinds`: firmware faults at which it stops although the run continues past them. `changed`: set by the caller
    that changes breakpoints during a search, which then uses them. The reason of a stop is returned as a text:
    "breakpoint 1", "step", "the run ends here".
    """

    def __init__(self, timeline: Timeline, symbols: Symbols, everyone: bool = False) -> None:
        self.timeline = timeline
        self.symbols = symbols
        self.everyone = everyone
        self.breakpoints: list[Breakpoint] = []
        self.log_outputs: list[LogOutput] = []
        self.changed = False
        self.fault_kinds: set[FaultKind] = set()
        self._numbers = 0
        self._reported_there: list[LogOutput] = []
        self._stopped_at: Position = (-1, 0)

    def number_from(self, number: int) -> None:
        """Later breakpoints have higher numbers than this."""
        self._numbers = max(self._numbers, number)

    # Where it stands

    @property
    def cpu(self) -> Cpu:
        return self.timeline.core.cpu

    def frames(self) -> list[StackFrame]:
        return self.symbols.unwinder.frames(self.cpu)

    def moment(self, frame: int = 0) -> Moment:
        return Moment(self.symbols, self.timeline.core, frame)

    # Breakpoints

    def add(self, place: str, condition: str = "", count: str = "") -> Breakpoint:
        """A breakpoint at FILE:LINE, a symbol or an address. Raises BadInput."""
        addresses, line = self.symbols.at(place)
        note = ""
        if line is not None and ":" in place and not place.endswith(f":{line.line}"):
            note = f"{place} has no code: the next line that has some"
        elif not self.symbols.instructions.issuperset(addresses):
            note = "no instruction is known to begin there"
        return self._added(place, addresses, condition, count, note=note)

    def _refuse_unknown(self, condition: str, addresses: Collection[int]) -> None:
        """Raises NoValue for a condition that has no value at any of the addresses: it would never be true."""
        for count, address in enumerate(addresses, 1):
            try:
                return self.moment().refuse(condition, address)
            except NoValue:
                if count == len(addresses):
                    raise

    def watch(
        self,
        text: str,
        condition: str = "",
        count: str = "",
        watched: Bytes | None = None,
        access: str = "write",
    ) -> Breakpoint:
        """A data breakpoint: before an instruction that accesses `watched`, or what `text` means. Raises BadInput."""
        watched = watched or self.bytes_of(text, read=access != "write")
        addresses = set[int]()
        if access != "read":
            addresses |= set(self._writers(watched))
        if access != "write":
            addresses |= set(self._readers(watched))
        verb = {"write": "watch", "read": "rwatch", "readWrite": "awatch"}[access]
        return self._added(f"{verb} {text}", addresses, condition, count, watched=watched, access=access)

    def _added(
        self, text: str, addresses: Collection[int], condition: str, count: str, **more: Any
    ) -> Breakpoint:
        term = expression(condition, self.symbols.known) if condition else None
        if not more.get("watched"):
            # What accesses a watched place lies anywhere: in some of these functions the names are unknown.
            self._refuse_unknown(condition, addresses)
        counts = _counting(count) if count else None
        self._numbers += 1
        whole = f"{text} if {condition}" if condition else text
        self.breakpoints.append(Breakpoint(self._numbers, whole, frozenset(addresses), term, counts, **more))
        return self.breakpoints[-1]

    def bytes_of(self, text: str, place: Value | None = None, read: bool = False) -> Bytes:
        """Addresses of the value of `text`.

        Raises NoValue for a value outside of writable memory (readable memory with `read`).
        """
        value = place or expression(text)(self.moment())
        space, address, size = value.space, value.address, value.kind.size if value.kind else 0
        mask = -1
        if value.kind is not None and value.kind.kind == "bits":
            mask = (1 << value.kind.bits) - 1 << value.kind.first_bit
        if space == "bit":
            mask = 1 << (address & 7)
            space, address = "sfr" if address >= 0x80 else "iram", byte_of_bit(address)
        memories = ("iram", "sfr", "xram", *(("code",) if read else ()))
        if not size or space not in memories or not 0 <= address <= SIZES[space] - size:
            raise NoValue(
                f"{text} lies in no memory that can be watched", "name a variable: `print` says what it is"
            )
        if space == "sfr" and address in _BY_THE_WAY and (address != SFRS["PSW"] or mask & _FLAGS):
            raise NoValue(f"{text} changes with nearly every instruction", "watch a variable")
        return Bytes(space, address, size, mask)

    def _writers(self, written: Bytes) -> Collection[int]:
        """Addresses of instructions that may write it.

        Pushes outside of the stack are firmware faults, and not searched.
        """
        if self.timeline.code_in_ram:
            return self.timeline.everywhere
        on_stack = self._is_on_stack(written)
        writers = written.writers(self.symbols.image.code, self.symbols.instructions, on_stack)
        pushed = on_stack or (written.space, written.first) == ("sfr", SFRS["SP"])
        # The hardware's LCALL writes without an instruction: it is seen at the first one of the routine.
        return writers | self.symbols.unwinder.vectors if pushed else writers

    def _readers(self, read: Bytes) -> Collection[int]:
        """Addresses of instructions that may read it."""
        if self.timeline.code_in_ram:
            return self.timeline.everywhere
        return read.readers(self.symbols.image.code, self.symbols.instructions, self._is_on_stack(read))

    def _is_on_stack(self, place: Bytes) -> bool:
        first, last = self.symbols.image.symbols.stack
        return place.space == "iram" and place.first <= last and place.end > first

    def _writes(self, written: Bytes, cpu: Cpu) -> bool:
        """True if the next instruction writes it, or the hardware's call of a routine has just done."""
        return self._pushed(written, cpu) or written.are_written(cpu)

    def _pushed(self, written: Bytes, cpu: Cpu) -> bool:
        """True if the hardware has just called a routine, and the return address that it pushed lies there."""
        entered = cpu.pc in self.symbols.unwinder.vectors and cpu.peripherals.interrupts.in_service
        if written.space == "sfr":
            return bool(entered) and written.first == SFRS["SP"]
        on_stack = any(written.first <= cpu.sp - at < written.end for at in (0, 1))
        return bool(entered) and written.space == "iram" and on_stack

    def _accesses(self, breakpoint: Breakpoint, cpu: Cpu) -> bool:
        watched, access = breakpoint.watched, breakpoint.access
        if watched is None:
            return True
        read = access != "write" and watched.are_read(cpu)
        return read or (access != "read" and self._writes(watched, cpu))

    def _traps(self, step: Trap | None = None) -> dict[int, Trap]:
        """The traps of a search: the breakpoints, and `step` for the processor in focus."""
        places = frozenset[int]().union(*(breakpoint.addresses for breakpoint in self.breakpoints))

        def ask(core: Core) -> object:
            pc = core.cpu.pc
            stops = [
                breakpoint
                for breakpoint in self.breakpoints
                if pc in breakpoint.addresses and self._stops(breakpoint, core)
            ]
            if stops:
                # All were asked, not only the first: each counts its hits and writes its log.
                return stops[0]
            if step is not None and core is self.timeline.core and pc in step.addresses:
                return step.ask(core)
            return None

        cores = range(len(self.timeline.cores)) if self.everyone else [self.timeline.focus]
        traps = {at: Trap(places, ask) for at in cores}
        if step is not None:
            traps[self.timeline.focus] = Trap(places.union(step.addresses), ask)
        return traps

    def _is_met(self, breakpoint: Breakpoint, core: Core) -> bool:
        if not self._accesses(breakpoint, core.cpu):
            return False
        if breakpoint.condition is None:
            return True
        with suppress(BadInput):  # where it has no value, it is not true
            return bool(number(breakpoint.condition(Moment(self.symbols, core))))
        return False

    def _stops(self, breakpoint: Breakpoint, core: Core) -> bool:
        if not self._is_met(breakpoint, core):
            return False
        position = (core.cpu.cycles, self.timeline.cores.index(core))
        if breakpoint.count is not None:
            hit = self._numbered(position)
            # A search passes a stretch twice, looking and landing: the second time is no new hit.
            if not breakpoint.hits or hit > breakpoint.hits[-1]:
                breakpoint.hits.append(hit)
            # By its place in time, not by how many were seen: going back, the fifth hit is still the fifth.
            if not breakpoint.count(bisect.bisect_left(breakpoint.hits, hit) + 1):
                return False
        if breakpoint.log is not None:
            self.log_outputs.append(
                LogOutput(*position, breakpoint.log(Moment(self.symbols, core)), core.cpu.pc)
            )
        return breakpoint.log is None

    def _count_hits(self) -> bool:
        """Counts the hits from the start of the run up to now, if a breakpoint needs their number.

        False if interrupted.
        """
        for point in self.breakpoints:
            if point.count is not None and point.counted_to < self.timeline.tick:
                ask = Trap(point.addresses, lambda core, point=point: self._is_met(point, core) or None)  # type: ignore[misc]
                with self.timeline.staying():
                    positions = self.timeline.hits_back(dict.fromkeys(self._traps(), ask))
                    hits = array("q", (self._numbered(hit[:2]) for hit in positions))
                    whole = self.timeline.at_begin
                if not whole:
                    return False
                # Found latest first; `_stops` looks hits up in the order of time.
                point.hits, point.counted_to = hits[::-1], self.timeline.tick
        return True

    def _numbered(self, position: Position) -> int:
        """Eight bytes for each of millions of hits."""
        return position[0] * len(self.timeline.cores) + position[1]

    # Moving

    def move(self, verb: str, by_instruction: bool = False) -> str:
        """`continue`, `step`, `next`, `finish` or `stepi`; with an `r` before it backwards. Raises BadInput.

        `until` is `next` which goes on to a later line.

        Steps are lines, or instructions where that is asked for or the image has no lines.
        """
        back, name = verb[0] == "r", verb.removeprefix("r")
        if name == "continue":
            return self._back() if back else self._forward()
        if name == "finish":
            return self._out_back() if back else self._out()
        over = name in ("next", "until")
        if by_instruction or name == "stepi" or not self.symbols.line_begins:
            return self._instruction_back(over) if back else self._instruction(over)
        return self._line_back(over) if back else self._line(over, later=name == "until")

    def run_to(self, addresses: Collection[int]) -> str:
        """On to one of these places, or to a breakpoint before it."""
        return self._forward(Trap(addresses, lambda core: True))

    def go_to(self, tick: int) -> str:
        """Goes to a tick, or to the first moment of the processor after it. A long search can be interrupted."""
        reached = self.timeline.go_to(tick, self.timeline.interrupted)
        return self._at_end() or ("goto" if reached else INTERRUPTED)

    def until(self, condition: Condition) -> str:
        """Runs to an event; returns its text."""
        event = self.timeline.until(condition)
        if event is not None:
            text = str(event)
            if self.timeline.core.robot is not None:
                return text
            tick, _, text = text.split(": ", 2)  # a board alone is the only place
            return f"{tick}: {text}"
        return "no such event before the end" if self.timeline.run.over else INTERRUPTED

    def until_true(self, text: str) -> str:
        """On to the first instruction before which an expression is true, which is looked at every millisecond.

        Raises BadInput where it has no value now.
        """
        term, core = expression(text, self.symbols.known), self.timeline.core

        def is_true() -> bool:
            return bool(number(term(Moment(self.symbols, core))))

        def met(device: Any) -> bool:
            with suppress(BadInput):  # where it has no value, it is not true
                return is_true()
            return False

        if is_true():
            return f"{text} is true here"
        network, slot, begin_tick = core.device.network, core.device.slot, self.timeline.tick
        # First each millisecond: asking before each instruction of a whole run takes minutes.
        if self.timeline.until(When(predicate=met, network=network, slot=slot)) is not None:
            millisecond = self.timeline.run.tick_hz // 1000
            self.timeline.go_to(max(begin_tick, self.timeline.tick - millisecond - 1))
            self.timeline.until(When(predicate=met, network=network, slot=slot, at="instruction"))
            return f"{text} is true"
        return f"{text} is not true before the end" if self.timeline.run.over else INTERRUPTED

    def _search(
        self, seek: Callable[[Mapping[int, Trap], Position], Hit | None], step: Trap | None = None
    ) -> Hit | None:
        """Runs `seek` to the next stop."""
        here, interrupted = self.timeline.here, self.timeline.interrupted
        if step is not None and here[0] == self._stopped_at[0]:
            here = max(here, self._stopped_at)  # of another processor, in the same cycle
        # `changed`: an editor may set breakpoints while this runs; the search starts over with them.
        hit, self.changed = None, True
        with self.timeline.interrupted_by(
            lambda: interrupted() or self.changed or bool(self._fault_since(here))
        ):
            while hit is None and self.changed:
                self.changed = False
                if self._count_hits():
                    hit = seek(self._traps(step), here)
                    for breakpoint in self.breakpoints:
                        breakpoint.counted_to = max(breakpoint.counted_to, self.timeline.tick)
        if hit is not None and isinstance(hit.found, Breakpoint) and hit.found.once:
            self.breakpoints.remove(hit.found)
        return hit

    def _fault_since(self, here: Position) -> tuple[Position, FirmwareFault] | None:
        """The first of the faults that are stopped at, after this moment."""
        since = [
            ((-(-fault.tick // CYCLE_TICKS), index), fault)
            for index, core in enumerate(self.timeline.cores)
            for fault in (core.device.board.faults if self.fault_kinds else ())
            if fault.kind in self.fault_kinds
        ]
        return min((pair for pair in since if pair[0][0] > here[0]), default=None, key=lambda pair: pair[0])

    def _forward(self, step: Trap | None = None) -> str:
        self.log_outputs.clear()
        here, known = self.timeline.here, self._reported_there
        hit = self._search(self.timeline.find, step)
        # The logs at the place where it stood have been asked again, and were reported when it stopped there.
        outputs = sorted(output for output in self.log_outputs if output[:2] != here or output not in known)
        # Other processors ran on to the end of the piece: what they logged behind the hit comes again later.
        self.log_outputs = [output for output in outputs if hit is None or output[:2] <= hit[:2]]
        fault = self._fault_since(here)
        # The search ends after the piece in which the fault is: a breakpoint before it goes first.
        if fault is not None and (hit is None or fault[0] < hit[:2]):
            self.timeline.land(Hit(*fault[0], fault[1]))
            return f"firmware fault: {fault[1]}"
        if hit is None:
            return self._at_end() or INTERRUPTED
        self._reported_there = [output for output in self.log_outputs if output[:2] == hit[:2]]
        self._stopped_at = hit[:2]
        return _named(hit)

    def _back(self) -> str:
        hit = self._search(self.timeline.find_back)
        self.log_outputs.clear()
        return self._at_begin() if hit is None else _named(hit)

    def _at_begin(self) -> str:
        return BEGINS if self.timeline.at_begin else INTERRUPTED

    def _at_end(self) -> str:
        if not self.timeline.run.over:
            return ""
        boards = [core.device.board for core in self.timeline.cores]
        faults = [board.faults[-1] for board in boards if board.faults]
        return f"firmware fault: {faults[-1]}" if faults else "the run ends here"

    # By instruction

    def _instruction(self, over: bool) -> str:
        cpu, pc, sp = self.cpu, self.cpu.pc, self.cpu.sp
        if over and is_call(cpu.code_at(pc)):
            after = (pc + LENGTH[cpu.code_at(pc)]) & 0xFFFF
            # SP too: a function that calls itself comes back to this address from deeper calls first.
            return self._forward(Trap({after}, lambda core: core.cpu.sp == sp or None))
        slept = cpu.idle
        self.timeline.step()
        # An interrupt instead of the instruction: `next` passes over its routine as over a call.
        if over and cpu.sp == sp + 2 and self.frames()[0].by_interrupt:
            why = self._out()
            return why if slept or why != STEPPED else self._instruction(over)
        return self._at_end() or STEPPED

    def _instruction_back(self, over: bool) -> str:
        base = self.symbols.unwinder.base(self.cpu)
        while self.timeline.step_back():
            frames = self.frames()
            if not over or frames[0].base <= base or len(frames) < 2:
                return STEPPED
            self._out_back()
            if not frames[0].by_interrupt or self.cpu.idle:
                return STEPPED
        return BEGINS

    # Out of a function

    def _caller(self) -> tuple[StackFrame, StackFrame]:
        frames = self.frames()
        if len(frames) < 2:
            reason = "nothing called this function" if frames[0].known else "the stack cannot be told here"
            raise BadInput("", "finish", reason, "step by instruction, or go to a place: `break`, `continue`")
        return frames[0], frames[1]

    def _out(self) -> str:
        inner, outer = self._caller()
        # The return address is off the stack then; of a recursion only this call has that SP.
        return self._forward(Trap({outer.pc}, lambda core: core.cpu.sp == inner.base - 2 or None))

    def _out_back(self) -> str:
        """To the call, or to where the interrupt came."""
        inner, _ = self._caller()
        # At its first instruction already, a search back would find the call before this one.
        if self.cpu.pc != inner.entry or self.cpu.sp != inner.base:
            entered = Trap({inner.entry}, lambda core: core.cpu.sp == inner.base or None)
            if self.timeline.find_back({self.timeline.focus: entered}) is None:
                return self._at_begin()
        self.timeline.step_back()
        return STEPPED

    # By line

    def _line_of(self, cpu: Cpu) -> _Line:
        level = cpu.peripherals.interrupts.in_service
        begins = cpu.pc == self.symbols.entry(cpu.pc)
        return _Line(self.symbols.unwinder.base(cpu), self.symbols.line(cpu.pc), level, begins)

    def _line(self, over: bool, later: bool = False) -> str:
        """Runs to the begin of another line, of this function, of its caller, or (not `over`) of a called function.

        `later`: of this function only one that stands further down.
        Code without lines is passed to the next line, from before `main` wherever that is.
        """
        here = around = self._line_of(self.cpu)
        over = over and here.line is not None
        begins, returns = self.symbols.line_begins, {frame.pc for frame in self.frames()[1:]}

        def ask(core: Core) -> object:
            nonlocal around
            there = self._line_of(core.cpu)
            # An interrupt, or a call, came in between: its lines are not those that one steps through.
            if there.level > around.level or (over and there.base > around.base):
                return None
            if there.base < around.base:
                around = there  # it returned
            if later and there.base == here.base and here.line is not None and there.line is not None:
                return there if core.cpu.pc in begins and there.line.line > here.line.line else None
            return there if core.cpu.pc in begins and there[:2] != here[:2] else None

        return self._forward(Trap(returns.union(begins), ask))

    def _line_back(self, over: bool) -> str:
        """Back to where a line began: this one if some of it was executed, else the one before.

        Going back past the entry of a function leaves it: from there on only its callers are looked at.
        """
        trap = Trap(self.symbols.line_begins, lambda core: self._line_of(core.cpu))
        here = self._line_of(self.cpu)
        outermost, level = here.base, here.level
        if here.entered:
            inner, *callers = self.frames()
            outermost = callers[0].base if callers else here.base - 1
            level &= level >> 1 if inner.by_interrupt else level  # of what was interrupted
        begin: Hit | None = None
        line: _Line | None = None
        for hit in self.timeline.hits_back({self.timeline.focus: trap}):
            there = hit.found
            assert isinstance(there, _Line)
            if there.level > level or (over and there.base > outermost):
                continue
            if line is not None and there[:2] != line[:2]:
                break
            begin, line = hit, there
            if there.entered:
                break
            # Once it is out of a function, that function's earlier calls are not entered again.
            outermost = min(outermost, there.base)
        if begin is None:
            return self._at_begin()
        self.timeline.land(begin)
        return STEPPED

    # The last writer

    def last_writer(self, written: Bytes) -> tuple[int, list[StackFrame]] | None:
        """(tick, frames) before the instruction that wrote some bytes last; it stays where it is."""
        trap = Trap(self._writers(written), lambda core: self._writes(written, core.cpu) or None)
        with self.timeline.staying():
            pushed = self._pushed(written, self.cpu)
            if not pushed and self.timeline.find_back({self.timeline.focus: trap}) is None:
                if self._at_begin() == INTERRUPTED:
                    raise BadInput("", "who", "was interrupted before a writer was found")
                return None
            if pushed or not written.are_written(self.cpu):
                self.timeline.step_back()  # the hardware's call of a routine wrote it
            return self.timeline.tick, self.frames()


def _named(hit: Hit) -> str:
    return f"breakpoint {hit.found.number}" if isinstance(hit.found, Breakpoint) else STEPPED


def _counting(text: str) -> Callable[[int], bool]:
    """`5`: the fifth; `>= 5`: from it on; `% 5`: every fifth. Raises BadInput."""
    digits = text.strip().lstrip("<>=% ")
    sign = text.strip().removesuffix(digits).strip()
    if sign not in _COUNTS or not digits.isdecimal() or not int(digits[:9]) > 0:
        raise BadInput("", text, "is no count of hits", "give 5, >= 5 or % 5")
    return lambda index: _COUNTS[sign](index, int(digits[:9]))
