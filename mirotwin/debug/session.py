"""The state that the debugger's verbs work on: the present place, the selected frame, and the output of the last
command.

At a stop it prints the time (as `goto` takes it), the reason of the stop, the place, and the C line or the instruction.
"""

from __future__ import annotations

from collections.abc import Callable

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.image.symbol_files import SourceLine
from miro_robot.inspect.frames import StackFrame
from miro_robot.mcs51.opcodes import disassemble
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Moment


class Session:
    """A session of one user. `lines`: output of the last command; `why`: reason of the stop, "" if it did not move.
    `displays`: number -> expression shown at each stop; `examined`: where `x` continues.
    """

    def __init__(self, debugger: Debugger) -> None:
        self.debugger = debugger
        self.symbols = debugger.symbols
        self.timeline = debugger.timeline
        self.lines: list[str] = []
        self.tell = self.lines.append
        self.frame = 0
        self.why = ""
        self.ended = False
        self.displays: dict[int, tuple[str, Callable[[], list[str]]]] = {}
        self.examined: Examined | None = None

    def say(self, why: str, instruction: bool = False) -> None:
        """Prints log output, the place, the reason `why` of the stop, and the displays.

        `instruction`: print the instruction, not the C line.
        """
        self.frame, self.why = 0, why
        for cycle, core, text, address in self.debugger.log_outputs:
            self.tell(f"{self.time(cycle * CYCLE_TICKS, core)}{self.symbols.place(address)}: {text}")
        self.debugger.log_outputs.clear()
        cpu = self.debugger.cpu
        line = None if instruction else self.symbols.line(cpu.pc)
        source = "" if line is None else self.symbols.sources.text(line)
        text = source or disassemble(cpu.code, cpu.pc, self.symbols.names)
        asleep = " (asleep)" if cpu.idle or cpu.powered_down else ""
        now = self.time(self.timeline.tick, self.timeline.focus)
        self.tell(f"{now}{why}: {self.symbols.place(cpu.pc)}{asleep}   {text}")
        self.show_displays()

    def show_displays(self) -> None:
        """Prints all displays; for one without a value here, the reason."""
        for number, (text, show) in self.displays.items():
            try:
                shown = show()
            except BadInput as error:
                shown = [f"{text}: {error}"]
            for line in shown:
                self.tell(f"{number}: {line}")

    def time(self, tick: int, core: int) -> str:
        """A time that `goto` takes, and where there are several, of whom."""
        hz, cores = self.timeline.run.tick_hz, self.timeline.cores
        name = f"{cores[core].name}  " if len(cores) > 1 else ""
        return (
            f"{tick / hz:.7f}s  {name}" if hz == TICKS_PER_SECOND else f"{tick}t ({tick / hz:.6f} s)  {name}"
        )

    # The selected frame

    def moment(self) -> Moment:
        return self.debugger.moment(self.frame)

    def here(self) -> StackFrame:
        return self.debugger.frames()[self.frame]

    def line_here(self) -> SourceLine | None:
        """The C line of the frame; before `main` that of `main`."""
        main = self.symbols.image.symbols.find("main")
        line = self.symbols.line(self.here().place)
        return self.symbols.line(main.address) if line is None and main is not None else line

    def place(self, text: str) -> str:
        """Completes a place: `147` is a line of the present file; `*0x123` and `*main` are addresses."""
        if text[:1] == "*":
            return text[1:].strip()
        line = self.line_here() if text.isdecimal() else None
        return text if line is None else f"{line.file}:{text}"


class Examined:
    """The last arguments of `x`: number of units, form and memory; `address`: of the next unit."""

    def __init__(self) -> None:
        self.count, self.form, self.size = 1, "x", 1
        self.space, self.address = "", 0
