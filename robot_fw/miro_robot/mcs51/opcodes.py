"""The instruction set, one line per instruction: its name, its operands, its length and its time.

And the names of registers and bits, and how an operand is written. What an instruction does is in `cpu.py`. With
the symbols of an image, `miro_robot.inspect.symbol_names` writes operands. Source: Atmel 8051 Hardware Manual,
instruction table and 2.1; AT89C52 data sheet, SFR map.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

SFRS = {
    "P0": 0x80, "SP": 0x81, "DPL": 0x82, "DPH": 0x83, "PCON": 0x87, "TCON": 0x88, "TMOD": 0x89,
    "TL0": 0x8A, "TL1": 0x8B, "TH0": 0x8C, "TH1": 0x8D, "P1": 0x90, "SCON": 0x98, "SBUF": 0x99,
    "P2": 0xA0, "IE": 0xA8, "P3": 0xB0, "IP": 0xB8, "T2CON": 0xC8, "T2MOD": 0xC9, "RCAP2L": 0xCA,
    "RCAP2H": 0xCB, "TL2": 0xCC, "TH2": 0xCD, "PSW": 0xD0, "ACC": 0xE0, "B": 0xF0,
}  # fmt: skip
BITS = {
    "IT0": 0x88, "IE0": 0x89, "IT1": 0x8A, "IE1": 0x8B, "TR0": 0x8C, "TF0": 0x8D, "TR1": 0x8E, "TF1": 0x8F,
    "RI": 0x98, "TI": 0x99, "RB8": 0x9A, "TB8": 0x9B, "REN": 0x9C, "SM2": 0x9D, "SM1": 0x9E, "SM0": 0x9F,
    "EX0": 0xA8, "ET0": 0xA9, "EX1": 0xAA, "ET1": 0xAB, "ES": 0xAC, "ET2": 0xAD, "EA": 0xAF,
    "PX0": 0xB8, "PT0": 0xB9, "PX1": 0xBA, "PT1": 0xBB, "PS": 0xBC, "PT2": 0xBD,
    "RXD": 0xB0, "TXD": 0xB1, "INT0": 0xB2, "INT1": 0xB3, "T0": 0xB4, "T1": 0xB5, "WR": 0xB6, "RD": 0xB7,
    "CP_RL2": 0xC8, "C_T2": 0xC9, "TR2": 0xCA, "EXEN2": 0xCB, "TCLK": 0xCC, "RCLK": 0xCD, "EXF2": 0xCE,
    "TF2": 0xCF, "P": 0xD0, "UD": 0xD1, "OV": 0xD2, "RS0": 0xD3, "RS1": 0xD4, "F0": 0xD5, "AC": 0xD6, "CY": 0xD7,
}  # fmt: skip
INTERRUPTS = ("INT0", "timer 0", "INT1", "timer 1", "serial", "timer 2")
"""The six sources in polling order; the vector of number n is at 8 n + 3."""


def byte_of_bit(bit: int) -> int:
    """The direct address of the byte that a bit address lies in."""
    return bit & 0xF8 if bit & 0x80 else 0x20 + (bit >> 3)


class Names:
    """Operands as the data sheet writes numbers."""

    def code(self, address: int) -> str:
        """A place in code memory (0..FFFFh)."""
        return f"{address:04X}h"

    def direct(self, address: int) -> str:
        """A direct address: internal RAM (0..7Fh) or a special function register (80h..FFh)."""
        return f"{address:02X}h"

    def bit(self, bit: int) -> str:
        """A bit address (0..FFh)."""
        return f"{self.direct(byte_of_bit(bit))}.{bit & 7}"


NUMBERS = Names()

# first opcode, how many, opcode step, mnemonic, operands, bytes, machine cycles.
# Operands: dir direct byte, bit bit address, imm/imm16 constants, rel branch offset, addr11/addr16 targets,
# src/dst the direct bytes of opcode 85, whose source comes first in code.
TABLE: tuple[tuple[int, int, int, str, str, int, int], ...] = (
    (0x00, 1, 1, "NOP", "", 1, 1),
    (0x01, 8, 0x20, "AJMP", "addr11", 2, 2),
    (0x02, 1, 1, "LJMP", "addr16", 3, 2),
    (0x03, 1, 1, "RR", "A", 1, 1),
    (0x04, 1, 1, "INC", "A", 1, 1),
    (0x05, 1, 1, "INC", "dir", 2, 1),
    (0x06, 2, 1, "INC", "@Ri", 1, 1),
    (0x08, 8, 1, "INC", "Rn", 1, 1),
    (0x10, 1, 1, "JBC", "bit,rel", 3, 2),
    (0x11, 8, 0x20, "ACALL", "addr11", 2, 2),
    (0x12, 1, 1, "LCALL", "addr16", 3, 2),
    (0x13, 1, 1, "RRC", "A", 1, 1),
    (0x14, 1, 1, "DEC", "A", 1, 1),
    (0x15, 1, 1, "DEC", "dir", 2, 1),
    (0x16, 2, 1, "DEC", "@Ri", 1, 1),
    (0x18, 8, 1, "DEC", "Rn", 1, 1),
    (0x20, 1, 1, "JB", "bit,rel", 3, 2),
    (0x22, 1, 1, "RET", "", 1, 2),
    (0x23, 1, 1, "RL", "A", 1, 1),
    (0x24, 1, 1, "ADD", "A,#imm", 2, 1),
    (0x25, 1, 1, "ADD", "A,dir", 2, 1),
    (0x26, 2, 1, "ADD", "A,@Ri", 1, 1),
    (0x28, 8, 1, "ADD", "A,Rn", 1, 1),
    (0x30, 1, 1, "JNB", "bit,rel", 3, 2),
    (0x32, 1, 1, "RETI", "", 1, 2),
    (0x33, 1, 1, "RLC", "A", 1, 1),
    (0x34, 1, 1, "ADDC", "A,#imm", 2, 1),
    (0x35, 1, 1, "ADDC", "A,dir", 2, 1),
    (0x36, 2, 1, "ADDC", "A,@Ri", 1, 1),
    (0x38, 8, 1, "ADDC", "A,Rn", 1, 1),
    (0x40, 1, 1, "JC", "rel", 2, 2),
    (0x42, 1, 1, "ORL", "dir,A", 2, 1),
    (0x43, 1, 1, "ORL", "dir,#imm", 3, 2),
    (0x44, 1, 1, "ORL", "A,#imm", 2, 1),
    (0x45, 1, 1, "ORL", "A,dir", 2, 1),
    (0x46, 2, 1, "ORL", "A,@Ri", 1, 1),
    (0x48, 8, 1, "ORL", "A,Rn", 1, 1),
    (0x50, 1, 1, "JNC", "rel", 2, 2),
    (0x52, 1, 1, "ANL", "dir,A", 2, 1),
    (0x53, 1, 1, "ANL", "dir,#imm", 3, 2),
    (0x54, 1, 1, "ANL", "A,#imm", 2, 1),
    (0x55, 1, 1, "ANL", "A,dir", 2, 1),
    (0x56, 2, 1, "ANL", "A,@Ri", 1, 1),
    (0x58, 8, 1, "ANL", "A,Rn", 1, 1),
    (0x60, 1, 1, "JZ", "rel", 2, 2),
    (0x62, 1, 1, "XRL", "dir,A", 2, 1),
    (0x63, 1, 1, "XRL", "dir,#imm", 3, 2),
    (0x64, 1, 1, "XRL", "A,#imm", 2, 1),
    (0x65, 1, 1, "XRL", "A,dir", 2, 1),
    (0x66, 2, 1, "XRL", "A,@Ri", 1, 1),
    (0x68, 8, 1, "XRL", "A,Rn", 1, 1),
    (0x70, 1, 1, "JNZ", "rel", 2, 2),
    (0x72, 1, 1, "ORL", "C,bit", 2, 2),
    (0x73, 1, 1, "JMP", "@A+DPTR", 1, 2),
    (0x74, 1, 1, "MOV", "A,#imm", 2, 1),
    (0x75, 1, 1, "MOV", "dir,#imm", 3, 2),
    (0x76, 2, 1, "MOV", "@Ri,#imm", 2, 1),
    (0x78, 8, 1, "MOV", "Rn,#imm", 2, 1),
    (0x80, 1, 1, "SJMP", "rel", 2, 2),
    (0x82, 1, 1, "ANL", "C,bit", 2, 2),
    (0x83, 1, 1, "MOVC", "A,@A+PC", 1, 2),
    (0x84, 1, 1, "DIV", "AB", 1, 4),
    (0x85, 1, 1, "MOV", "dst,src", 3, 2),
    (0x86, 2, 1, "MOV", "dir,@Ri", 2, 2),
    (0x88, 8, 1, "MOV", "dir,Rn", 2, 2),
    (0x90, 1, 1, "MOV", "DPTR,#imm16", 3, 2),
    (0x92, 1, 1, "MOV", "bit,C", 2, 2),
    (0x93, 1, 1, "MOVC", "A,@A+DPTR", 1, 2),
    (0x94, 1, 1, "SUBB", "A,#imm", 2, 1),
    (0x95, 1, 1, "SUBB", "A,dir", 2, 1),
    (0x96, 2, 1, "SUBB", "A,@Ri", 1, 1),
    (0x98, 8, 1, "SUBB", "A,Rn", 1, 1),
    (0xA0, 1, 1, "ORL", "C,/bit", 2, 2),
    (0xA2, 1, 1, "MOV", "C,bit", 2, 1),
    (0xA3, 1, 1, "INC", "DPTR", 1, 2),
    (0xA4, 1, 1, "MUL", "AB", 1, 4),
    (0xA5, 1, 1, "?", "", 1, 1),  # undefined: a one-cycle NOP and a firmware fault
    (0xA6, 2, 1, "MOV", "@Ri,dir", 2, 2),
    (0xA8, 8, 1, "MOV", "Rn,dir", 2, 2),
    (0xB0, 1, 1, "ANL", "C,/bit", 2, 2),
    (0xB2, 1, 1, "CPL", "bit", 2, 1),
    (0xB3, 1, 1, "CPL", "C", 1, 1),
    (0xB4, 1, 1, "CJNE", "A,#imm,rel", 3, 2),
    (0xB5, 1, 1, "CJNE", "A,dir,rel", 3, 2),
    (0xB6, 2, 1, "CJNE", "@Ri,#imm,rel", 3, 2),
    (0xB8, 8, 1, "CJNE", "Rn,#imm,rel", 3, 2),
    (0xC0, 1, 1, "PUSH", "dir", 2, 2),
    (0xC2, 1, 1, "CLR", "bit", 2, 1),
    (0xC3, 1, 1, "CLR", "C", 1, 1),
    (0xC4, 1, 1, "SWAP", "A", 1, 1),
    (0xC5, 1, 1, "XCH", "A,dir", 2, 1),
    (0xC6, 2, 1, "XCH", "A,@Ri", 1, 1),
    (0xC8, 8, 1, "XCH", "A,Rn", 1, 1),
    (0xD0, 1, 1, "POP", "dir", 2, 2),
    (0xD2, 1, 1, "SETB", "bit", 2, 1),
    (0xD3, 1, 1, "SETB", "C", 1, 1),
    (0xD4, 1, 1, "DA", "A", 1, 1),
    (0xD5, 1, 1, "DJNZ", "dir,rel", 3, 2),
    (0xD6, 2, 1, "XCHD", "A,@Ri", 1, 1),
    (0xD8, 8, 1, "DJNZ", "Rn,rel", 2, 2),
    (0xE0, 1, 1, "MOVX", "A,@DPTR", 1, 2),
    (0xE2, 2, 1, "MOVX", "A,@Ri", 1, 2),
    (0xE4, 1, 1, "CLR", "A", 1, 1),
    (0xE5, 1, 1, "MOV", "A,dir", 2, 1),
    (0xE6, 2, 1, "MOV", "A,@Ri", 1, 1),
    (0xE8, 8, 1, "MOV", "A,Rn", 1, 1),
    (0xF0, 1, 1, "MOVX", "@DPTR,A", 1, 2),
    (0xF2, 2, 1, "MOVX", "@Ri,A", 1, 2),
    (0xF4, 1, 1, "CPL", "A", 1, 1),
    (0xF5, 1, 1, "MOV", "dir,A", 2, 1),
    (0xF6, 2, 1, "MOV", "@Ri,A", 1, 1),
    (0xF8, 8, 1, "MOV", "Rn,A", 1, 1),
)


def _by_opcode(column: int) -> bytes:
    """One column of the table, expanded to the 256 opcodes."""
    spread = bytearray(256)
    for row in TABLE:
        first, count, step = row[:3]
        for number in range(count):
            value = row[column]
            assert isinstance(value, int)
            spread[first + number * step] = value
    return bytes(spread)


ROW = _by_opcode(0)  # opcode -> first opcode of its line in TABLE
LENGTH = _by_opcode(5)
CYCLES = _by_opcode(6)
LINE = tuple(ROW[opcode] | CYCLES[opcode] << 8 | LENGTH[opcode] << 13 for opcode in range(256))
"""The same in one word, for the loop that executes them: bits 7:0 row, 10:8 cycles, 15:13 length. Bits 12:11 mark what
is no opcode. The core keeps bits 12:0 for each address, and in bits 31:16 the address after the instruction."""
_AJMP, _LJMP, _ACALL, _LCALL = 0x01, 0x02, 0x11, 0x12
_SJMP = 0x80
_LEAVING = (_LJMP, 0x22, 0x32, 0x73, _SJMP)  # and RET, RETI, JMP @A+DPTR
_TEXT = {row[0]: (row[3], row[4]) for row in TABLE}


def disassemble(code: bytes | bytearray, address: int, names: Names = NUMBERS) -> str:
    """The instruction at `address` of a 64 KB image in the notation of the data sheet, targets absolute."""
    opcode, first, second = (code[(address + offset) & 0xFFFF] for offset in range(3))
    mnemonic, operands = _TEXT[ROW[opcode]]
    after = (address + LENGTH[opcode]) & 0xFFFF
    last = second if LENGTH[opcode] == 3 else first
    constant = second if "dir,#" in operands else first
    words = {
        "addr16": lambda: names.code(first << 8 | second),
        "addr11": lambda: names.code(after & 0xF800 | (opcode & 0xE0) << 3 | first),
        "#imm16": lambda: f"#{first << 8 | second:04X}h",
        "#imm": lambda: f"#{constant:02X}h",
        "rel": lambda: names.code((after + (last ^ 0x80) - 0x80) & 0xFFFF),
        "src": lambda: names.direct(first),
        "dst": lambda: names.direct(second),
        "dir": lambda: names.direct(first),
        "bit": lambda: names.bit(first),
        "/bit": lambda: f"/{names.bit(first)}",
        "Rn": lambda: f"R{opcode & 7}",
        "@Ri": lambda: f"@R{opcode & 1}",
    }
    text = ",".join(words[word]() if word in words else word for word in operands.split(","))
    return f"{mnemonic} {text}".rstrip()


def is_conditional(opcode: int) -> bool:
    """True if the instruction goes one of two ways: JB, JC, JZ, CJNE, DJNZ and their like."""
    mnemonic, operands = _TEXT[ROW[opcode]]
    return operands.endswith("rel") and mnemonic != "SJMP"


def target(code: bytes, address: int) -> int | None:
    """Target of the LCALL, ACALL, LJMP or AJMP at `address`; None for another instruction."""
    opcode, first, second = (code[(address + offset) & 0xFFFF] for offset in range(3))
    return _absolute(opcode, first, second, address)


def jumps_to_itself(code_at: Callable[[int], int], address: int) -> bool:
    """True if an SJMP, LJMP or AJMP stands there that goes where it stands. `code_at(a)`: byte of code memory."""
    opcode, first, second = (code_at((address + offset) & 0xFFFF) for offset in range(3))
    if opcode == _SJMP:
        return first == 0xFE
    return not is_call(opcode) and _absolute(opcode, first, second, address) == address


@lru_cache(16)  # a fuzzer confirms each input on a new board
def jumps_to_themselves(code: bytes, used: tuple[tuple[int, int], ...]) -> tuple[int, ...]:
    """In these ranges (first, end), among them some in the middle of instructions."""
    ranges = (range(first, end) for first, end in used)
    return tuple(at for addresses in ranges for at in addresses if jumps_to_itself(code.__getitem__, at))


def _absolute(opcode: int, first: int, second: int, address: int) -> int | None:
    if opcode in (_LCALL, _LJMP):
        return first << 8 | second
    if ROW[opcode] in (_ACALL, _AJMP):
        return (address + 2) & 0xF800 | (opcode & 0xE0) << 3 | first
    return None


def goes_on(opcode: int) -> bool:
    """True if the instruction after it may be executed next; so it may be after a call."""
    return opcode not in _LEAVING and ROW[opcode] != _AJMP


def is_call(opcode: int) -> bool:
    return ROW[opcode] in (_ACALL, _LCALL)
