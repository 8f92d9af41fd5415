"""A random walk: instructions drawn one by one, each in the machine state its predecessors left.

Code is invented where the walk arrives: a byte of code memory is drawn when it is first fetched (or read by MOVC) and
stays. So each opcode comes up about equally often, in states that the walk itself keeps random. A walk that is
`scattered` is a row of single steps instead: each begins at a random place in a state of `states.py`.
"""

from random import Random
from typing import NamedTuple

from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH
from miro_robot.mcs51.xram import XramBus
from tests.robot.ucsim import states
from tests.robot.ucsim.exclusions import COMPARED, MOVX, P0, allowed, has_bit, has_direct

VISITS = 4  # of one address, before the walk is moved elsewhere
TRIES = 40  # instructions drawn for one place, before the walk is moved elsewhere
# Internal RAM from a table (R0 apart), external RAM from a function of the address.
PROLOGUE = bytes.fromhex(
    "78FF 900100"  # MOV R0,#FFh; MOV DPTR,#table
    "E8 93 F6 D8FB"  # MOV A,R0; MOVC A,@A+DPTR; MOV @R0,A; DJNZ R0
    "900000"  # MOV DPTR,#0
    "E582 75F09D A4 6583 25F0 C4 F0"  # A = swap((low(DPL * 9Dh) ^ DPH) + high(DPL * 9Dh)); MOVX @DPTR,A
    "A3 E582 4583 70ED"  # INC DPTR, until it is 0 again
)
TABLE = 0x0100


class Step(NamedTuple):
    """One instruction and what it has to leave behind."""

    pc_before: int
    opcode: int
    moved: bool  # PC does not follow from the step before
    state: int  # offset of the random state loaded before it; 0: goes on with what the step before left
    movx_changed_p0: bool
    pc: int
    cycles: int
    iram: bytes
    sfr: bytes  # the registers COMPARED


class Walk(NamedTuple):
    """`steps` begin after PROLOGUE has run from 0 to its end; `xram` is what they leave in external RAM."""

    code: bytes
    steps: list[Step]
    xram: bytes


class Walker:
    """Draws one walk; the same seed draws the same walk."""

    def __init__(self, seed, scattered=False):
        self.random = Random(seed)
        self.scattered = scattered
        self.bus = XramBus()
        self.cpu = Cpu(self.bus)
        self.known = bytearray(0x10000)  # bytes of code that exist
        self.visits = bytearray(0x10000)
        for address, value in enumerate(PROLOGUE):
            self._define(address, value)
        for address in range(TABLE, TABLE + 256):
            self._define(address, self.random.randrange(256))
        if scattered:
            loader = states.PROGRAM + b"\x00"
            table = self.random.randbytes(states.TABLE_SIZE)
            for first, content in ((states.AT, loader), (states.TABLE, table)):
                for address, value in enumerate(content, first):
                    self._define(address, value)

    def walk(self, steps):
        cpu = self.cpu
        self._define(len(PROLOGUE), 0)
        cpu.run_until_any((len(PROLOGUE),), 1 << 40)
        done = []
        moved = False
        state = 0
        while len(done) < steps:
            if self.scattered and not moved:
                state = self._scatter()
                moved = True
            pc = cpu.pc
            if self.visits[pc] == VISITS or not self._settle(pc):
                cpu.pc = self.random.randrange(0x10000)
                moved = True
                continue
            done.append(self._step(pc, moved, state))
            moved = False
        return Walk(cpu.code, done, self.bus.xram())

    def _scatter(self):
        """Puts the CPU into a random state at a random place; the state's offset."""
        offset = self.random.choice(states.OFFSETS)
        self.cpu.dptr = offset
        self.cpu.pc = states.AT
        self.cpu.run_until_any((states.END,), 1 << 40)
        self.cpu.pc = self.random.randrange(0x10000)
        return offset

    def _step(self, pc, moved, state):
        cpu = self.cpu
        self.visits[pc] += 1
        opcode = cpu.code_at(pc)
        begin = cpu.cycles
        p0 = cpu.sfr(P0)
        cpu.txd.forget(cpu.txd.settled_tick)  # no listener
        cpu.step()
        iram = bytes([cpu.peek_iram(address) for address in range(256)])
        registers = bytes([cpu.sfr(address) for address in COMPARED])
        changed_p0 = opcode in MOVX and p0 != 0xFF
        return Step(pc, opcode, moved, state, changed_p0, cpu.pc, cpu.cycles - begin, iram, registers)

    def _settle(self, pc):
        """Makes sure there is an instruction at `pc` that may be executed now; False if that is impossible."""
        places = [(pc + offset) & 0xFFFF for offset in range(3)]
        for _ in range(TRIES):
            drawn = self._draw(places)
            if allowed(self.cpu, *drawn):
                for place, value in list(zip(places, drawn, strict=True))[: LENGTH[drawn[0]]]:
                    self._define(place, value)
                self._define_constant(drawn[0])
                return True
            if all(self.known[place] for place in places[: LENGTH[drawn[0]]]):
                return False
        return False

    def _draw(self, places):
        """An instruction that agrees with what is known of these three bytes."""
        draw = self.random.randrange
        opcode, first, second = (
            self.cpu.code_at(place) if self.known[place] else draw(256) for place in places
        )
        if not self.known[places[1]] and (has_direct(opcode) or has_bit(opcode)) and draw(2):
            first = self._register(opcode)
        if not self.known[places[2]] and opcode == 0x85 and draw(2):
            second = self._register(opcode)
        return opcode, first, second

    def _register(self, opcode):
        """A register's address, or that of one of its bits."""
        while True:
            address = COMPARED[self.random.randrange(len(COMPARED))]
            if not has_bit(opcode):
                return address
            if address & 7 == 0:
                return address | self.random.randrange(8)

    def _define_constant(self, opcode):
        """Draws the byte that a MOVC is about to read."""
        cpu = self.cpu
        if opcode == 0x83:
            self._define((cpu.pc + 1 + cpu.a) & 0xFFFF, self.random.randrange(256))
        elif opcode == 0x93:
            self._define((cpu.dptr + cpu.a) & 0xFFFF, self.random.randrange(256))

    def _define(self, address, value):
        if not self.known[address]:
            self.known[address] = 1
            self.cpu.write_code(address, value)
