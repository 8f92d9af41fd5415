"""Single-step vectors: machine state, one instruction, machine state, and what went over the buses.

Drawing random states is in `draw.py`; the README beside this file describes the format to people who use the files.
The form is that of the SingleStepTests collections.
"""

from __future__ import annotations

import msgspec

from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import CYCLES, LENGTH

Cells = list[tuple[int, int]]  # (address, value), ascending
Access = tuple[int, int, str]  # (address, value, kind)

FETCH, DISCARD, TABLE, READ, WRITE, LATCH = "fetch", "discard", "table", "read", "write", "latch"
MOVX = (0xE0, 0xE2, 0xE3, 0xF0, 0xF2, 0xF3)
MOVC = (0x83, 0x93)
_SLOTS = 2  # program fetches in a machine cycle, at S1 and S4 (4316E section 2.4)
PORTS = (0x80, 0x90, 0xA0, 0xB0)
_ACC = 0xE0
RESET = {0x81: 0x07, **dict.fromkeys(PORTS, 255)}  # the other registers: 00
REGISTERS = (
    *(0x80, 0x81, 0x82, 0x83, 0x87, 0x88, 0x89, 0x8A, 0x8B, 0x8C, 0x8D, 0x90, 0x98, 0xA0, 0xA8, 0xB0, 0xB8),
    *(0xC8, 0xCA, 0xCB, 0xCC, 0xCD, 0xD0, 0xE0, 0xF0),
)  # fmt: skip
"""All that a vector can name: not SBUF, which is two registers, and not T2MOD, most of which is undefined."""


class State(msgspec.Struct, frozen=True, omit_defaults=True):
    """Registers, and the memory that matters. Memory not listed is 0, registers not listed are as after reset
    (ports FF, SP 07, others 00). `pins`: what the outside puts on a port, by its address; not listed: FF.
    """

    pc: int
    sfr: Cells
    iram: Cells
    xram: Cells
    pins: Cells = []
    code: Cells = []


class Vector(msgspec.Struct, frozen=True):
    """`final` lists the same registers and memory as `initial`; `cycles` has a list for each machine cycle."""

    name: str
    initial: State
    final: State
    cycles: list[list[Access]]


def encode(vectors: list[Vector]) -> bytes:
    """A file: a JSON array, one vector a line."""
    lines = [msgspec.json.encode(vector) for vector in vectors]
    return b"[\n" + b",\n".join(lines) + b"\n]\n"


def decode(content: bytes) -> list[Vector]:
    """The vectors in a file. Raises msgspec.ValidationError for what is not one."""
    return msgspec.json.decode(content, type=list[Vector])


class _VectorBus(Bus):
    """External RAM of a few bytes, and a record of what happened."""

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.memory: dict[int, int] = {}
        self.accesses: list[Access] = []
        self.latches: list[Access] = []

    def movx_read(self, address: int, tick: int) -> int:
        value = self.memory.get(address, 0)
        self.accesses.append((address, value, READ))
        return value

    def movx_write(self, address: int, value: int, tick: int) -> None:
        self.memory[address] = value
        self.accesses.append((address, value, WRITE))

    def port_written(self, port: int, latch: int, tick: int) -> None:
        self.latches.append((PORTS[port], latch, LATCH))


class VectorRunner:
    """A CPU to carry out vectors on, one after the other."""

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.bus = _VectorBus()
        self.cpu = Cpu(self.bus)

    def run(self, initial: State) -> tuple[State, list[list[Access]]]:
        """What the instruction at `initial.pc` leaves behind, and its bus cycles.

        Raises ValueError if it changed what `initial` does not list.
        """
        self.prepare(initial)
        before = self._registers()
        self.bus.accesses.clear()
        self.bus.latches.clear()
        self.cpu.step()
        after = self._registers()
        iram = [self.cpu.peek_iram(address) for address in range(256)]
        listed = {address for address, _ in initial.sfr}
        strays = [address for address in REGISTERS if before[address] != after[address]]
        known = {address for address, _ in initial.iram}
        lost = [address for address in range(256) if iram[address] and address not in known]
        if lost or not listed.issuperset(strays) or len(self.bus.memory) != len(initial.xram):
            raise ValueError(f"{initial} does not list all that its instruction changes: {strays} {lost}")
        final = State(
            pc=self.cpu.pc,
            sfr=[(address, after[address]) for address, _ in initial.sfr],
            iram=[(address, iram[address]) for address, _ in initial.iram],
            xram=sorted(self.bus.memory.items()),
        )
        cycles = fetches(
            initial
        )  # by rule; then external memory in the second cycle, then latches in the last
        if self.bus.accesses:
            cycles[1] += self.bus.accesses
        cycles[-1] += self.bus.latches
        return final, cycles

    def prepare(self, state: State) -> None:
        """Registers are written by instructions, ACC last; then PC is set."""
        cpu = self.cpu
        cpu.reset()
        content = dict(state.iram)
        for address in range(256):
            cpu.poke_iram(address, content.get(address, 0))
        pins = dict(state.pins)
        for number, port in enumerate(PORTS):
            cpu.set_external(number, pins.get(port, 0xFF), 12 * cpu.cycles)
        for address, value in sorted(state.sfr, key=lambda cell: cell[0] == _ACC):
            self._execute(bytes((0x75, address, value)))
        self._execute(b"\x00")
        self.bus.memory = dict(state.xram)
        for address, value in state.code:
            cpu.write_code(address, value)
        cpu.pc = state.pc

    def _execute(self, instruction: bytes) -> None:
        for address, value in enumerate(instruction):
            self.cpu.write_code(address, value)
        self.cpu.pc = 0
        self.cpu.step()

    def _registers(self) -> dict[int, int]:
        return {address: self.cpu.sfr(address) for address in REGISTERS}


def fetches(state: State) -> list[list[Access]]:
    """The program fetches of each machine cycle: two, at S1 and S4; those not needed are repeated at the byte
    after the instruction and dropped. A MOVX has none in its second cycle; a MOVC reads its table first in
    its second.
    """
    code = dict(state.code)
    opcode = code[state.pc]
    slots = _SLOTS * CYCLES[opcode]
    after = (state.pc + LENGTH[opcode]) & 0xFFFF
    accesses = [(after, code[after], DISCARD)] * slots
    for offset in range(LENGTH[opcode]):
        address = (state.pc + offset) & 0xFFFF
        accesses[offset] = (address, code[address], FETCH)
    if opcode in MOVC:
        address = table_address(state)
        accesses[_SLOTS] = (address, code[address], TABLE)
    elif opcode in MOVX:
        return [accesses[:_SLOTS], []]
    return [accesses[first : first + _SLOTS] for first in range(0, slots, _SLOTS)]


def table_address(state: State) -> int:
    """Where a MOVC reads."""
    registers = {**RESET, **dict(state.sfr)}
    opcode = dict(state.code)[state.pc]
    base = state.pc + 1 if opcode == 0x83 else registers.get(0x83, 0) << 8 | registers.get(0x82, 0)
    return (base + registers.get(_ACC, 0)) & 0xFFFF
