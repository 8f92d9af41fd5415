"""A firmware as its debugger knows it: lines and addresses, functions, and what names mean at a moment of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.clock import CYCLE_TICKS
from miro_robot.image import Image
from miro_robot.image.c_types import CType
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.registers import Blocks, RegisterVariable, parse_blocks
from miro_robot.image.symbol_files import SourceLine, read_text
from miro_robot.image.variables import Variable, variables_of
from miro_robot.inspect.frames import StackFrame, Unwinder
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.tap import CpuTap, port_pins
from miro_robot.inspect.values import bytes_at
from miro_robot.inspect.writes import instructions_of
from miro_robot.lm629.chip import Lm629
from miro_robot.mcs51.names import BITS, SFRS
from mirotwin.debug.expression import NoValue, Value, memory
from mirotwin.debug.timeline import Core
from mirotwin.firmware.code_place import address_of

_BYTE, _WORD, _BIT = CType("int", 1), CType("int", 2), CType("bit", 1)
SIZES = {"iram": 0x100, "xram": 0x10000, "code": 0x10000, "sfr": 0x100}
_CHIP = (
    *(
        "desired_position",
        "desired_velocity",
        "real_position",
        "real_velocity",
        "status",
        "pwm_magnitude",
        "sign",
        "hi",
    ),
    *("index_position", "breakpoint", "mode", "writes_while_busy"),
)
_PARTS = {
    "pid": ("kp", "ki", "kd", "il", "ds", "error_sum"),
    "trajectory": ("target", "max_velocity", "acceleration"),
}
_REGISTERS: dict[str, Callable[[Any], int]] = {
    "A": lambda cpu: cpu.a,
    "B": lambda cpu: cpu.b,
    "DPTR": lambda cpu: cpu.dptr,
    "SP": lambda cpu: cpu.sp,
    "PSW": lambda cpu: cpu.psw(),
    "PC": lambda cpu: cpu.pc,
}
_IN_CPU: dict[str, Callable[[Any], int]] = {
    "a": _REGISTERS["A"], "b": _REGISTERS["B"], "dpl": lambda cpu: cpu.dptr & 0xFF, "dph": lambda cpu: cpu.dptr >> 8,
}  # fmt: skip


class Stop(msgspec.Struct, frozen=True):
    """Where a breakpoint on a line stands: `addresses`, and the `line` that has them."""

    addresses: tuple[int, ...]
    line: SourceLine | None = None


class Symbols:
    """Of one image. Raises ImageError where a debug file beside it is another image's."""

    def __init__(self, image: Image, folders: Sequence[Path]) -> None:
        self.image = image
        self.debug = DebugInfo.of(image)
        self.sources = Sources([image.path.parent, *folders])
        self.names = SymbolNames(image)
        self.unwinder = Unwinder(image, self.names)
        self.variables = variables_of(image)
        self.blocks: Blocks = parse_blocks(read_text(image.path.with_suffix(".cdb")))
        self.begins = dict(self.debug.lines)
        self.starts = [address for address, _ in self.debug.lines]
        self.instructions = instructions_of(
            image.code,
            image.used,
            [*self.unwinder.heights, *self.starts, *(first for first, _ in self.names.functions)],
        )

    # Places

    def line(self, address: int) -> SourceLine | None:
        return self.debug.line_at(address)

    def function(self, address: int) -> str:
        """Its name as C has it."""
        return self.names.function(address)[1].removeprefix("_")

    def place(self, address: int) -> str:
        """`failsafe.c:146 in failsafe_tick`, or the address and the symbol where no line is known."""
        line = self.line(address)
        symbol = self.names.place(address)
        return (
            f"{_name(line.file)}:{line.line} in {self.function(address)}"
            if line
            else f"{address:#06x} in {symbol}"
        )

    def around(self, address: int) -> tuple[int, int]:
        """(first, end) of the function that the instruction belongs to."""
        found = self.debug.function_at(address)
        if found is not None:
            return found.first, found.end
        first = self.names.function(address)[0]
        later = [place for place, _ in self.names.functions if place > first]
        return first, min(later, default=0x10000)

    def files(self) -> list[str]:
        return sorted({line.file for _, line in self.debug.lines})

    def at_line(self, file: str, line: int) -> Stop:
        """The code of a line, or of the next one that has any. Raises BadInput."""
        name = _name(file)
        own = [(one, address) for address, one in self.debug.lines if _name(one.file) == name]
        if not own:
            known = (
                ", ".join(map(_name, self.files())) or "none: the image has no debug files, give an address"
            )
            raise BadInput("", f"{name}:{line}", "no code is of this file", f"the files are {known}")
        nearest = min((one.line for one, _ in own if one.line >= line), default=None)
        if nearest is None:
            last = max(one.line for one, _ in own)
            raise BadInput("", f"{name}:{line}", "no line has code from there on", f"the last one is {last}")
        first_of: dict[int, int] = {}
        for one, address in own:
            if one.line == nearest:
                entry = self.around(address)[0]
                first_of[entry] = min(first_of.get(entry, address), address)
        place = next(one for one, _ in own if one.line == nearest)
        return Stop(tuple(sorted(first_of.values())), place)

    def at(self, text: str) -> Stop:
        """What `FILE:LINE`, a symbol or an address means. Raises BadInput."""
        file, colon, line = text.rpartition(":")
        if colon and line.isdecimal() and len(line) < 8:
            return self.at_line(file, int(line))
        address = address_of(text, self.image, str(self.image.path), "")
        return Stop((address,), self.line(address))

    # Names

    def variables_in(self, scope: str) -> list[Variable]:
        """What has a place in memory and belongs to a function or a file; "": to all."""
        every = [one for each in self.variables.by_name.values() for one in each if one.scope == scope]
        return [one for one in every if scope or one.space in ("iram", "xram", "code")]

    def known_names(self) -> list[str]:
        """For completion and remedies."""
        return [*self.variables.by_name, *_REGISTERS, *SFRS, *BITS, "lm629", "pins", "tick", "cycle", *SIZES]


class Moment:
    """What names mean for a processor that stands at `frame`. `innermost`: the registers are this function's."""

    def __init__(
        self, symbols: Symbols, core: Core, frame: StackFrame | None = None, innermost: bool = True
    ) -> None:
        self.symbols = symbols
        self.core = core
        self.pc = core.cpu.pc if frame is None else frame.pc
        self.innermost = innermost

    def find(self, name: str, module: str) -> Value:
        """See `Scope`."""
        if not module:
            for local, value in self.locals():
                if local == name:
                    return value() if callable(value) else value
        variable = self._variable(name, module)
        if variable is not None:
            return self.placed(variable)
        special = self._find_special(name) if not module else None
        if special is not None:
            return special
        symbol = self.symbols.image.symbols.find(name)
        if symbol is not None and symbol.space == "code":
            return Value(number=symbol.address, note="an address of code")
        if symbol is not None:
            return Value(
                _BIT if symbol.space == "bit" else _BYTE, symbol.space, symbol.address, note="of unknown type"
            )
        raise NoValue(f"there is no {name} here", did_you_mean(name, self.symbols.known_names()))

    def _variable(self, name: str, module: str) -> Variable | None:
        there = self.symbols.variables.by_name.get(name, ())
        if module:
            there = tuple(one for one in there if module in (one.scope, one.module))
        line = self.symbols.line(self.pc)
        own = _name(line.file).partition(".")[0] if line else ""
        ranked = sorted(there, key=lambda one: (one.scope != own, one.scope != ""))
        if len(ranked) > 1 and ranked[0].scope not in ("", own):
            places = ", ".join(f"{one.scope}:{name}" for one in ranked)
            raise NoValue(f"there are several {name}", f"give one of {places}")
        return ranked[0] if ranked else None

    def placed(self, variable: Variable) -> Value:
        """What a variable with a place means."""
        fields = self.symbols.variables.fields(variable)
        return Value(variable.type, variable.space, variable.address, fields=fields)

    def locals(self) -> Iterator[tuple[str, Value | Callable[[], Value]]]:
        """Of the function that it stands in; one that is not live raises NoValue when it is asked for."""
        function = self.symbols.debug.function_at(self.pc)
        if function is None:
            return
        name = function.name.removeprefix("_")
        for one in self.symbols.blocks.visible(name, function.first, self.pc):
            yield one.name, partial(self._in_registers, one)
        for variable in self.symbols.variables_in(name):
            yield variable.name, self.placed(variable)

    def _in_registers(self, one: RegisterVariable) -> Value:
        if one.on_stack:
            raise NoValue(f"{one.name} is not live: it is on the stack, and no debug file says where")
        if not one.registers:
            raise NoValue(f"{one.name} is not live: it was optimised away")
        if not self.innermost:
            raise NoValue(f"{one.name} is not live: its registers belong to the function that is called")
        cpu = self.core.cpu
        found = [
            cpu.peek_iram(cpu.bank + int(register[1])) if register[1:].isdecimal() else _IN_CPU[register](cpu)
            for register in one.registers
        ]
        number = int.from_bytes(bytes(found), "little", signed=one.type.signed and one.type.kind == "int")
        where = " ".join(register.upper() for register in reversed(one.registers))
        return Value(one.type, number=number, note=f"in {where}: theirs only while the compiler needs it")

    def _find_special(self, name: str) -> Value | None:
        cpu, board = self.core.cpu, self.core.board
        if name in _REGISTERS:
            return Value(number=_REGISTERS[name](cpu))
        if len(name) == 2 and name[0] == "R" and name[1] in "01234567":
            return Value(_BYTE, "iram", cpu.bank + int(name[1]))
        if name in SFRS:
            return Value(_BYTE, "sfr", SFRS[name])
        if name in BITS:
            return Value(_BIT, "bit", BITS[name])
        if name in SIZES and (name != "xram" or board is None):
            return memory(name, SIZES[name])
        if name == "pins":
            return Value(members={f"P{port}": partial(self._pins, port) for port in range(4)})
        if name == "lm629" and board is not None:
            return Value(members={"left": lambda: _chip(board.left), "right": lambda: _chip(board.right)})
        if name in ("cycle", "tick"):
            return Value(number=cpu.cycles * (CYCLE_TICKS if name == "tick" else 1))
        return None

    def special(self, name: str) -> Value:
        """A register, a bit, a memory, the chips. Raises NoValue."""
        found = self._find_special(name)
        if found is None:
            raise NoValue(f"there is no {name} here")
        return found

    def _pins(self, port: int) -> Value:
        tap = CpuTap(self.core.board, lambda: None)
        tap.attached(self.core.cpu)
        tap.detach()
        return Value(number=port_pins(tap.start, port))

    def read(self, space: str, address: int, count: int) -> bytes:
        """See `Scope`."""
        cpu = self.core.cpu
        if space == "xram":
            if self.core.board is not None:
                raise NoValue("is in external RAM, which the board has not")
            return bytes(cpu.bus.movx_read((address + at) & 0xFFFF, 0) for at in range(count))
        if space == "sfr" and address < 0x80:
            raise NoValue(f"{address:#04x} is no special function register", "they begin at sfr[0x80]")
        variable = Variable("", "", address, space, CType("int", count), "")
        return bytes_at(cpu, self.symbols.image, variable)


def _chip(chip: Lm629) -> Value:
    members = {name: partial(_of, chip, name) for name in _CHIP}
    for part, names in _PARTS.items():
        group = {name: partial(_of, getattr(chip, part), name) for name in names}
        members[part] = partial(Value, members=group)
    return Value(members=members)


def _of(part: Any, name: str) -> Value:
    return Value(number=int(getattr(part, name)))


def _name(path: str) -> str:
    return path.replace("\\", "/").rpartition("/")[2]
