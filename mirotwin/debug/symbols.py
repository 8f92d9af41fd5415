"""The debugger's view of a firmware: lines and addresses, functions, and the values of names at a moment of a run."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cached_property, partial
from operator import attrgetter
from pathlib import PureWindowsPath as AnyPath

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.clock import CYCLE_TICKS
from miro_robot.image import Image
from miro_robot.image.c_types import CType, value_of
from miro_robot.image.debug_info import DebugInfo, Function, Sources
from miro_robot.image.registers import STACK, LocalVariable, parse_blocks
from miro_robot.image.symbol_files import SourceLine, map_overlays, read_text
from miro_robot.image.variables import Variable, variables_of
from miro_robot.inspect.data_flow import Callees
from miro_robot.inspect.frames import StackFrame, Unwinder
from miro_robot.inspect.listing import ListingRow, rows
from miro_robot.inspect.local_places import LocalPlaces
from miro_robot.inspect.stack_depth import StackReader
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.tap import CpuTap, port_pins
from miro_robot.inspect.values import bytes_at
from miro_robot.inspect.writes import instructions_of
from miro_robot.lm629.chip import Lm629
from miro_robot.mcs51.opcodes import BITS, SFRS
from mirotwin.debug.board_values import levels_put_on, value_on
from mirotwin.debug.expression import NoValue, Value, names_in
from mirotwin.debug.timeline import Core
from mirotwin.firmware.code_place import address_of

_BYTE, _BIT = CType("int", 1), CType("bit", 1)
_PORTS = ("P0", "P1", "P2", "P3")
SIZES = {"iram": 0x100, "xram": 0x10000, "code": 0x10000, "sfr": 0x100}
_REGISTER_NAMES = {SFRS["ACC"]: "A", **{SFRS[name]: name for name in ("B", "DPL", "DPH")}}
_MEMORIES = ("iram", "xram", "code")
SPECIAL = ("A", "DPTR", "PC", "lm629", "pins", "tick", "cycle", *(f"R{number}" for number in range(8)))
_CHIP = {
    "": "desired_position desired_velocity real_position real_velocity status pwm_magnitude sign hi"
    " index_position breakpoint mode writes_while_busy pid trajectory",
    "pid": "kp ki kd il ds error_sum",
    "trajectory": "target max_velocity acceleration",
}


class Symbols:
    """Symbols of one image. `known`: names for completion and remedies, including `more`.

    Raises ImageError for debug files of another image.
    """

    def __init__(self, image: Image, sources: Sources, more: Collection[str] = ()) -> None:
        self.image = image
        self.debug = DebugInfo.of(image)
        self.line = self.debug.line_at
        self.sources = sources
        self.names = SymbolNames(image)
        self.unwinder = Unwinder(image, self.names)
        self.variables = variables_of(image)
        self.blocks = parse_blocks(read_text(image.path.with_suffix(".cdb")))
        self._callees, self._places = Callees(StackReader(image)), dict[int, LocalPlaces]()
        self.overlays = map_overlays(read_text(image.path.with_suffix(".map")))
        self.line_begins = {at: line for at, line in self.debug.lines if self.line(at) is not None}
        functions = [first for first, _ in self.names.functions]
        known = [*self.unwinder.heights, *self.line_begins, *functions]
        self.instructions = instructions_of(image.code, image.used, known)
        names = [*image.symbols.names, *(name.removeprefix("_") for name in image.symbols.names)]
        names += [*self.variables.by_name, *(variable.name for variable in self.blocks.variables)]
        self.meanings: dict[tuple[int, str, str], Meaning] = {}
        self.known = sorted({*names, *more, *SPECIAL, *SFRS, *BITS, *SIZES})

    # Places

    def function(self, address: int) -> str:
        """Its name as C has it."""
        return self.names.function(address)[1].removeprefix("_")

    def place(self, address: int) -> str:
        """`failsafe.c:146 in failsafe_tick`; the address and the symbol if no line is known."""
        line = self.line(address)
        if line is None:
            return f"{address:#06x} in {self.names.place(address)}"
        return f"{AnyPath(line.file).name}:{line.line} in {self.function(address)}"

    def entry(self, address: int) -> int:
        """First address of the function around an instruction; a C function may contain further names."""
        function = self.debug.function_at(address)
        return self.names.function(address)[0] if function is None else function.first

    def at_line(self, file: str, line: int) -> tuple[list[int], SourceLine]:
        """First addresses of a line's code, one for each function with such code; of the next line with code if it has
        none. Raises BadInput.
        """
        name = AnyPath(file).name
        own = [(place, address) for address, place in self.debug.lines if AnyPath(place.file).name == name]
        wanted = f"{name}:{line}"
        if not own:
            files = ", ".join(sorted({AnyPath(place.file).name for place in self.line_begins.values()}))
            remedy = f"the files are {files}" if files else "give an address: the image has no debug files"
            raise BadInput("", wanted, "no code is of this file", remedy)
        place = min(
            (place for place, _ in own if place.line >= line), default=None, key=lambda pair: pair.line
        )
        if place is None:
            last = max(place.line for place, _ in own)
            raise BadInput("", wanted, "no line has code from there on", f"the last one is {last}")
        addresses = sorted(
            (address for own_place, address in own if own_place.line == place.line), reverse=True
        )
        firsts = {self.entry(address): address for address in addresses}
        return sorted(firsts.values()), place

    def at(self, text: str) -> tuple[list[int], SourceLine | None]:
        """The addresses of `FILE:LINE`, a symbol or an address, and the line. Raises BadInput."""
        file, colon, line = text.rpartition(":")
        if colon and line.isdecimal() and len(line) < 8:
            return self.at_line(file, int(line))
        address = address_of(text, self.image, str(self.image.path), "")
        return [address], self.line(address)

    def local_places(self, function: Function) -> LocalPlaces:
        """The places of a function's local variables."""
        if function.first not in self._places:
            self._places[function.first] = LocalPlaces(
                self.image, self.debug, self.blocks, self.variables, self._callees, function
            )
        return self._places[function.first]

    @cached_property
    def listing(self) -> list[ListingRow]:
        """The image's instructions and tables in the order of addresses."""
        return list(rows(self.image, self.debug, self.names, self.unwinder.from_reset))


class Moment:
    """Values of names at the processor's present place, in one of the active functions; 0 is the innermost one."""

    def __init__(self, symbols: Symbols, core: Core, frame: int = 0) -> None:
        self.symbols = symbols
        self.core = core
        self.frame = frame
        self.pc = self.frames()[frame].place if frame else core.cpu.pc

    def frames(self) -> list[StackFrame]:
        return self.symbols.unwinder.frames(self.core.cpu)

    def find(self, name: str, module: str) -> Value:
        """The value of a name; `module`: the file named before it, "" if none. Raises NoValue."""
        key = (self.pc, name, module)
        meaning = self.symbols.meanings.get(key)
        if (
            meaning is None
        ):  # it depends on the instruction alone, and a condition asks for it again and again
            meaning = self.symbols.meanings[key] = self._meaning(name, module)
        return meaning(self)

    def _meaning(self, name: str, module: str) -> Meaning:
        """A function that reads a name's value at this instruction. Raises NoValue for an unknown name."""
        if not module and (local := self._local_meaning(name)):
            return local
        if variable := self._variable(name, module):
            return self._placing(variable)
        if not module and (special := self._special(name)):
            return special
        symbol = self.symbols.image.symbols.find(name)
        if symbol is None and not module and value_on(self.core.device.board, name):
            return lambda moment: value_on(moment.core.device.board, name) or Value()
        if symbol is None:
            raise self._unknown(name)
        if symbol.space == "code":
            return lambda moment: Value(number=symbol.address, space="code", note="an address of code")
        kind = _BIT if symbol.space == "bit" else _BYTE
        function = name.removeprefix("_").rpartition("_PARM_")[0]

        def value(moment: Moment) -> Value:
            if symbol.space == "iram":
                moment._refuse_shared(name, symbol.address, function)
            return Value(kind, symbol.space, symbol.address, moment, note="of unknown type")

        return value

    def _placing(self, variable: Variable) -> Meaning:
        """`placed` for this instruction; for most variables the place is the same everywhere."""
        places = self._places()
        own = places is not None and variable.scope == places.name
        shared = any(first <= variable.address < end for first, end in self.symbols.overlays)
        if own or (shared and variable.space == "iram"):
            return lambda moment: moment.placed(variable)
        kind, space, address = variable.type, variable.space, variable.address
        fields = self.symbols.variables.fields(variable)
        return lambda moment: Value(kind, space, address, moment, fields=fields)

    def _unknown(self, name: str) -> NoValue:
        owners = {variable.function for variable in self.symbols.blocks.variables if variable.name == name}
        placed = {variable.scope for variable in self.symbols.variables.by_name.get(name, ())}
        remedy = did_you_mean(name, self.symbols.known)
        if self._function in owners - placed:
            return NoValue(f"{name} is not live: no debug file says where this function keeps it")
        if owners | placed:
            remedy = f"it is a local variable of {', '.join(sorted(owners | placed))}"
            remedy += f"; give {min(placed)}:{name}" if placed else ""
        elif name == "lm629":
            remedy = "it is a robot's, and this is the bare processor"
        return NoValue(f"there is no {name} here", remedy)

    def scope_of(self, name: str, module: str) -> str | None:
        """The file or function of a variable with a place; "" for a register or a name of the map only; else None."""
        if variable := self._variable(name, module):
            return variable.scope
        symbol = self.symbols.image.symbols.find(name) if not module else None
        named = (
            name in SFRS or name in BITS or (symbol is not None and symbol.space in ("iram", "xram", "bit"))
        )
        return "" if named else None

    @property
    def _function(self) -> str:
        """Name of the active C function, "" outside of C functions."""
        places = self._places()
        return "" if places is None else places.name

    def _variable(self, name: str, module: str) -> Variable | None:
        """The variable: one of this file before a global one. Raises NoValue where several other files have one."""
        line = self.symbols.line(self.pc)
        own = AnyPath(line.file).stem if line else ""
        there = self.symbols.variables.by_name.get(name, ())
        if not module:
            there = tuple(
                variable
                for variable in there
                if variable.scope in ("", variable.module) or variable.scope == self._function
            )
        fitting = [
            variable for variable in there if not module or module in (variable.scope, variable.module)
        ]
        near = [variable for variable in fitting if variable.scope == own] or [
            variable for variable in fitting if not variable.scope
        ]
        if there and not near and len(fitting) != 1:
            reason = f"there are several {name}" if fitting else f"there is no {name} of {module}"
            raise NoValue(
                reason,
                f"give one of {', '.join(f'{variable.scope or variable.module}:{name}' for variable in there)}",
            )
        return next(iter(near or fitting), None)

    def placed(self, variable: Variable) -> Value:
        """The value of a variable with a place. Raises NoValue if other variables use the place now."""
        if variable.space == "iram" and variable.scope:
            self._refuse_shared(variable.name, variable.address, variable.scope)
        places = self._places()
        if places is not None and variable.scope == places.name:
            where = self._arrived(places, variable)
            if where:
                return self._in_registers(places, variable.name, variable.type, where)
        fields = self.symbols.variables.fields(variable)
        return Value(variable.type, variable.space, variable.address, self, fields=fields)

    def _refuse_shared(self, name: str, address: int, function: str) -> None:
        """Raises NoValue for memory that several functions use, while this one is not under way."""
        if any(first <= address < end for first, end in self.symbols.overlays):
            under_way = {self.symbols.function(frame.pc).lstrip("_") for frame in self.frames()}
            if function.lstrip("_") not in under_way:
                why = f"its memory is shared, and {function or 'its function'} is not under way"
                raise NoValue(f"{name} is not live: {why}")

    def locals(self) -> dict[str, Callable[[], Value]]:
        """Local variables of the active function; reading one that is not live raises NoValue."""
        places = self._places()
        if places is None:
            return {}
        inner_last = reversed(places.visible(self.pc))
        in_memory = self.variables(places.name, places.module)
        return in_memory | {local.name: partial(self._local, places, local) for local in inner_last}

    def _local_meaning(self, name: str) -> Meaning | None:
        """A function that reads a local variable's value; None if there is no local variable of this name."""
        places = self._places()
        if places is None:
            return None
        variable = next((local for local in places.visible(self.pc) if local.name == name), None)
        if variable is not None:
            return lambda moment: moment._local(places, variable)
        own = [local for local in self.symbols.variables.by_name.get(name, ()) if local.scope == places.name]
        placed = max(own, key=lambda local: local.module == places.module, default=None)
        return None if placed is None else lambda moment: moment.placed(placed)

    def _places(self) -> LocalPlaces | None:
        """Places of the active function's local variables; None outside of C functions."""
        function = self.symbols.debug.function_at(self.pc)
        return None if function is None else self.symbols.local_places(function)

    def variables(self, scope: str, module: str = "") -> dict[str, Callable[[], Value]]:
        """The variables of a function or a file ("": of all) with a place in memory, by name.

        `module`: the file of the function, if several have one of this name.
        """
        every = (variable for _, each in sorted(self.symbols.variables.by_name.items()) for variable in each)
        own = sorted(
            (variable for variable in every if variable.scope == scope),
            key=lambda variable: variable.module == module,
        )
        return {
            variable.name: partial(self.placed, variable)
            for variable in own
            if scope or variable.space in _MEMORIES
        }

    def refuse(self, text: str, address: int) -> None:
        """Raises NoValue for an expression with a local variable that has no value wherever `address` is executed."""
        there = Moment(self.symbols, self.core)
        there.pc = address
        for module, name in names_in(text):
            if not module and there._is_lost(name) and (local := there.locals().get(name)):
                local()

    def _is_lost(self, name: str) -> bool:
        """True if the code does not show where a local variable is."""
        places = self._places()
        if places is None:
            return False
        for variable in places.visible(self.pc):
            if variable.name == name:
                return variable.storage != STACK and isinstance(places.of(variable, self.pc), str)
        there = self.symbols.variables.by_name.get(name, ())
        own = [variable for variable in there if variable.scope == places.name]
        return any(isinstance(self._arrived(places, variable), str) for variable in own)

    def _arrived(self, places: LocalPlaces, variable: Variable) -> tuple[int, ...] | str:
        memory = range(variable.address, variable.address + variable.type.size)
        return places.in_memory(variable.name, memory, variable.space == "iram", self.pc)

    def _local(self, places: LocalPlaces, variable: LocalVariable) -> Value:
        """A local variable in registers or on the stack."""
        if variable.storage == STACK:
            return self._on_stack(places, variable)
        where = places.of(variable, self.pc)
        if self.frame and not isinstance(where, str):
            where = "its registers belong to the function that is called"
        home = variable.registers[::-1] if -1 not in places.home(variable) else ()
        remedy = f"its home is {' '.join(home).upper()}: print what that holds" if home else ""
        return self._in_registers(places, variable.name, variable.type, where, remedy)

    def _in_registers(
        self, places: LocalPlaces, name: str, kind: CType, where: tuple[int, ...] | str, remedy: str = ""
    ) -> Value:
        """A value in registers.

        `where`: numbers of its bytes, or the reason why they are unknown, which raises NoValue.
        """
        cpu = self.core.cpu
        if (
            not isinstance(where, str)
            and cpu.bank != 8 * places.bank
            and any(place < 0x80 for place in where)
        ):
            where = "another register bank is selected"
        if isinstance(where, str):
            raise NoValue(f"{name} is not live: {where}", remedy)
        data = bytes(cpu.sfr(place) if place >= 0x80 else cpu.peek_iram(place) for place in where)
        names = [_REGISTER_NAMES.get(place, f"R{place & 7}") for place in where[::-1]]
        return Value(kind, number=value_of(kind, data, {}), note=f"in {' '.join(names)}")

    def _on_stack(self, places: LocalPlaces, variable: LocalVariable) -> Value:
        frame = self.frames()[self.frame]
        height = self.symbols.unwinder.heights.get(frame.pc, (-1, -1))[0]
        if not places.has_frame or frame.entry != places.function.first or height < 0:
            raise NoValue(f"{variable.name} is not live: it is on the stack, and no debug file says where")
        if variable.offset > 0 and height < variable.offset + variable.type.size:
            raise NoValue(f"{variable.name} is not live: it has no place on the stack yet")
        fields = self.symbols.variables.structs.get(places.module, {})
        return Value(variable.type, "iram", frame.base + 1 + variable.offset, self, fields=fields)

    def _special(self, name: str) -> Meaning | None:
        """A register, a bit, a memory, the chips."""
        if name in _PORTS:
            return lambda moment: moment._port(name)
        if name in SFRS or name == "A":
            return lambda moment: Value(_BYTE, "sfr", SFRS["ACC" if name == "A" else name], moment)
        if len(name) == 2 and name[0] == "R" and name[1] in "01234567":
            return lambda moment: Value(_BYTE, "iram", moment.core.cpu.bank + int(name[1]), moment)
        if name in BITS:
            return lambda moment: Value(_BIT, "bit", BITS[name], moment)
        if name in SIZES:
            whole = CType("array", SIZES[name], element=_BYTE, count=SIZES[name])
            return lambda moment: Value(whole, name, 0, moment)
        if name == "pins":
            return lambda moment: Value(
                members={f"P{port}": partial(moment._pins, port) for port in range(4)}
            )
        if name == "lm629" and self.core.board is not None:
            return Moment._chips
        number = _NUMBERS.get(name)
        return None if number is None else lambda moment: Value(number=number(moment))

    def _port(self, name: str) -> Value:
        latch = self.core.cpu.sfr(SFRS[name])
        pins = latch & levels_put_on(self.core.device.board, _PORTS.index(name))
        return Value(
            _BYTE,
            "sfr",
            SFRS[name],
            self,
            note="" if latch == pins else f"the latch; on the pins is {pins:#04x}",
        )

    def _chips(self) -> Value:
        board = self.core.board
        if board is None:
            raise self._unknown("lm629")
        board.sync(self.core.cpu.cycles * CYCLE_TICKS)
        return Value(members={"left": partial(_chip, board.left), "right": partial(_chip, board.right)})

    def _pins(self, port: int) -> Value:
        tap = CpuTap(self.core.board, lambda: None)
        tap.attached(self.core.cpu)
        tap.detach()
        return Value(number=port_pins(tap.start, port) & levels_put_on(self.core.device.board, port))

    def read(self, space: str, address: int, count: int) -> bytes:
        """Bytes of a memory. Raises BadInput for one that is not there."""
        cpu = self.core.cpu
        if space == "sfr" and address < 0x80:
            raise NoValue(f"{address:#04x} is no special function register", "they begin at sfr[0x80]")
        if space == "iram":  # the usual case, and asked again and again
            return bytes([cpu.peek_iram(place) for place in range(address, address + count)])
        return bytes_at(cpu, self.symbols.image, Variable("", "", address, space, CType("int", count), ""))


Meaning = Callable[[Moment], Value]
"""A function from a moment to a name's value."""
_NUMBERS: dict[str, Callable[[Moment], int]] = {
    "PC": lambda moment: moment.pc,
    "DPTR": lambda moment: moment.core.cpu.dptr,
    "cycle": lambda moment: moment.core.cpu.cycles,
    "tick": lambda moment: moment.core.cpu.cycles * CYCLE_TICKS,
}


def _chip(chip: Lm629, path: str = "") -> Value:
    """The debugger's view of a chip, or of a part of it."""
    if path not in _CHIP:
        return Value(number=int(attrgetter(path)(chip)))
    paths = {name: f"{path}.{name}".lstrip(".") for name in _CHIP[path].split()}
    return Value(members={name: partial(_chip, chip, inner) for name, inner in paths.items()})
