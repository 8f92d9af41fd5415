"""The line console of the debugger: a dozen verbs, each with its shortest form, `r` before those that go backwards.

What it prints of a moment is a time that `goto` takes, why it stopped, the place, and the C line or the instruction.
"""

from __future__ import annotations

import json
import re
import shlex
import signal
from cmd import Cmd
from collections.abc import Iterator
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, TICKS_PER_SECOND
from miro_protocol.toml_text import TomlError, struct_of
from miro_robot.image.symbol_files import read_text
from miro_robot.inspect.frames import StackFrame
from miro_robot.mcs51.opcodes import disassemble
from miro_sim.world.conditions import CONDITIONS
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.expression import Value, children, content, expression
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.times import TimeType

LINES_AROUND = 5
_HEX = re.compile("0[xX][0-9a-fA-F]+")
MOVES = {
    "continue": "to the next breakpoint",
    "finish": "to the caller",
    "next": "to the next line, over calls",
    "step": "to the next line, into calls",
    "stepi": "one instruction",
    "rcontinue": "back to the breakpoint before",
    "rfinish": "back to the call",
    "rnext": "back to the line before, over calls",
    "rstep": "back to the line before, into calls",
    "rstepi": "back by one instruction",
}
VERBS = {
    **MOVES,
    "break": "break FILE:LINE|SYMBOL|ADDRESS [if EXPR]: stop there; alone: list them",
    "delete": "delete [NUMBER]: take breakpoints away",
    "goto": "goto TIME: 1.5s, 20ms or 48000t of the run, forwards or backwards",
    "help": "this list",
    "list": "the source around, or around FILE:LINE|SYMBOL|ADDRESS; the instructions without it",
    "print": "print EXPR: variables, registers, SFR bits, lm629.left, pins, iram[0x30], tick, parts, nets",
    "quit": "leave",
    "until": "until EXPR: on to where it is true, looked at every millisecond; or until EVENT [KEY=VALUE ..]: "
    + ", ".join(CONDITIONS),
    "watch": "watch VAR [if EXPR]: stop before an instruction that writes it",
    "where": "the functions under way; where N: `print` means the names of frame N",
    "who": "who VAR: its last writer before now, with the functions under way there",
}
"""By name, with their help; where several begin alike, the first is meant by their beginning."""


class Console(Cmd):
    """Does commands. `lines`: what came of the last one; `done`: whether all could be done.

    `interrupted`: Ctrl-C ended the last one.
    """

    prompt = "(mirotwin) "

    def __init__(self, debugger: Debugger) -> None:
        super().__init__()
        self.debugger = debugger
        self.symbols = debugger.symbols
        self.timeline = debugger.timeline
        self.lines: list[str] = []
        self.tell = self.lines.append
        self.frame = 0
        self.done = True
        self.ended = self.interrupted = False
        self.last = self.why = ""

    def completenames(self, text: str, *ignored: object) -> list[str]:
        return [verb for verb in sorted(VERBS) if verb.startswith(text)]

    def completedefault(self, text: str, *ignored: object) -> list[str]:
        return [name for name in self.symbols.known if name.startswith(text)]

    def onecmd(self, line: str) -> bool:
        """Does one line, or the last step again where it is empty, and shows what came of it; whether it is the last.

        Ctrl-C ends a search, where it is.
        """
        stopped: list[int] = []
        before = signal.signal(signal.SIGINT, lambda number, frame: stopped.append(number))
        words = "quit" if line == "EOF" else line.strip() or self.last
        try:
            with self.timeline.shown(words, lambda: bool(stopped)):
                self.last = words if self.do(words) in MOVES else ""
        except BadInput as error:
            complain(f"error: {error}")
            self.done = False
        finally:
            signal.signal(signal.SIGINT, before)
            self.interrupted = bool(stopped)
            for output in self.lines:
                show_line(output)
        return self.ended

    def postcmd(self, stop: bool, line: str) -> bool:
        """Nothing more of a list of commands is done after Ctrl-C; who types goes on."""
        if self.interrupted and not self.prompt:
            raise KeyboardInterrupt
        return stop

    def do(self, line: str) -> str:
        """Runs one line and shows nothing; returns the verb. Raises BadInput."""
        self.lines.clear()
        word, _, rest = line.strip().partition(" ")
        if word == "r" and rest:
            word, _, rest = f"r{rest.strip()}".partition(" ")
        if not word:
            return ""
        verb = word if word in VERBS else next((name for name in VERBS if name.startswith(word)), "")
        if not verb:
            raise BadInput("", word, "is no command", f"there are {', '.join(VERBS)}")
        if verb not in MOVES:
            getattr(self, f"_{verb}")(rest.strip())
        elif rest:
            raise BadInput("", rest, f"is more than {verb} takes", "repeat it by an empty line")
        else:
            self.say(self.debugger.move(verb))
        return verb

    # Moving

    def say(self, why: str) -> None:
        """Shows the output of logs, where the debugger stands, and why."""
        self.frame, self.why = 0, why
        for cycle, core, text, address in self.debugger.told:
            self.tell(f"{self.time(cycle * CYCLE_TICKS, core)}{self.symbols.place(address)}: {text}")
        self.debugger.told.clear()
        cpu = self.debugger.cpu
        line = self.symbols.line(cpu.pc)
        source = "" if line is None else self.symbols.sources.text(line)
        text = source or disassemble(cpu.code, cpu.pc, self.symbols.names)
        asleep = " (asleep)" if cpu.idle or cpu.powered_down else ""
        now = self.time(self.timeline.tick, self.timeline.focus)
        self.tell(f"{now}{why}: {self.symbols.place(cpu.pc)}{asleep}   {text}")

    def time(self, tick: int, core: int) -> str:
        """A time that `goto` takes, and where there are several, of whom."""
        hz, cores = self.timeline.run.tick_hz, self.timeline.cores
        name = f"{cores[core].name}  " if len(cores) > 1 else ""
        return (
            f"{tick / hz:.7f}s  {name}" if hz == TICKS_PER_SECOND else f"{tick}t ({tick / hz:.6f} s)  {name}"
        )

    def _goto(self, rest: str) -> None:
        try:
            tick = TimeType().read(rest).ticks(self.timeline.run.tick_hz)
        except ValueError as error:
            raise BadInput("", "goto", f"{error}") from None
        self.say(self.debugger.go_to(tick))

    def _until(self, rest: str) -> None:
        word = rest.partition(" ")[0]
        if rest and word not in CONDITIONS and (word in self.symbols.known or not word.isidentifier()):
            self.say(self.debugger.until_true(rest))
            return
        try:
            name, *keys = shlex.split(rest) or [""]
        except ValueError as error:
            raise BadInput("", rest, f"{error}") from None
        if name not in CONDITIONS:
            remedy = f"give an expression, or one of {', '.join(CONDITIONS)}"
            raise BadInput("until", name, "is no condition and no name", remedy)
        device, kind = self.timeline.core.device, CONDITIONS[name]
        fields = kind.__struct_fields__
        given: dict[str, Any] = {"network": device.network}
        if "slot" in fields:
            given["slot"] = device.slot
        for key, _, value in (word.partition("=") for word in keys):
            given[key] = (
                int(value, 16) if _HEX.fullmatch(value) else _literal(value) if key == "equals" else value
            )
        try:
            event = self.debugger.until(struct_of(given, kind, strict=False))
        except TomlError as error:
            raise BadInput(f"until {name}", error.place, error.what, error.remedy) from None
        except ValueError as error:
            raise BadInput("", rest, str(error), f"its keys are {', '.join(fields)}") from None
        self.say(event)

    # Breakpoints

    def _break(self, rest: str) -> None:
        if not rest:
            for breakpoint in self.debugger.breakpoints:
                self.tell(f"{breakpoint.number}  {breakpoint.text}")
            return
        place, _, condition = (part.strip() for part in rest.partition(" if "))
        breakpoint = self.debugger.add(place, condition)
        note = f" ({breakpoint.note})" if breakpoint.note else ""
        self.tell(f"breakpoint {breakpoint.number}: {self.symbols.place(min(breakpoint.addresses))}{note}")

    def _watch(self, rest: str) -> None:
        name, _, condition = (part.strip() for part in rest.partition(" if "))
        breakpoint = self.debugger.watch(name, condition)
        self.tell(f"breakpoint {breakpoint.number}: before {name} is written")

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
        self._show(frames, self.frame)

    def _who(self, rest: str) -> None:
        writer = self.debugger.last_writer(self.debugger.bytes_of(rest))
        if writer is None:
            self.tell(f"nothing wrote {rest} before")
        else:
            self.tell(f"{self.time(writer[0], self.timeline.focus)}{rest} was last written by")
            self._show(writer[1])

    def _show(self, frames: list[StackFrame], chosen: int = -1) -> None:
        """One line a frame, the innermost first."""
        for index, frame in enumerate(frames):
            how = "  <- interrupt" if frame.by_interrupt else ""
            self.tell(f"{'*' if index == chosen else ' '}#{index}  {self.symbols.place(frame.place)}{how}")
        if not frames[-1].known:
            self.tell("    the stack cannot be told from here on")

    def _print(self, rest: str) -> None:
        for line in _lines_of(rest, expression(rest)(self.debugger.moment(self.frame))):
            self.tell(line)

    def _list(self, rest: str) -> None:
        here = self.debugger.frames()[self.frame].place
        address = self.symbols.at(rest)[0][0] if rest else here
        line = self.symbols.line(address)
        path = None if line is None else self.symbols.sources.path(line.file)
        if line is not None and path is not None:
            wanted = rest.rpartition(":")[2]
            middle = int(wanted) if ":" in rest and wanted.isdecimal() else line.line
            rows = enumerate(read_text(path).splitlines(), 1)
            shown = [
                (number, f"{number:4}  {text}")
                for number, text in rows
                if abs(number - middle) <= LINES_AROUND
            ]
            stands = self.symbols.line(here)
            marked = stands.line if stands is not None and stands.file == line.file else -1
        else:
            shown = [(row.address, f"{row.address:#06x}  {row.text}") for row in self.symbols.listing]
            shown = [row for row in shown if row[0] >= address][: 2 * LINES_AROUND]
            marked = here
        for number, text in shown:
            self.tell(f"{'=>' if number == marked else '  '} {text}")

    def _help(self, rest: str) -> None:
        for verb, text in VERBS.items():
            self.tell(f"{verb:10} {text}")

    def _quit(self, rest: str) -> None:
        self.ended = True


def _lines_of(name: str, value: Value) -> Iterator[str]:
    """A value as text: groups a line a member."""
    if value.members is None:
        note = f"   ({value.note})" if value.note else ""
        shown = content(value)
        text = json.dumps(shown, ensure_ascii=False) if isinstance(shown, str) else shown_value(shown)
        yield f"{name} = {text}{note}"
    else:
        for part, get in children(value):
            yield from _lines_of(f"{name}.{part}", get())


def shown_value(shown: Any) -> str:
    """A number as one reads it: small ones alone, larger ones in hex too."""
    if isinstance(shown, bool) or not isinstance(shown, int) or -10 < shown < 10:
        return str(shown)
    return f"{shown} ({shown:#x})"


def _literal(text: str) -> bool | float | str:
    """A number, true or false as in a scenario file; all else, and what stands in quotes, is a text."""
    try:
        value = msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text
    return value if isinstance(value, bool | int | float | str) else text
