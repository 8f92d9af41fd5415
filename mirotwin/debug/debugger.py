"""What a debugger does with a timeline: breakpoints, steps by line and by instruction, the last writer; both ways.

A step by line stops where the C line of its function becomes another one. A search runs at full speed from mark to
mark; a frame is told by SP and the static height of the instruction, so calls and interrupts in between cost little.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Collection
from typing import Literal

import msgspec

from miro_exact.bad_input import BadInput
from miro_robot.image.symbol_files import SourceLine
from miro_robot.inspect.frames import StackFrame
from miro_robot.inspect.writes import Bytes
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH, is_call
from mirotwin.debug.expression import NoValue, Term, Value, content, expression, number
from mirotwin.debug.symbols import Moment, Symbols
from mirotwin.debug.timeline import Core, Timeline, Trap
from mirotwin.rerun.inspected_run import BareRun

How = Literal["into", "over", "out"]
_SPACES = ("iram", "sfr", "xram", "bit")


class Breakpoint:
    """Stops, or with `log` tells something, before an instruction at one of `addresses`: where `condition` is true,
    `written` is written, and `count` fits how often that was so since the run began.
    """

    def __init__(self, number: int, text: str, addresses: Collection[int] | None) -> None:
        self.number = number
        self.text = text
        self.addresses = addresses
        self.condition: Term | None = None
        self.written: Bytes | None = None
        self.count: Callable[[int], bool] | None = None
        self.log: Callable[[Moment], str] | None = None
        self.hits: list[tuple[int, int]] = []  # (cycle, processor) of those that are counted
        self.counted_to = 0

    def index(self, hit: tuple[int, int]) -> int:
        """How many hits there were with this one."""
        if not self.hits or hit > self.hits[-1]:
            self.hits.append(hit)
        return bisect.bisect_left(self.hits, hit) + 1


class Written(msgspec.Struct, frozen=True):
    """An instruction that writes a variable: where it stands at `tick`, and the frames there."""

    tick: int
    frames: list[StackFrame]


class Debugger:
    """Of one run. `everyone`: breakpoints are for all processors, else for the one in focus.

    What stops is told as a text: "breakpoint 1", "step", "the run ends here".
    """

    def __init__(self, timeline: Timeline, symbols: Symbols, everyone: bool = False) -> None:
        self.timeline = timeline
        self.symbols = symbols
        self.everyone = everyone
        self.breakpoints: list[Breakpoint] = []
        self.told: list[tuple[int, int, str, int]] = []  # (cycle, processor, text, address) of logs
        self._numbers = 0

    # Where it stands

    @property
    def core(self) -> Core:
        return self.timeline.core

    @property
    def cpu(self) -> Cpu:
        return self.timeline.core.cpu

    def frames(self) -> list[StackFrame]:
        return self.symbols.unwinder.frames(self.cpu)

    def moment(self, frame: int = 0) -> Moment:
        return Moment(self.symbols, self.core, self.frames()[frame] if frame else None, not frame)

    @property
    def _went(self) -> bool:
        """Whether it stands behind the start of the run."""
        return self.timeline.tick > self.timeline.begin_tick

    @property
    def _base(self) -> int:
        return self.symbols.unwinder.base(self.cpu)

    # Breakpoints

    def add(self, text: str, addresses: Collection[int], condition: str = "", count: str = "") -> Breakpoint:
        """A breakpoint at `addresses`. Raises BadInput for a condition or a count that is not one."""
        self._numbers += 1
        found = Breakpoint(self._numbers, text, frozenset(addresses))
        found.condition = expression(condition) if condition else None
        found.count = _counting(count) if count else None
        self.breakpoints.append(found)
        return found

    def watch(
        self, text: str, condition: str = "", count: str = "", place: Value | None = None
    ) -> Breakpoint:
        """A data breakpoint: before an instruction that writes what `text` means. Raises BadInput."""
        written = self.bytes_of(text, place)
        found = self.add(text, self._writers(written) or (), condition, count)
        found.addresses = self._writers(written)
        found.written = written
        return found

    def bytes_of(self, text: str, place: Value | None = None) -> Bytes:
        """Where `text` lies. Raises NoValue for what lies in no memory that is written."""
        value = place or expression(text)(self.moment())
        if value.kind is None or value.space not in _SPACES:
            raise NoValue(
                f"{text} lies in no memory that can be watched", "name a variable: `print` says what it is"
            )
        if value.space == "bit":
            byte = value.address & 0xF8 if value.address >= 0x80 else 0x20 + (value.address >> 3)
            return Bytes("sfr" if value.address >= 0x80 else "iram", byte, 1)
        return Bytes(value.space, value.address, value.kind.size)

    def _writers(self, written: Bytes) -> Collection[int] | None:
        """Where instructions may write it; None, any, where code lies in RAM."""
        run = self.timeline.run
        if isinstance(run, BareRun) and run.machine.bus.code_of is not None:
            return None
        found = written.writers(self.symbols.image.code, self.symbols.instructions)
        stack = self.symbols.image.symbols.stack()[0]
        return (
            found | self.symbols.unwinder.vectors
            if written.space == "iram" and written.end > stack
            else found
        )

    def _writes(self, written: Bytes, cpu: Cpu) -> bool:
        """Whether the next instruction writes it, or the hardware's call of a routine has just done."""
        if written.are_written(cpu):
            return True
        entered = cpu.pc in self.symbols.unwinder.vectors and cpu.peripherals.interrupts.in_service
        return bool(entered) and any(written.first <= cpu.sp - at < written.end for at in (0, 1))

    def _traps(self, step: Trap | None = None, silent: bool = False) -> dict[int, Trap]:
        """What a search asks: the breakpoints, and `step` of the processor in focus."""
        table: dict[int, list[Breakpoint]] = {}
        anywhere = [one for one in self.breakpoints if one.addresses is None]
        for one in self.breakpoints:
            for address in one.addresses or ():
                table.setdefault(address, []).append(one)
        cores = range(len(self.timeline.cores)) if self.everyone else (self.timeline.focus,)

        def ask(core: Core) -> object:
            for one in (*table.get(core.cpu.pc, ()), *anywhere):
                if self._stops(one, core, silent):
                    return one
            if (
                step is not None
                and core is self.core
                and (step.addresses is None or core.cpu.pc in step.addresses)
            ):
                return step.ask(core)
            return None

        found = {}
        for at in cores:
            own = step if at == self.timeline.focus else None
            every = anywhere or (own is not None and own.addresses is None)
            addresses = None if every else {*table, *(own.addresses or () if own is not None else ())}
            if every or addresses:
                found[at] = Trap(addresses, ask)
        if step is not None and self.timeline.focus not in found:
            found[self.timeline.focus] = step
        return found

    def _stops(self, one: Breakpoint, core: Core, silent: bool) -> bool:
        if one.written is not None and not self._writes(one.written, core.cpu):
            return False
        moment = Moment(self.symbols, core)
        if one.condition is not None and not _holds(one.condition, moment):
            return False
        at = (core.cpu.cycles, self.timeline.cores.index(core))
        if one.count is not None and not one.count(one.index(at)):
            return False
        if one.log is None:
            return True
        if not silent:
            self.told.append((*at, one.log(moment), core.cpu.pc))
        return False

    def _count_up(self) -> None:
        """Counts the hits from the start of the run up to now, where a breakpoint asks for their number."""
        behind = [
            one for one in self.breakpoints if one.count is not None and one.counted_to < self.timeline.tick
        ]
        if behind:
            here, focus = self.timeline.tick, self.timeline.focus
            every, self.breakpoints = self.breakpoints, behind
            counts = [one.count for one in behind]
            for one in behind:
                one.count = lambda index: False
            self.timeline.go_to(min(one.counted_to for one in behind))
            self.timeline.find(self._traps(silent=True), here)
            for one, count in zip(behind, counts, strict=True):
                one.count, one.counted_to = count, here
            self.breakpoints = every
            self.timeline.focus = focus
            self.timeline.go_to(here)

    # Moving

    def go_on(self, back: bool = False) -> str:
        """To the next breakpoint, or the one before."""
        self._count_up()
        return self._back({}) if back else self._forward(None)

    def go_to(self, tick: int) -> str:
        """To a tick, or as near as the processor comes to it behind it. A long way can be interrupted."""
        if tick > self.timeline.frontier:
            self.timeline.go_to(min(tick, self.timeline.frontier))
            self.timeline.find({}, tick)
        self.timeline.go_to(tick) if not self.timeline.run.over else None
        return self._at_end() or "goto"

    def _forward(self, step: Trap | None) -> str:
        self.told.clear()
        hit = self.timeline.find(self._traps(step))
        if hit is not None:
            self.told = [one for one in self.told if one[:2] <= hit[:2]]
            return self._named(hit.found)
        return self._at_end() or "interrupted"

    def _back(self, traps: dict[int, Trap]) -> str:
        hit = self.timeline.find_back(traps or self._traps(silent=True))
        if hit is not None:
            return self._named(hit.found)
        return "interrupted" if self._went else "the run begins here"

    def _named(self, found: object) -> str:
        return f"breakpoint {found.number}" if isinstance(found, Breakpoint) else "step"

    def _at_end(self) -> str:
        if not self.timeline.run.over:
            return ""
        faults = [core.board.faults[-1] for core in self.timeline.cores if core.board and core.board.faults]
        if isinstance(self.timeline.run, BareRun):
            faults = self.timeline.run.machine.faults[-1:]
        return f"firmware fault: {faults[-1]}" if faults else "the run ends here"

    def step(self, how: How, back: bool = False, by_instruction: bool = False) -> str:
        """One line, or one instruction where it asks for that or no line is known. Raises BadInput."""
        if how == "out":
            return self._out_back() if back else self._out()
        if by_instruction or self.symbols.line(self.cpu.pc) is None:
            return self._instruction_back(how) if back else self._instruction(how)
        return self._line_back(how) if back else self._line(how)

    # By instruction

    def _instruction(self, how: How) -> str:
        cpu, pc, sp = self.cpu, self.cpu.pc, self.cpu.sp
        if how == "over" and is_call(cpu.code_at(pc)):
            behind = (pc + LENGTH[cpu.code_at(pc)]) & 0xFFFF
            return self._forward(Trap({behind}, lambda core: core.cpu.sp == sp or None))
        self.timeline.step()
        return self._at_end() or "step"

    def _instruction_back(self, how: How) -> str:
        base = self._base
        while True:
            if not self.timeline.step_back():
                return "the run begins here"
            frames = self.frames()
            if how != "over" or self._base <= base or len(frames) < 2:
                return "step"
            by_interrupt = frames[0].by_interrupt
            self._out_back()
            if not by_interrupt:
                return "step"

    # Out of a function

    def _caller(self) -> tuple[StackFrame, StackFrame]:
        frames = self.frames()
        if len(frames) < 2:
            what = "nothing called this function" if frames[0].known else "the stack cannot be told here"
            raise BadInput("", "finish", what, "step by instruction, or go to a place: `break`, `continue`")
        return frames[0], frames[1]

    def _out(self) -> str:
        inner, outer = self._caller()
        return self._forward(Trap({outer.pc}, lambda core: core.cpu.sp == inner.base - 2 or None))

    def _out_back(self) -> str:
        """To the call, or to where the interrupt came."""
        inner, _ = self._caller()
        hit = None
        if self.cpu.pc != inner.entry or self.cpu.sp != inner.base:
            entered = Trap({inner.entry}, lambda core: core.cpu.sp == inner.base or None)
            hit = self.timeline.find_back({self.timeline.focus: entered}, closely=True)
            if hit is None:
                return "the run begins here"
        self.timeline.step_back()
        return "step"

    # By line

    def _line_is(self, core: Core) -> SourceLine | None:
        return self.symbols.line(core.cpu.pc)

    def _in_frame(self, base: int, wanted: Callable[[SourceLine | None], bool], entry: int = -1) -> Trap:
        """Where a line of this function begins that is `wanted`, in the frame at `base`; and where the frame began."""
        first, end = self.symbols.around(self.cpu.pc)
        starts = {address for address in self.symbols.starts if first <= address < end} | ({entry} - {-1})

        def ask(core: Core) -> object:
            there = self.symbols.unwinder.base(core.cpu) == base
            return (there and (core.cpu.pc == entry or wanted(self._line_is(core)))) or None

        return Trap(starts, ask)

    def _line(self, how: How) -> str:
        """On to where another line begins, of this function, of one that it calls (`into`), or of its caller."""
        frames, base, line = self.frames(), self._base, self._line_is(self.core)
        back = frames[1].pc if len(frames) > 1 else -1
        level = self.cpu.peripherals.interrupts.in_service
        own = self._in_frame(base, lambda there: there != line)
        starts = (
            frozenset(self.symbols.starts)
            if how == "into" or not frames[0].known
            else own.addresses or frozenset()
        )

        def ask(core: Core) -> object:
            cpu = core.cpu
            if cpu.pc == back and cpu.sp == base - 2:
                return "returned"
            if own.ask(core):
                return "line"
            if how != "into":
                return (
                    ("line" if not frames[0].known and cpu.sp <= base else None) if cpu.pc in starts else None
                )
            deeper = cpu.pc in starts and self.symbols.unwinder.base(cpu) != base
            return "line" if deeper and cpu.peripherals.interrupts.in_service == level else None

        said = self._forward_found(Trap(starts | ({back} - {-1}), ask))
        if said != "returned":
            return said
        if self.cpu.pc in self.symbols.starts or self.symbols.line(self.cpu.pc) is None:
            return "step"
        return self._forward(self._in_frame(self._base, lambda there: True))

    def _forward_found(self, step: Trap) -> str:
        self.told.clear()
        hit = self.timeline.find(self._traps(step))
        if hit is None:
            return self._at_end() or "interrupted"
        return "returned" if hit.found == "returned" else self._named(hit.found)

    def _line_back(self, how: How) -> str:
        """Back to where a line began: this one if some of it was executed, else the one before."""
        timeline, line, inside = (
            self.timeline,
            self._line_is(self.core),
            self.cpu.pc not in self.symbols.starts,
        )
        frame = self.frames()[0]
        if how == "into":
            found = self._any_line_back(frame.base, None if inside else line)
        elif self.cpu.pc == frame.entry and frame.known and not frame.by_interrupt and frame.entry:
            self._out_back()
            found = "line"
        elif inside:
            found = "line"
        else:
            trap = self._in_frame(frame.base, lambda there: there != line, frame.entry)
            hit = timeline.find_back({timeline.focus: trap}, closely=True)
            found = "line" if hit is not None else "begin"
            if hit is not None and self._line_is(self.core) is None:  # a vector: where the interrupt came
                timeline.step_back()
                return "step"
        if found != "line":
            return "the run begins here" if found == "begin" else "step"
        self._begin_of_line()
        return "step" if self._went else "the run begins here"

    def _any_line_back(self, base: int, line: SourceLine | None) -> str:
        """The last line begun, of any function at the same level of interrupt; of a routine, where it was called."""
        level = self.cpu.peripherals.interrupts.in_service
        vectors = self.symbols.unwinder.vectors

        def ask(core: Core) -> object:
            cpu = core.cpu
            if cpu.peripherals.interrupts.in_service != level:
                return None
            if cpu.pc in vectors:
                return "vector"
            same = self.symbols.unwinder.base(cpu) == base and self._line_is(core) == line
            return None if same else "line"

        starts = {*self.symbols.starts, *(vectors if level else ())}
        hit = self.timeline.find_back({self.timeline.focus: Trap(starts, ask)}, closely=True)
        if hit is not None and hit.found == "vector":
            self.timeline.step_back()
        return "begin" if hit is None else str(hit.found)

    def _begin_of_line(self) -> None:
        """To where the line began that is under way: after the last other line of this frame, or its entry."""
        timeline, frame, line = self.timeline, self.frames()[0], self._line_is(self.core)
        if self.cpu.pc == frame.entry:
            return
        other = self._in_frame(frame.base, lambda there: there != line, frame.entry)
        own = self._in_frame(frame.base, lambda there: there == line)
        hit = timeline.find_back({timeline.focus: other}, closely=True)
        if hit is not None and self._line_is(self.core) != line:
            timeline.find({timeline.focus: own})

    # The last writer

    def last_writer(self, written: Bytes) -> Written | None:
        """Of bytes, before this moment; it stays where it is."""
        here, focus = self.timeline.tick, self.timeline.focus
        trap = Trap(self._writers(written), lambda core: self._writes(written, core.cpu) or None)
        hit = self.timeline.find_back({focus: trap})
        if hit is not None and not written.are_written(self.cpu):
            self.timeline.step_back()  # the hardware's call of a routine wrote it
        found = None if hit is None else Written(self.timeline.tick, self.frames())
        interrupted = hit is None and self._went
        self.timeline.focus = focus
        self.timeline.go_to(here)
        if interrupted:
            raise BadInput("", "who", "was interrupted before a writer was found")
        return found


def _holds(condition: Term, moment: Moment) -> bool:
    """Whether a condition is true; where it has no value it is not."""
    try:
        return bool(number(condition(moment), moment))
    except BadInput:
        return False


def _counting(text: str) -> Callable[[int], bool]:
    """`5`: the fifth; `>= 5`: from it on; `% 5`: every fifth. Raises BadInput."""
    sign, digits = text.strip()[: -len(text.strip().lstrip("<>=% "))].strip(), text.strip().lstrip("<>=% ")
    rules: dict[str, Callable[[int, int], bool]] = {
        "": int.__eq__, "=": int.__eq__, "==": int.__eq__, ">": int.__gt__, ">=": int.__ge__, "<": int.__lt__,
        "<=": int.__le__, "%": lambda index, every: index % every == 0,
    }  # fmt: skip
    if sign not in rules or not digits.isdecimal() or not int(digits[:9]) > 0:
        raise BadInput("", text, "is no count of hits", "give 5, >= 5 or % 5")
    rule, wanted = rules[sign], int(digits[:9])
    return lambda index: rule(index, wanted)


def shown(term: Term, moment: Moment) -> object:
    """The value of an expression. Raises NoValue."""
    return content(term(moment), moment)
