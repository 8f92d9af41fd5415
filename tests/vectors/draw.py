"""Random machine states for single-step vectors: `python -m tests.vectors.draw --out DIR` writes a file per opcode.

The format and the execution are in `single_step.py`. The source of chance is a function given by the caller: `draw(n)`
returns an integer from 0 to n - 1.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from itertools import count
from pathlib import Path

from miro_exact.rng import Stream
from miro_robot.mcs51.opcodes import LENGTH, ROW, TABLE, disassemble
from tests.vectors.single_step import (
    MOVC,
    MOVX,
    PORTS,
    REGISTERS,
    State,
    Vector,
    VectorRunner,
    encode,
    table_address,
)

Draw = Callable[[int], int]

_P0, _SP, _DPL, _DPH, _PCON, _TCON, _TMOD, _P1 = 0x80, 0x81, 0x82, 0x83, 0x87, 0x88, 0x89, 0x90
_SCON, _P2, _IE, _P3, _IP, _T2CON, _PSW, _ACC, _B = 0x98, 0xA0, 0xA8, 0xB0, 0xB8, 0xC8, 0xD0, 0xE0, 0xF0
_ALWAYS = (_P0, _SP, _DPL, _DPH, _P1, _P2, _P3, _PSW, _ACC, _B)
_HIGH = {_P0: 0x00, _P1: 0x03, _P2: 0x00, _P3: 0x3D}  # pins with a second function rest high
_MAY = {  # bits of the other registers that may be set while everything rests; default: all
    _PCON: 0x8C,  # not idle, no power-down, no absent bits
    _TCON: 0xAF,  # timers stand
    _SCON: 0xEF,  # receiver off
    _IE: 0x3F,  # no interrupt in place of the instruction
    _IP: 0x3F,
    _T2CON: 0xF3,
}
_OPERANDS = {row[0]: row[4].split(",") for row in TABLE}
_CALLS = (0x11, 0x12)  # rows
_RETURNS = (0x22, 0x32)
_PUSH, _POP = 0xC0, 0xD0
_DECOYS = 2  # bytes of internal RAM that should stay as they are
_SWITCHED_OFF = 0x03  # PCON: the core stands, and there is no end to compare


class _Drawing:
    """One initial state in the making."""

    def __init__(self, opcode: int, draw: Draw) -> None:
        self.opcode = opcode
        self.row = ROW[opcode]
        self.operands = _OPERANDS[self.row]
        self.draw = draw
        self.sfr: dict[int, int] = {}
        self.iram: dict[int, int] = {}
        self.xram: dict[int, int] = {}
        self.pins: dict[int, int] = {}

    def state(self) -> State:
        pc = self.draw(0x10000)
        self._core()
        for _ in range(_DECOYS):
            self._byte(self.draw(256))
        code = [self.opcode, *self._operand_bytes(), self.draw(256)]
        self._stack()
        self._registers()
        self._external()
        state = State(
            pc=pc,
            sfr=sorted(self.sfr.items()),
            iram=sorted(self.iram.items()),
            xram=sorted(self.xram.items()),
            pins=sorted(self.pins.items()),
            code=sorted(((pc + offset) & 0xFFFF, value) for offset, value in enumerate(code)),
        )
        return state if self.opcode not in MOVC else self._with_table(state)

    def _core(self) -> None:
        for address in _ALWAYS:
            self.sfr[address] = self.draw(256) | _HIGH.get(address, 0)
        if self.opcode in MOVX:
            self.sfr[_P3] |= 0xC0  # else there are no strobes
        if self.draw(8) == 0:
            self.sfr[_B] = 0
        self.sfr[_PSW] = self.sfr[_PSW] & 0xFE | self.sfr[_ACC].bit_count() & 1

    def _byte(self, address: int) -> int:
        """A random byte of internal RAM; its value."""
        self.iram[address] = self.draw(256)
        return self.iram[address]

    def _operand_bytes(self) -> list[int]:
        """What follows the opcode."""
        length = LENGTH[self.opcode]
        if self.row == 0x85:
            return [self._direct(), self._direct()]
        found = []
        for operand in self.operands:
            if operand == "dir":
                found.append(self._direct())
            elif operand.strip("/") == "bit":
                found.append(self._bit())
        found += [self.draw(256) for _ in range(length - 1 - len(found))]
        return found

    def _direct(self) -> int:
        """A direct address: RAM or register in equal parts."""
        if self.draw(2):
            return self._special(REGISTERS[self.draw(len(REGISTERS))])
        address = self.draw(0x80)
        self._byte(address)
        return address

    def _bit(self) -> int:
        if self.draw(2):
            bit = self.draw(0x80)
            self._byte(0x20 + (bit >> 3))
            return bit
        addressable = [address for address in REGISTERS if address & 7 == 0]
        return self._special(addressable[self.draw(len(addressable))]) | self.draw(8)

    def _special(self, address: int) -> int:
        if address in PORTS:
            self.pins[address] = self.draw(256) | _HIGH[address]
        elif address not in self.sfr:
            value = self.draw(256) & _MAY.get(address, 0xFF)
            if address == _TCON:  # IE0 and IE1 stay only in edge mode
                value &= 0xF5 | (value & 0x05) << 1
            if address == _TMOD and value & 0x03 == 0x03:  # timer 1 would run beside mode 3
                value ^= 0x01
            self.sfr[address] = value
        return address

    def _stack(self) -> None:
        sp = self.sfr[_SP]
        if self.row in _CALLS:
            self._byte((sp + 1) & 0xFF)
            self._byte((sp + 2) & 0xFF)
        elif self.row in _RETURNS:
            self._byte(sp)
            self._byte((sp - 1) & 0xFF)
        elif self.row == _PUSH:
            self._byte((sp + 1) & 0xFF)
        elif self.row == _POP:
            self._byte(sp)

    def _registers(self) -> None:
        """Rn, or Ri and what it points at."""
        bank = self.sfr[_PSW] & 0x18
        if "Rn" in self.operands:
            self._byte(bank + (self.opcode & 7))
        elif "@Ri" in self.operands:
            pointer = bank + (self.opcode & 1)
            address = self._byte(pointer)
            if self.opcode not in MOVX and address != pointer:
                self._byte(address)

    def _external(self) -> None:
        if self.opcode in MOVX:
            if self.opcode in (0xE0, 0xF0):
                address = self.sfr[_DPH] << 8 | self.sfr[_DPL]
            else:
                pointer = (self.sfr[_PSW] & 0x18) + (self.opcode & 1)
                address = self.sfr[_P2] << 8 | self.iram[pointer]
            self.xram[address] = self.draw(256)

    def _with_table(self, state: State) -> State:
        code = dict(state.code)
        code.setdefault(table_address(state), self.draw(256))
        return State(state.pc, state.sfr, state.iram, state.xram, state.pins, sorted(code.items()))


def draw_vectors(opcode: int, number: int, draw: Draw) -> list[Vector]:
    """`number` vectors of one opcode; their results are those of our CPU."""
    bench = VectorRunner()
    found: list[Vector] = []
    while len(found) < number:
        initial = _Drawing(opcode, draw).state()
        final, cycles = bench.run(initial)
        if _is_defined(final):
            found.append(Vector(_name(initial), initial, final, cycles))
    return found


def _is_defined(final: State) -> bool:
    """Not for states that end the clock, or that the next S5P2 changes: IEx set by software in level mode."""
    sfr = dict(final.sfr)
    flags = sfr.get(_TCON, 0)
    return not sfr.get(_PCON, 0) & _SWITCHED_OFF and not (flags >> 1) & ~flags & 0x05


def _name(state: State) -> str:
    """The instruction's bytes and its text."""
    code = bytearray(0x10000)
    for address, value in state.code:
        code[address] = value
    size = LENGTH[code[state.pc]]
    raw = " ".join(f"{code[(state.pc + offset) & 0xFFFF]:02x}" for offset in range(size))
    return f"{raw}  {disassemble(bytes(code), state.pc)}"


def write(folder: Path, per_opcode: int = 8, seed: int = 1) -> None:
    """Writes 00.json to ff.json. The same seed writes the same bytes; more vectors per opcode only add to them."""
    folder.mkdir(parents=True, exist_ok=True)
    for opcode in range(0x100):
        word = map(Stream(seed, f"vectors/mcs51/{opcode:02x}").u32, count())
        vectors = draw_vectors(opcode, per_opcode, lambda n, word=word: next(word) * n >> 32)
        (folder / f"{opcode:02x}.json").write_bytes(encode(vectors))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--per-opcode", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    write(options.out, options.per_opcode, options.seed)
