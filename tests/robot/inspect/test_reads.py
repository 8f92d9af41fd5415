"""Which bytes of internal RAM an instruction reads: those that, changed, change what it does."""

import random

import pytest

from miro_exact.state import Flat
from miro_robot.inspect.writes import Bytes
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import TABLE

TRIALS = 16
MOV_A_DATA, CPL_C = (0x74, 0), 0xB3
UNSHOWN = (0xE2, 0xF2, 0x42, 0x43, 0x52, 0x53)
"""MOVX by R0 and R1, as this processor has no external RAM; ORL and ANL of a byte, which keep a bit or set it."""


def standing(opcode, seed):
    """A processor before an instruction with random operands, accumulator, carry and memory; and a copy of it."""
    chance = random.Random(1000 * opcode + seed)
    begin = bytes((MOV_A_DATA[0], chance.randrange(256), *([CPL_C] if seed % 2 else [])))
    code = begin + bytes([opcode, chance.choice((chance.randrange(0x80), 7)), chance.randrange(0x80)])
    cpus = [Cpu(), Cpu()]
    for cpu in cpus:
        cpu.load(code.ljust(0x10000, b"\0"))
    for place in range(0x100):
        cpus[0].poke_iram(place, chance.choice((place, chance.randrange(256), 0xFF)))
    while cpus[0].pc < len(begin):
        cpus[0].step()
    return cpus


def matters(cpu, copy, place):
    """Whether another value of a byte makes the instruction do something else with anything but that value."""
    state, copied, results = Flat(cpu).save(), Flat(copy), []
    for mask in (0x00, 0xFF):
        copied.load(state)
        value = copy.peek_iram(place) ^ mask
        copy.poke_iram(place, value)
        copy.step()
        left = copy.peek_iram(place)
        copy.poke_iram(place, 0)
        results.append((copied.save(), left, left ^ value))
    (after, left, changed), (other_after, other_left, other_changed) = results
    constant, kept = ~(left ^ other_left), ~(changed | other_changed)
    return after != other_after or (constant | kept) & 0xFF != 0xFF


@pytest.mark.parametrize("opcode", [row[0] for row in TABLE if row[3] != "?"])
def test_an_instruction_reads_the_bytes_that_matter_to_it(opcode):
    reads, shown = False, False
    for seed in range(TRIALS):
        cpu, copy = standing(opcode, seed)
        operands = [cpu.code_at(cpu.pc + at) for at in (1, 2)]
        bits = [0x20 + (operand >> 3) for operand in operands if operand < 0x80]
        read = {place for place in range(0x100) if Bytes("iram", place, 1).are_read(cpu)}
        near = {*range(8), *operands, *bits, cpu.sp, cpu.sp - 1, cpu.peek_iram(0), cpu.peek_iram(1), *read}
        matter = {place for place in near if matters(cpu, copy, place)}
        assert matter <= read
        for place in read:
            assert Bytes("iram", place, 1).readers(bytes(cpu.code), [cpu.pc]) == {cpu.pc}
        reads |= bool(read)
        shown |= bool(matter)
    assert reads == shown or opcode in UNSHOWN
