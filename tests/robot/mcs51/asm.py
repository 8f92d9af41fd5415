"""A small assembler for tests, driven by the instruction table itself.

Lines are `label:`, or an instruction as the data sheet writes it: `MOV A,#12h`, `JNB TF0,wait`, `MOV R3,40h`.
Numbers are decimal or end in h; names of registers and bits are those of the AT89C52.
"""

import re
from hashlib import sha256
from pathlib import Path

from miro_robot.image import SPACE_BYTES, Image, Symbols
from miro_robot.mcs51.opcodes import BITS, SFRS, TABLE

KEYWORDS = {"A", "C", "AB", "DPTR", "@DPTR", "@A+DPTR", "@A+PC"}


def assemble(text, origin=0):
    """Machine code of the lines, for loading at `origin`."""
    return _two_passes(text, origin)[0]


def labels_of(text, origin=0):
    """The addresses of the labels."""
    return _two_passes(text, origin)[1]


def image_of(program, symbols=None):
    """The image of machine code, or of lines to be assembled."""
    code = assemble(program) if isinstance(program, str) else program
    return Image(
        path=Path("test.ihx"),
        code=code.ljust(SPACE_BYTES, b"\xff"),
        used=((0, len(code)),),
        size=len(code),
        sha256=sha256(code).hexdigest(),
        symbols=Symbols(symbols or {}),
    )


def hex_text(code, at=0):
    """Machine code as Intel HEX, 16 bytes a record."""
    records = []
    for first in range(0, len(code), 16):
        data = code[first : first + 16]
        body = bytes([len(data)]) + (at + first).to_bytes(2, "big") + b"\0" + data
        records.append(f":{body.hex().upper()}{-sum(body) & 0xFF:02X}\n")
    return "".join(records) + ":00000001FF\n"


def _two_passes(text, origin):
    lines = [line.split(";")[0].strip() for line in text.splitlines()]
    labels = {}
    for _ in range(2):  # the first pass finds the labels
        code = bytearray()
        for line in lines:
            here = origin + len(code)
            if line.endswith(":"):
                labels[line[:-1]] = here
            elif line.startswith("DB "):
                code += bytes(_number(part, labels) & 0xFF for part in line[3:].split(","))
            elif line.startswith("ORG "):
                code += bytes(_number(line[4:], labels) - here)
            elif line:
                code += _instruction(line, here, labels)
    return bytes(code), labels


def _instruction(line, here, labels):
    mnemonic, _, rest = line.partition(" ")
    operands = [part.strip() for part in rest.split(",")] if rest else []
    for first, _count, _step, name, pattern, length, _cycles in TABLE:
        kinds = pattern.split(",") if pattern else []
        if name == mnemonic and len(kinds) == len(operands):
            if all(_fits(kind, operand) for kind, operand in zip(kinds, operands, strict=True)):
                return _encode(first, length, dict(zip(kinds, operands, strict=True)), here, labels)
    raise ValueError(f"no instruction {line!r}")


def _fits(kind, operand):
    if kind in KEYWORDS or operand in KEYWORDS:
        return kind == operand
    if kind == "Rn":
        return operand in {f"R{number}" for number in range(8)}
    if kind == "@Ri":
        return operand in ("@R0", "@R1")
    if kind in ("#imm", "#imm16"):
        return operand.startswith("#")
    if kind == "/bit":
        return operand.startswith("/")
    return operand[0] not in "@#/" and not (operand[0] == "R" and operand[1:].isdigit())


def _encode(opcode, length, operands, here, labels):
    tail = bytearray()
    for kind in sorted(operands, key=lambda kind: {"src": 0, "dst": 1}.get(kind, 0)):
        operand = operands[kind]
        if kind == "Rn" or kind == "@Ri":
            opcode |= int(operand[-1])
        elif kind in ("dir", "src", "dst"):
            tail.append(_number(operand, labels, SFRS))
        elif kind in ("bit", "/bit"):
            tail.append(_bit(operand.lstrip("/"), labels))
        elif kind == "#imm":
            tail.append(_number(operand[1:], labels) & 0xFF)
        elif kind in ("#imm16", "addr16"):
            tail += _number(operand.lstrip("#"), labels).to_bytes(2, "big")
        elif kind == "addr11":
            target = _number(operand, labels)
            opcode |= target >> 3 & 0xE0
            tail.append(target & 0xFF)
        elif kind == "rel":
            target = here if operand == "$" else _number(operand, labels)
            tail.append((target - here - length) & 0xFF)
    return bytes([opcode]) + bytes(tail)


def _bit(text, labels):
    if "." in text:
        byte, _, number = text.partition(".")
        address = _number(byte, labels, SFRS)
        return (address if address >= 0x80 else (address - 0x20) << 3) + int(number)
    return _number(text, labels, BITS)


def _number(text, labels, names=None):
    if names and text in names:
        return names[text]
    if re.fullmatch(r"[0-9A-F]+h", text):
        return int(text[:-1], 16)
    return int(text) if re.fullmatch(r"-?\d+", text) else labels.get(text, 0)
