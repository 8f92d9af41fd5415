"""Finds the place of a local variable's value before an instruction, or the reason why it is unknown.

The debug file names a home for each variable and no times. Arguments arrive by the compiler's convention: the first
one that is no bit in DPL, DPH, B, A, low byte first (SDCC manual, "Global Registers used for Parameter Passing"), and
R4 to R7 where it has eight bytes; the others in memory or on the stack. What the registers hold later is followed
through the code (`data_flow`).

    entry    MOV R7,DPL    ..    MOV DPL,R7    LCALL          `opcode` with the home R7
    DPL      DPL, R7       R7    R7            nowhere: R7 is not read any more, so it may hold something else
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import PureWindowsPath as AnyPath

from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Function
from miro_robot.image.registers import STACK, Blocks, LocalVariable
from miro_robot.image.variables import Variables
from miro_robot.inspect.data_flow import DPH, DPL, ENTRY, SP, A, B, Callees, Effect, Flow, Held
from miro_robot.mcs51.opcodes import SFRS

_PLACES = {"dpl": DPL, "dph": DPH, "b": B, "a": A, **{f"r{number}": number for number in range(8)}}
_FIRST_SFR, _PSW, _PUSH = 0x80, SFRS["PSW"], 0xC0


class _Argument:
    """The argument that arrives in registers. `home`: its bytes in registers or `memory`; `prologue`: the instructions
    that bring it there, and the one after them.
    """

    def __init__(self, name: str, home: tuple[int, ...], memory: range, prologue: list[int]) -> None:
        self.name = name
        self.home = home
        self.memory = memory
        self.prologue = prologue


class LocalPlaces:
    """Places of the local variables of one function of an image."""

    def __init__(
        self,
        image: Image,
        debug: DebugInfo,
        blocks: Blocks,
        variables: Variables,
        callees: Callees,
        function: Function,
    ) -> None:
        self.image = image
        self.blocks = blocks
        self.function = function
        self.name = function.name.removeprefix("_")
        self.module = "" if function.line is None else AnyPath(function.line.file).stem
        self.bank = blocks.bank(self.name, self.module)
        self.own = blocks.of_function(self.name, self.module)
        self.parameters = blocks.parameters(self.own, function.first, function.end)
        self.arrives_in = (DPL, DPH, B, A, *range(8 * self.bank + 4, 8 * self.bank + 8))
        self.flow = Flow(callees, function.first, 8 * self.bank)
        self.line_begins = [
            address for address, _ in debug.lines if address in self.flow.held and address != function.first
        ]
        self.argument = self._argument(variables)
        self._of: dict[tuple[LocalVariable, int], tuple[int, ...] | str] = {}

    # The argument that arrives in registers

    def _argument(self, variables: Variables) -> _Argument | None:
        """The register argument; None if there is none or if it is ambiguous."""
        arguments = []
        for parameter in self.parameters:
            memory = self._memory(parameter, variables)
            if parameter.storage == STACK or parameter.type.kind in ("bit", "bits"):
                continue
            if parameter.type.size > len(self.arrives_in):
                continue
            if parameter.storage == "R" or (memory and not self._is_numbered(memory)):
                arguments.append(self._arrives(parameter, memory))
        registers = [
            argument for argument in arguments if not argument.memory
        ]  # where others are in memory, these cannot be
        if not registers and len(arguments) > 1:
            registers = [argument for argument in arguments if self.is_brought(argument)]
        arguments = registers or arguments
        return arguments[0] if len(arguments) == 1 else None

    @property
    def has_frame(self) -> bool:
        """True if it has a frame pointer, and so all that is on the stack a known place."""
        pointer = self.image.symbols.find("_bp")
        code = self.image.code[self.function.first : self.function.first + 2]
        return pointer is not None and code == bytes((_PUSH, pointer.address))

    def _memory(self, variable: LocalVariable, variables: Variables) -> range:
        """The addresses of a variable in memory."""
        there = [each for each in variables.by_name.get(variable.name, ()) if each.scope == self.name]
        there = [each for each in there if each.module == self.module] or there
        return range(there[0].address, there[0].address + variable.type.size) if len(there) == 1 else range(0)

    def _is_numbered(self, memory: range) -> bool:
        """True if the caller puts it there: `_f_PARM_2`."""
        names = self.image.symbols.names.items()
        return any(
            name.startswith(f"_{self.name}_PARM_") and symbol.address == memory.start
            for name, symbol in names
        )

    def _arrives(self, variable: LocalVariable, memory: range) -> _Argument:
        home = tuple(self._place(register) for register in variable.registers)
        address = self.function.first
        prologue, framing = [address], -1
        while address in self.flow.effects and len(self.flow.after[address]) == 1:
            does = self.flow.effects[address]
            in_frame = does.mnemonic in ("ADD", "MOV") and self.flow.held[address][A] == {(framing, A)}
            if SP in does.reads or in_frame:
                framing = address
            elif not self._brings(does, address, memory):
                break
            (address,) = self.flow.after[address]
            prologue.append(address)
        return _Argument(variable.name, home if -1 not in home else (), memory, prologue)

    def _brings(self, does: Effect, address: int, memory: range) -> bool:
        """True if an instruction does no more than to bring arguments to their homes, or to make the frame."""
        held = self.flow.held[address]
        if does.mnemonic == "PUSH" or SP in does.writes or does.writes == {_PSW}:
            return True
        if does.constant in memory or (memory and does.writes in ({DPL, DPH}, set())):
            return does.mnemonic in ("MOV", "MOVX", "INC")
        known = (*self.flow.places, *memory)
        arguments = [frozenset({(ENTRY, place)}) for place in self.arrives_in]
        moved = [to in known and held.get(source) in arguments for to, source in does.moves]
        return bool(moved) and all(moved) and does.mnemonic in ("MOV", "XCH")

    def is_brought(self, argument: _Argument) -> bool:
        """True if the code brings it from the registers to its home."""
        if argument.memory:
            return any(self._names(address, argument.memory) for address in argument.prologue[:-1])
        held = self.flow.held.get(argument.prologue[-1])
        return bool(argument.home) and held is not None and self._holds(held, argument.home)

    def _place(self, register: str) -> int:
        place = _PLACES.get(register, -1)
        return place if place >= _FIRST_SFR or place < 0 else place + 8 * self.bank

    def _holds(self, held: Held, home: Collection[int]) -> bool:
        """True if it is there still as it arrived."""
        return all(
            held[place] == {(ENTRY, there)} for place, there in zip(home, self.arrives_in, strict=False)
        )

    def _names(self, address: int, memory: range) -> bool:
        """True if an instruction reads or writes a memory, or takes its address."""
        does = self.flow.effects[address]
        first = self.flow.places[0]
        pointer = (
            does.mnemonic == "MOV" and does.constant in memory and does.writes <= {first, first + 1, DPL, DPH}
        )
        return pointer or not (does.reads | does.writes).isdisjoint(memory)

    # Where it is

    def visible(self, pc: int) -> list[LocalVariable]:
        """Variables in registers or on the stack in scope at an instruction; inner ones first."""
        return self.blocks.visible(self.own, self.function.first, pc)

    def of(self, variable: LocalVariable, pc: int) -> tuple[int, ...] | str:
        """Places of the bytes of a register variable, low byte first, or the reason why they are unknown."""
        key = (variable, pc)
        if key not in self._of:
            self._of[key] = self._is_at(variable, pc)
        return self._of[key]

    def _is_at(self, variable: LocalVariable, pc: int) -> tuple[int, ...] | str:
        held = self.flow.held.get(pc)
        if held is None:
            return "its code cannot be followed"
        argument = self.argument
        if argument is not None and variable.name == argument.name and pc in argument.prologue:
            return self._arrived(variable, held)
        home = self.home(variable)
        if not home:
            return "it was optimised away"
        if -1 in home:
            return "it is in a register of the compiler's own"
        if self.flow.live[pc].isdisjoint(home):
            return "its value is not needed from here on"
        if argument is not None and variable.name == argument.name and self._holds(held, home):
            return home
        if any(address < 0 for place in home for address, _ in held[place]):
            return "nothing was assigned to it yet"
        if not self._may_be_of(variable, home, pc):
            return "its registers hold something else"
        if not self._is_alone(variable, home) or self._has_rival(variable, home, pc):
            return "its registers may hold another variable"
        return home

    def _has_rival(self, variable: LocalVariable, home: tuple[int, ...], pc: int) -> bool:
        """True if another variable may be there: one with such a home, or one for which the debug file has none.

        SDCC writes for some variables what it did with them before it had done.
        """
        for other in self.visible(pc):
            if other.storage == "R" and other is not variable:
                if not other.registers and other.type.size == variable.type.size:
                    return True
                if self._shares(other, home) and self._may_be_of(other, self.home(other), pc):
                    return True
        return False

    def home(self, variable: LocalVariable) -> tuple[int, ...]:
        """Its registers as the debug file has them, low byte first; -1 for one of the compiler's own (B0 to B7)."""
        return tuple(self._place(register) for register in variable.registers)

    def _shares(self, other: LocalVariable, home: tuple[int, ...]) -> bool:
        return not set(home).isdisjoint(self.home(other))

    def _may_be_of(self, variable: LocalVariable, home: tuple[int, ...], pc: int) -> bool:
        """True if all bytes that its home holds are needed later, and at the begin of a C line that may name it.

        So what the compiler keeps there within a line is not taken for it.
        """
        here = self.flow.held[pc]
        needed = self.flow.live[pc].issuperset(home)
        return needed and any(self._same(here, there, home) for there in self._kept(variable, home))

    def _kept(self, variable: LocalVariable, home: tuple[int, ...]) -> list[Held]:
        """The values at the begins of C lines in the variable's scope, if its home is needed later."""
        return [
            self.flow.held[address]
            for address in self.line_begins
            if self.flow.live[address].issuperset(home) and variable in self.visible(address)
        ]

    def _same(self, here: Held, other: Held, home: tuple[int, ...]) -> bool:
        return all(not here[place].isdisjoint(other[place]) for place in home)

    def _is_alone(self, variable: LocalVariable, home: tuple[int, ...]) -> bool:
        """True if its home holds one thing only that outlasts a line: then no other variable has been there."""
        waiting = self._kept(variable, home)
        reached = waiting[:1]
        for held in reached:
            reached += [other for other in waiting if other not in reached and self._same(held, other, home)]
        return len(reached) == len(waiting)

    def in_memory(self, name: str, memory: range, in_ram: bool, pc: int) -> tuple[int, ...] | str:
        """The registers that hold a parameter with a place in memory; none if it is in memory; or the reason why it is
        unknown.

        `in_ram`: the memory is internal RAM, so that instructions name its bytes.
        """
        parameter = next((parameter for parameter in self.parameters if parameter.name == name), None)
        if parameter is None or pc not in self.flow.held:
            return ()
        argument = self.argument
        named = [address for address in self.flow.effects if self._names(address, memory)]
        if argument is not None and argument.name == name:
            if pc in argument.prologue[:-1]:
                return self._arrived(parameter, self.flow.held[pc])
            if pc in self.flow.reached_without(self.function.first, named):
                return "nothing was assigned to it yet"
        elif pc == self.function.first:
            return ()
        changes = in_ram and any(not self.flow.effects[address].reads & set(memory) for address in named)
        if changes or pc in self.flow.leads_to(named):
            return ()
        return "its value is not needed from here on"  # which may have been changed in registers

    def _arrived(self, variable: LocalVariable, held: Held) -> tuple[int, ...] | str:
        """In any of the registers, while no C line of the body has begun."""
        registers = []
        for there in self.arrives_in[: variable.type.size]:
            places = [place for place in self.flow.places if held[place] == {(ENTRY, there)}]
            if not places:
                return "its registers hold something else"
            registers.append(places[0])
        return tuple(registers)
