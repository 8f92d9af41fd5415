"""A small assembler for tests, driven by the instruction table itself.

Lines are `label:`, or an instruction as the data sheet writes it: `MOV A,#12h`, `JNB TF0,wait`, `MOV R3,40h`.
Numbers are decimal or end in h; names of registers and bits are those of the AT89C52.
"""

from __future__ import annotations

import re

from miro_robot.mcs51.opcodes import TABLE

SFRS = {
    "P0": 0x80, "SP": 0x81, "DPL": 0x82, "DPH": 0x83, "PCON": 0x87, "TCON": 0x88, "TMOD": 0x89,
    "TL0": 0x8A, "TL1": 0x8B, "TH0": 0x8C, "TH1": 0x8D, "P1": 0x90, "SCON": 0x98, "SBUF": 0x99,
    "P2": 0xA0, "IE": 0xA8, "P3": 0xB0, "IP": 0xB8, "T2CON": 0xC8, "T2MOD": 0xC9, "RCAP2L": 0xCA,
    "RCAP2H": 0xCB, "TL2": 0xCC, "TH2": 0xCD, "PSW": 0xD0, "ACC": 0xE0, "B": 0xF0,
}  # fmt: skip
BITS = {
    "IT0": 0x88, "IE0": 0x89, "IT1": 0x8A, "IE1": 0x8B, "TR0": 0x8C, "TF0": 0x8D, "TR1": 0x8E, "TF1": 0x8F,
    "RI": 0x98, "TI": 0x99, "RB8": 0x9A, "TB8": 0x9B, "REN": 0x9C, "SM2": 0x9D,
    "EX0": 0xA8, "ET0": 0xA9, "EX1": 0xAA, "ET1": 0xAB, "ES": 0xAC, "ET2": 0xAD, "EA": 0xAF,
    "PX0": 0xB8, "PT0": 0xB9, "PX1": 0xBA, "PT1": 0xBB, "PS": 0xBC, "PT2": 0xBD,
    "TR2": 0xCA, "EXF2": 0xCE, "TF2": 0xCF,
    "RS0": 0xD3, "RS1": 0xD4, "OV": 0xD2, "AC": 0xD6, "CY": 0xD7, "RXD": 0xB0, "TXD": 0xB1,
}  # fmt: skip
KEYWORDS = {"A", "C", "AB", "DPTR", "@DPTR", "@A+DPTR", "@A+PC"}


def assemble(text: str, origin: int = 0) -> bytes:
    """Machine code of the lines, for loading at `origin`."""
    lines = [line.split(";")[0].strip() for line in text.splitlines()]
    labels: dict[str, int] = {}
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
    return bytes(code)


def _instruction(line: str, here: int, labels: dict[str, int]) -> bytes:
    mnemonic, _, rest = line.partition(" ")
    operands = [part.strip() for part in rest.split(",")] if rest else []
    for first, _count, _step, name, pattern, length, _cycles in TABLE:
        kinds = pattern.split(",") if pattern else []
        if name == mnemonic and len(kinds) == len(operands):
            if all(_fits(kind, operand) for kind, operand in zip(kinds, operands, strict=True)):
                return _encode(first, length, dict(zip(kinds, operands, strict=True)), here, labels)
    raise ValueError(f"no instruction {line!r}")


def _fits(kind: str, operand: str) -> bool:
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


def _encode(opcode: int, length: int, operands: dict[str, str], here: int, labels: dict[str, int]) -> bytes:
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


def _bit(text: str, labels: dict[str, int]) -> int:
    if "." in text:
        byte, _, number = text.partition(".")
        address = _number(byte, labels, SFRS)
        return (address if address >= 0x80 else (address - 0x20) << 3) + int(number)
    return _number(text, labels, BITS)


def _number(text: str, labels: dict[str, int], names: dict[str, int] | None = None) -> int:
    if names and text in names:
        return names[text]
    if re.fullmatch(r"[0-9A-F]+h", text):
        return int(text[:-1], 16)
    return int(text) if re.fullmatch(r"-?\d+", text) else labels.get(text, 0)
