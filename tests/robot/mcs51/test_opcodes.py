"""The instruction table against the byte and cycle maps of the data sheet, and against the CPU that runs it."""

import pytest

from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import CYCLES, LENGTH, ROW, TABLE, disassemble
from tests.robot.mcs51.rig import RecordingBus

BYTES_MAP = """
1 2 3 1 1 2 1 1 1 1 1 1 1 1 1 1
3 2 3 1 1 2 1 1 1 1 1 1 1 1 1 1
3 2 1 1 2 2 1 1 1 1 1 1 1 1 1 1
3 2 1 1 2 2 1 1 1 1 1 1 1 1 1 1
2 2 2 3 2 2 1 1 1 1 1 1 1 1 1 1
2 2 2 3 2 2 1 1 1 1 1 1 1 1 1 1
2 2 2 3 2 2 1 1 1 1 1 1 1 1 1 1
2 2 2 1 2 3 2 2 2 2 2 2 2 2 2 2
2 2 2 1 1 3 2 2 2 2 2 2 2 2 2 2
3 2 2 1 2 2 1 1 1 1 1 1 1 1 1 1
2 2 2 1 1 1 2 2 2 2 2 2 2 2 2 2
2 2 2 1 3 3 3 3 3 3 3 3 3 3 3 3
2 2 2 1 1 2 1 1 1 1 1 1 1 1 1 1
2 2 2 1 1 3 1 1 2 2 2 2 2 2 2 2
1 2 1 1 1 2 1 1 1 1 1 1 1 1 1 1
1 2 1 1 1 2 1 1 1 1 1 1 1 1 1 1
"""
CYCLES_MAP = """
1 2 2 1 1 1 1 1 1 1 1 1 1 1 1 1
2 2 2 1 1 1 1 1 1 1 1 1 1 1 1 1
2 2 2 1 1 1 1 1 1 1 1 1 1 1 1 1
2 2 2 1 1 1 1 1 1 1 1 1 1 1 1 1
2 2 1 2 1 1 1 1 1 1 1 1 1 1 1 1
2 2 1 2 1 1 1 1 1 1 1 1 1 1 1 1
2 2 1 2 1 1 1 1 1 1 1 1 1 1 1 1
2 2 2 2 1 2 1 1 1 1 1 1 1 1 1 1
2 2 2 2 4 2 2 2 2 2 2 2 2 2 2 2
2 2 2 2 1 1 1 1 1 1 1 1 1 1 1 1
2 2 1 2 4 1 2 2 2 2 2 2 2 2 2 2
2 2 1 1 2 2 2 2 2 2 2 2 2 2 2 2
2 2 1 1 1 1 1 1 1 1 1 1 1 1 1 1
2 2 1 1 1 2 1 1 2 2 2 2 2 2 2 2
2 2 2 2 1 1 1 1 1 1 1 1 1 1 1 1
2 2 2 2 1 1 1 1 1 1 1 1 1 1 1 1
"""
JUMPS = {"AJMP", "LJMP", "ACALL", "LCALL", "RET", "RETI", "SJMP", "JMP"}


def test_lengths_are_those_of_the_data_sheet():
    assert list(LENGTH) == [int(field) for field in BYTES_MAP.split()]


def test_cycles_are_those_of_the_data_sheet():
    assert list(CYCLES) == [int(field) for field in CYCLES_MAP.split()]
    assert [list(CYCLES).count(number) for number in (1, 2, 4)] == [162, 92, 2]


def test_every_opcode_stands_in_exactly_one_line():
    assert sum(row[1] for row in TABLE) == 256
    assert set(ROW) == {row[0] for row in TABLE}


@pytest.mark.parametrize("opcode", range(256))
def test_the_cpu_takes_the_cycles_and_the_bytes_of_the_table(opcode):
    cpu = Cpu(RecordingBus())
    cpu.load(bytes([opcode, 0x30, 0x05]) + bytes(61))  # rel of 3-byte branches lands at 8
    cpu.a = 1 if ROW[opcode] != 0x60 else 0  # JZ taken would hide the length
    mnemonic = next(row[3] for row in TABLE if row[0] == ROW[opcode])
    cpu.step()
    assert cpu.cycles == CYCLES[opcode]
    assert cpu.instructions == 1
    branches = "rel" in next(row[4] for row in TABLE if row[0] == ROW[opcode])
    if mnemonic not in JUMPS:
        offset = 0x30 if LENGTH[opcode] == 2 else 0x05
        taken = LENGTH[opcode] + offset
        assert cpu.pc == LENGTH[opcode] or (branches and cpu.pc == taken)


def test_code_wraps_at_64_kb():
    cpu = Cpu(RecordingBus())
    cpu.load(bytes([0x12, 0x00]) + bytes(0xFFFC) + bytes([0x00, 0x74]))
    cpu.pc = 0xFFFF
    cpu.step()
    assert (cpu.a, cpu.pc) == (0x12, 1)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("b4 05 fd", "CJNE A,#05h,0000h"),
        ("43 90 0f", "ORL 90h,#0Fh"),
        ("85 30 40", "MOV 40h,30h"),
        ("20 e7 02", "JB E0h.7,0005h"),
        ("92 08", "MOV 21h.0,C"),
        ("b0 91", "ANL C,/90h.1"),
        ("d9 fe", "DJNZ R1,0000h"),
        ("77 12", "MOV @R1,#12h"),
        ("90 12 34", "MOV DPTR,#1234h"),
        ("e1 23", "AJMP 0723h"),
        ("a5", "?"),
        ("22", "RET"),
    ],
)
def test_disassembly_reads_like_the_data_sheet(code, text):
    assert disassemble(bytes.fromhex(code) + bytes(0x10000), 0) == text
