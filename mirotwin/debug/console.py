"""The line console of the debugger: a dozen verbs, each with its shortest form, `r` before those that go backwards.

What it prints of a moment is a time that `goto` takes, why it stopped, the place, and the C line or the instruction.
"""

from __future__ import annotations

import shlex
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

import click
import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.inspect.frames import StackFrame
from miro_robot.mcs51.opcodes import LENGTH, disassemble
from miro_sim.world.conditions import CONDITIONS
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.expression import Value, children, content, expression
from mirotwin.rerun.inspected_run import RobotRun
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.times import TimeType

PROMPT = "(mirotwin) "
LINES_AROUND = 5


class Console:
    """Does commands, and gives `tell` the lines that come of them."""

    def __init__(self, debugger: Debugger, tell: Callable[[str], object] = show_line) -> None:
        self.debugger = debugger
        self.tell = tell
        self.frame = 0
        self.stopped = False
        self.ended = False
        self.last = ""

    def run(self, line: str) -> bool:
        """Does one command; the last step again where the line is empty. False where it could not, which it says."""
        words = line.strip() or self.last
        verb = words.partition(" ")[0]
        self.last = words if verb.lstrip("r") in ("continue", "step", "stepi", "next", *"csn") else ""
        try:
            with self._interruptible():
                self.do(words)
        except BadInput as error:
            complain(f"error: {error}")
            return False
        return True

    def do(self, line: str) -> None:
        """The same without a word about errors. Raises BadInput."""
        verb, _, rest = line.strip().partition(" ")
        if verb == "r" and rest:
            verb, _, rest = f"r{rest.strip()}".partition(" ")
        if verb:
            self._verb(verb)(rest.strip())

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Within it Ctrl-C ends a search, where it is."""
        self.stopped = False

        def stop(number: int, frame: FrameType | None) -> None:
            self.stopped = True

        self.debugger.timeline.interrupted = lambda: self.stopped
        before = signal.signal(signal.SIGINT, stop)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _verb(self, word: str) -> Callable[[str], None]:
        every = self.verbs()
        fitting = [name for name in every if name == word] or [
            name for name in every if name.startswith(word)
        ]
        if not fitting:
            raise BadInput("", word, "is no command", f"there are {', '.join(every)}")
        return every[fitting[0]][0]

    def verbs(self) -> dict[str, tuple[Callable[[str], None], str]]:
        """What each verb does, and its help; where several begin alike, the first is meant by their beginning."""
        step = self._step
        return {
            "break": (self._break, "break FILE:LINE|SYMBOL|ADDRESS [if EXPR]: stop there; alone: list them"),
            "continue": (self._continue(False), "to the next breakpoint"),
            "delete": (self._delete, "delete [NUMBER]: take breakpoints away"),
            "finish": (step("out", False), "to the caller"),
            "goto": (self._goto, "goto TIME: 1.5s, 20ms or 48000t of the run, forwards or backwards"),
            "help": (self._help, "this list"),
            "list": (
                self._list,
                "the source around, or around FILE:LINE|SYMBOL|ADDRESS; the instructions without it",
            ),
            "next": (step("over", False), "to the next line, over calls"),
            "print": (
                self._print,
                "print EXPR: variables, registers, SFR bits, lm629.left, pins, iram[0x30], tick",
            ),
            "quit": (self._quit, "leave"),
            "rcontinue": (self._continue(True), "back to the breakpoint before"),
            "rfinish": (step("out", True), "back to the call"),
            "rnext": (step("over", True), "back to the line before, over calls"),
            "rstep": (step("into", True), "back to the line before, into calls"),
            "rstepi": (step("into", True, True), "back by one instruction"),
            "step": (step("into", False), "to the next line, into calls"),
            "stepi": (step("into", False, True), "one instruction"),
            "until": (
                self._until,
                f"until CONDITION [KEY=VALUE ..]: on to an event: {', '.join(CONDITIONS)}",
            ),
            "watch": (self._watch, "watch VAR [if EXPR]: stop before an instruction that writes it"),
            "where": (self._where, "the functions under way; where N: `print` means the names of frame N"),
            "who": (self._who, "who VAR: its last writer before now, with the functions under way there"),
        }

    # Moving

    def _continue(self, back: bool) -> Callable[[str], None]:
        return lambda rest: self.say(self.debugger.go_on(back))

    def _step(self, how: Any, back: bool, by_instruction: bool = False) -> Callable[[str], None]:
        return lambda rest: self.say(self.debugger.step(how, back, by_instruction))

    def _goto(self, rest: str) -> None:
        self.say(self.debugger.go_to(self._tick(rest)))

    def _tick(self, text: str) -> int:
        try:
            return TimeType().convert(text, None, None).ticks(self._hz)
        except click.UsageError as error:
            raise BadInput("", "goto", error.message) from None

    @property
    def _hz(self) -> int:
        return self.debugger.timeline.run.tick_hz

    def _until(self, rest: str) -> None:
        name, *keys = shlex.split(rest) or [""]
        if name not in CONDITIONS:
            raise BadInput("", name, "is no condition", f"there are {', '.join(CONDITIONS)}")
        run = self.debugger.timeline.run
        if not isinstance(run, RobotRun):
            raise BadInput(
                "", name, "is a condition of a robot's world", "stop the bare processor by breakpoints"
            )
        given: dict[str, Any] = {
            key: _value(value) for key, _, value in (word.partition("=") for word in keys)
        }
        robot = run.world.networks[run.network].robots[run.index]
        places = (
            {"network": run.network, "slot": robot.slot}
            if "slot" in CONDITIONS[name].__struct_fields__
            else {}
        )
        try:
            condition = msgspec.convert({**places, **given}, CONDITIONS[name], strict=False)
            event = self.debugger.timeline.until(condition)
        except (msgspec.ValidationError, ValueError) as error:
            raise BadInput("", rest, str(error)) from None
        self.say("no such event before the end" if event is None else str(event))

    def say(self, why: str) -> None:
        """Where it stands, and why."""
        self.frame = 0
        for cycle, core, text, address in self.debugger.told:
            place = (
                f"{self.time(cycle * CYCLE_TICKS)}  {self.core(core)}{self.debugger.symbols.place(address)}"
            )
            self.tell(f"{place}: {text}")
        self.debugger.told.clear()
        focus = self.debugger.timeline.focus
        place = self.debugger.symbols.place(self.debugger.cpu.pc)
        self.tell(
            f"{self.time(self.debugger.timeline.tick)}  {self.core(focus)}{why}: {place}{self._source()}"
        )

    def core(self, at: int) -> str:
        cores = self.debugger.timeline.cores
        return f"{cores[at].name}  " if len(cores) > 1 else ""

    def time(self, tick: int) -> str:
        return f"{tick / self._hz:.7f}s" if self._hz == TICKS_PER_SECOND else f"{tick}t"

    def _source(self) -> str:
        symbols, cpu = self.debugger.symbols, self.debugger.cpu
        line = symbols.line(cpu.pc)
        text = "" if line is None else symbols.sources.text(line)
        asleep = " (asleep)" if cpu.idle or cpu.powered_down else ""
        return asleep + (f"   {text}" if text else f"   {disassemble(cpu.code, cpu.pc, symbols.names)}")

    # Breakpoints

    def _break(self, rest: str) -> None:
        if not rest:
            for one in self.debugger.breakpoints:
                self.tell(f"{one.number}  {one.text}")
            return
        place, _, condition = rest.partition(" if ")
        symbols, place = self.debugger.symbols, place.strip()
        found = symbols.at(place)
        one = self.debugger.add(rest, found.addresses, condition)
        note = ""
        if found.line is not None and ":" in place and not place.endswith(f":{found.line.line}"):
            note = f" ({place} has no code: the next line that has some)"
        if not symbols.instructions.issuperset(found.addresses):
            note = " (no instruction is known to begin there)"
        self.tell(f"breakpoint {one.number}: {symbols.place(found.addresses[0])}{note}")

    def _watch(self, rest: str) -> None:
        name, _, condition = rest.partition(" if ")
        one = self.debugger.watch(name.strip(), condition)
        one.text = f"watch {rest}"
        self.tell(f"breakpoint {one.number}: before {name.strip()} is written")

    def _delete(self, rest: str) -> None:
        there = self.debugger.breakpoints
        if rest and not any(str(one.number) == rest for one in there):
            raise BadInput("", "delete", f"there is no breakpoint {rest}", "`break` lists them")
        there[:] = [one for one in there if rest and str(one.number) != rest]

    # Looking

    def _where(self, rest: str) -> None:
        frames = self.debugger.frames()
        if rest:
            if not rest.isdecimal() or int(rest) >= len(frames):
                raise BadInput("", "where", f"there is no frame {rest}", f"there are 0 to {len(frames) - 1}")
            self.frame = int(rest)
        self._frames(frames, self.frame)

    def _print(self, rest: str) -> None:
        moment = self.debugger.moment(self.frame)
        value = expression(rest)(moment)
        for line in lines_of(rest, value, moment):
            self.tell(line)

    def _who(self, rest: str) -> None:
        found = self.debugger.last_writer(self.debugger.bytes_of(rest))
        if found is None:
            self.tell(f"nothing wrote {rest} before")
            return
        self.tell(f"{self.time(found.tick)}  {rest} was last written by")
        self._frames(found.frames)

    def _frames(self, frames: list[StackFrame], chosen: int = -1) -> None:
        """One line a frame, the innermost first."""
        symbols = self.debugger.symbols
        for at, frame in enumerate(frames):
            called = at > 0 and not frames[at - 1].by_interrupt
            place = symbols.unwinder.call_before(frame.pc) if called else frame.pc
            how = "  <- interrupt" if frame.by_interrupt else ""
            self.tell(f"{'*' if at == chosen else ' '}#{at}  {symbols.place(place)}{how}")
        if not frames[-1].known:
            self.tell("    the stack cannot be told from here on")

    def _list(self, rest: str) -> None:
        symbols = self.debugger.symbols
        address = symbols.at(rest).addresses[0] if rest else self.debugger.frames()[self.frame].pc
        line = symbols.line(address)
        path = None if line is None else symbols.sources.path(line.file)
        if line is None or path is None:
            for _ in range(2 * LINES_AROUND):
                self.tell(
                    f"{'=>' if address == self.debugger.cpu.pc else '  '} {address:#06x}  "
                    + disassemble(symbols.image.code, address, symbols.names)
                )
                address = (address + LENGTH[symbols.image.code[address]]) & 0xFFFF
            return
        text = path.read_text(errors="replace").splitlines()
        for number in range(max(1, line.line - LINES_AROUND), min(len(text), line.line + LINES_AROUND) + 1):
            self.tell(f"{'=>' if number == line.line else '  '} {number:4}  {text[number - 1]}")

    def _help(self, rest: str) -> None:
        for verb, (_, text) in self.verbs().items():
            self.tell(f"{verb:10} {text}")

    def _quit(self, rest: str) -> None:
        self.ended = True


def lines_of(name: str, value: Value, moment: Any) -> Iterator[str]:
    """A value as text: groups and structs a line a member."""
    if value.members is not None:
        for part, child in children(value):
            yield from lines_of(f"{name}.{part}", child, moment)
        return
    note = f"   ({value.note})" if value.note else ""
    yield f"{name} = {shown_value(content(value, moment))}{note}"


def shown_value(found: Any) -> str:
    """A number as one reads it: small ones alone, larger ones in hex too."""
    if isinstance(found, bool) or not isinstance(found, int) or -10 < found < 10:
        return str(found)
    return f"{found} ({found:#x})"


def _value(text: str) -> Any:
    """What a key of a condition is given: a number, true, false, or text."""
    if text in ("true", "false"):
        return text == "true"
    with suppress(ValueError):
        return int(text, 0)
    return text
