"""Which bytes an instruction writes or reads: what a data breakpoint has to look at, without executing step by step.

Direct and bit forms tell it by themselves. What goes through R0 and R1, DPTR, the bank and the stack pointer is known
only before it is executed. Not seen: what hardware changes, and what A, B, DPTR and PSW become, or are used for, by the
way. SP is written by pushes, pops, calls and returns; reading it is naming it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from miro_exact.state import Flat
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH, ROW, SFRS, TABLE, byte_of_bit, is_call

_DIRECT = {0x05, 0x15, 0x42, 0x43, 0x52, 0x53, 0x62, 0x63, 0x75, 0x86, 0x88, 0xC5, 0xD0, 0xD5, 0xF5}  # rows
_BIT = {0x10, 0x92, 0xB2, 0xC2, 0xD2}
_REGISTER = {0x08, 0x18, 0x78, 0xA8, 0xC8, 0xD8, 0xF8}
_INDIRECT = {0x06, 0x16, 0x76, 0xA6, 0xC6, 0xD6, 0xF6}
_MOV_DIRECT, _PUSH, _MOVX_DPTR, _MOVX_PAGE, _JBC = 0x85, 0xC0, 0xF0, 0xF2, 0x10
_BANKS, _FIRST_SFR, _P2, _SP = 0x20, 0x80, 0xA0, 0x81
_POP, _RETURNS, _JMP = 0xD0, (0x22, 0x32), 0x73
_ONLY_WRITTEN = ("MOV", "MOVX", "CLR", "SETB", "POP")  # their first operand
_UNNAMED = {0xD0: ["@SP"], 0x22: ["@SP", "@SP-1"], 0x32: ["@SP", "@SP-1"]}  # POP, RET, RETI


def _read_by(row: int, mnemonic: str, operands: str) -> tuple[str, ...]:
    """The operands of a row that it reads; `Ri` is the register of `@Ri`."""
    words = operands.split(",")
    read = words[1:] if mnemonic in _ONLY_WRITTEN else words
    if mnemonic == "MOVX":
        read = [f"x{word}" for word in read if word != "A"]
    return (*read, *_UNNAMED.get(row, ()), *(["Ri"] if "@Ri" in words else []))


READS_BY_ROW = {row[0]: _read_by(row[0], row[3], row[4]) for row in TABLE}


def written_form(row: int) -> str:
    """The operand by which a row writes memory, as `READS_BY_ROW` has those that it reads; "" for none."""
    forms = {
        "dst": (_MOV_DIRECT,),
        "dir": _DIRECT,
        "@Ri": _INDIRECT,
        "x@DPTR": (_MOVX_DPTR,),
        "x@Ri": (_MOVX_PAGE,),
    }
    return next((form for form, rows in forms.items() if row in rows), "")


class Bytes:
    """`count` bytes of a memory: "iram", "sfr", "xram", to read "code"; of them the bits of `mask`, of which the first
    byte's are the lowest.

    All of a byte is written by any write to it. Single bits are written by instructions that name them, and by those
    that write their byte and change one of them.
    """

    def __init__(self, space: str, first: int, count: int, mask: int = -1) -> None:
        self.space = space
        self.first = first
        self.end = first + count
        self.mask = mask & (1 << 8 * count) - 1
        self._copied: tuple[Cpu, Flat, Cpu, Flat] | None = None

    @property
    def is_whole(self) -> bool:
        """True if all bits are meant."""
        return self.mask == (1 << 8 * (self.end - self.first)) - 1

    def bits(self, mask: int) -> Bytes:
        """Some bits of these."""
        return Bytes(self.space, self.first, self.end - self.first, mask)

    def same(self, other: Bytes) -> bool:
        mine, others = ((side.space, side.first, side.end, side.mask) for side in (self, other))
        return mine == others

    def writers(self, code: bytes, instructions: Iterable[int], on_stack: bool = True) -> set[int]:
        """The `instructions` that may write one of the bytes. `on_stack`: the stack may reach them."""
        return {address for address in instructions if self._may(code, address, on_stack)}

    def readers(self, code: bytes, instructions: Iterable[int], on_stack: bool = True) -> set[int]:
        """The `instructions` that may read one of the bytes. `on_stack`: the stack may reach them."""
        return {address for address in instructions if self._may_read(code, address, on_stack)}

    def are_read(self, cpu: Cpu) -> bool:
        """True if the instruction that `cpu` executes next reads one of them; a byte with all of its bits."""
        return any(
            self._holds(space, address) and self.mask >> 8 * (address - self.first) & mask
            for space, address, mask in _read_places(cpu)
        )

    def are_written(self, cpu: Cpu) -> bool:
        """True if the instruction that `cpu` executes next writes one of them."""
        for space, address in _written_places(cpu):
            if self._holds(space, address):
                mask = self.mask >> 8 * (address - self.first) & 0xFF
                if mask == 0xFF or (mask and self._changed(cpu, address) & mask):
                    return True
        return False

    def _changed(self, cpu: Cpu, address: int) -> int:
        """The bits of a byte that the next instruction names or changes, by executing it on a copy of the processor."""
        opcode, first, _ = code = _code(cpu)
        if ROW[opcode] in _BIT:
            return 1 << (first & 7)
        if self.space == "xram":
            return cpu.bus.movx_read(address, 0) ^ cpu.sfr(SFRS["ACC"])
        if self._copied is None or self._copied[0] is not cpu or _code(self._copied[2], cpu.pc) != code:
            copy = Cpu()
            copy.load(bytes(cpu.code))
            self._copied = cpu, Flat(cpu), copy, Flat(copy)
        _, state, copy, copied = self._copied
        copied.load(state.save())
        before, executed = self._byte(copy, address), copy.instructions
        copy.step()
        return before ^ self._byte(copy, address) if copy.instructions != executed else 0

    def _byte(self, cpu: Cpu, address: int) -> int:
        return cpu.sfr(address) if self.space == "sfr" else cpu.peek_iram(address)

    def _holds(self, space: str, address: int) -> bool:
        return space == self.space and self.first <= address < self.end

    def _may(self, code: bytes, address: int, on_stack: bool) -> bool:
        opcode, first, second = code[address], code[(address + 1) & 0xFFFF], code[(address + 2) & 0xFFFF]
        row = ROW[opcode]
        direct = _direct(row, first, second)
        if _moves_sp(opcode) and self._holds("sfr", _SP):
            return True
        if direct >= 0:
            return self._holds(*_at(direct))
        if row in _REGISTER:
            return self.space == "iram" and self.first < _BANKS
        if row in _INDIRECT or (on_stack and (row == _PUSH or is_call(opcode))):
            return self.space == "iram"
        return row in (_MOVX_DPTR, _MOVX_PAGE) and self.space == "xram"

    def _may_read(self, code: bytes, address: int, on_stack: bool) -> bool:
        first = code[(address + 1) & 0xFFFF]
        for word in READS_BY_ROW[ROW[code[address]]]:
            if word in ("dir", "src", "bit", "/bit"):
                direct = byte_of_bit(first) if "bit" in word else first
                may = self._holds(*_at(direct))
            elif word in ("Rn", "Ri"):
                may = self.space == "iram" and self.first < _BANKS
            elif word == "@Ri" or word.startswith("@SP"):
                may = self.space == "iram" and (on_stack or word == "@Ri")
            else:
                may = (self.space == "xram" and word[0] == "x") or (self.space == "code" and word[:2] == "@A")
            if may:
                return True
        return False


def _code(cpu: Cpu, pc: int = -1) -> tuple[int, int, int]:
    """The bytes of the instruction at `pc`, or the next one."""
    place = cpu.pc if pc < 0 else pc
    return cpu.code_at(place), cpu.code_at((place + 1) & 0xFFFF), cpu.code_at((place + 2) & 0xFFFF)


def _written_places(cpu: Cpu) -> list[tuple[str, int]]:
    """The bytes that the next instruction writes, or of which it writes a bit."""
    opcode, first, second = _code(cpu)
    row = ROW[opcode]
    if row == _JBC and not cpu_bit(cpu, first):
        return []
    direct = _direct(row, first, second)
    if _moves_sp(opcode):
        pushed = [("iram", (cpu.sp + at) & 0xFF) for at in range(1, 2 if row == _PUSH else 3)]
        written = [_at(direct)] if direct >= 0 else pushed if row not in _RETURNS else []
        return [*written, ("sfr", _SP)]
    if direct >= 0:
        return [_at(direct)]
    if row in _REGISTER:
        return [("iram", cpu.bank + (opcode & 7))]
    if row in _INDIRECT:
        return [("iram", cpu.peek_iram(cpu.bank + (opcode & 1)))]
    if row == _MOVX_DPTR:
        return [("xram", cpu.dptr)]
    if row == _MOVX_PAGE:
        return [("xram", cpu.sfr(_P2) << 8 | cpu.peek_iram(cpu.bank + (opcode & 1)))]
    return []


def _read_places(cpu: Cpu) -> Iterator[tuple[str, int, int]]:
    """(memory, address, bits) of what the next instruction reads."""
    opcode, first, _ = _code(cpu)
    register = cpu.bank + (opcode & 1)
    for word in READS_BY_ROW[ROW[opcode]]:
        if word in ("dir", "src"):
            yield (*_at(first), 0xFF)
        elif word in ("bit", "/bit"):
            yield (*_at(byte_of_bit(first)), 1 << (first & 7))
        elif word in ("Rn", "Ri"):
            yield "iram", cpu.bank + (opcode & 7) if word == "Rn" else register, 0xFF
        elif word == "@Ri":
            yield "iram", cpu.peek_iram(register), 0xFF
        elif word.startswith("@SP"):
            yield "iram", (cpu.sp - (word == "@SP-1")) & 0xFF, 0xFF
        elif word == "x@DPTR":
            yield "xram", cpu.dptr, 0xFF
        elif word == "x@Ri":
            yield "xram", cpu.sfr(_P2) << 8 | cpu.peek_iram(register), 0xFF
        elif word in ("@A+DPTR", "@A+PC") and opcode != _JMP:
            base = cpu.dptr if word == "@A+DPTR" else cpu.pc + 1
            yield "code", (cpu.sfr(SFRS["ACC"]) + base) & 0xFFFF, 0xFF


def _moves_sp(opcode: int) -> bool:
    """True if it pushes or pops."""
    return ROW[opcode] in (_PUSH, _POP, *_RETURNS) or is_call(opcode)


def _at(direct: int) -> tuple[str, int]:
    """Space and address of a direct address."""
    return ("iram" if direct < _FIRST_SFR else "sfr"), direct


def _direct(row: int, first: int, second: int) -> int:
    """The direct address that an instruction writes, -1 for none; of a bit, that of its byte."""
    if row == _MOV_DIRECT:
        return second
    if row in _BIT:
        return byte_of_bit(first)
    return first if row in _DIRECT else -1


def cpu_bit(cpu: Cpu, bit: int) -> int:
    """The bit at a bit address, of a port its latch."""
    address = byte_of_bit(bit)
    return (cpu.sfr(address) if bit >= _FIRST_SFR else cpu.peek_iram(address)) >> (bit & 7) & 1


def instructions_of(code: bytes, used: Iterable[tuple[int, int]], known: Iterable[int]) -> set[int]:
    """Possible starts of instructions: the `known` ones, and those that follow each of them."""
    addresses: set[int] = set()
    loaded = [range(first, end) for first, end in used]
    waiting = sorted({*known, *(span.start for span in loaded)})
    for address in waiting:
        while address not in addresses and any(address in span for span in loaded):
            addresses.add(address)
            address += LENGTH[code[address]]
    return addresses
