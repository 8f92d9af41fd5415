"""Arithmetic, exhaustively: CRC-32 over every operand pair, as silicon documents and ucsim's s51 agree on them.

4316E is Atmel's 8051 Hardware Manual.
"""

import zlib

import pytest

from miro_exact import engine
from tests.robot.mcs51.rig import cpu_with

PAIRS_ONLY_COMPILED = pytest.mark.skipif(
    engine.active() != "compiled", reason="65536 operand pairs take the uncompiled twin too long"
)


def signatures(opcodes, carry, registers=("a", "psw"), skip_zero=False):
    """CRC-32 of each register after the instruction, over A (outer) and B (inner); rows of B = 0 may be zero."""
    cpu = cpu_with(opcodes)
    results = {name: bytearray() for name in registers}
    for a in range(256):
        for b in range(256):
            cpu.pc, cpu.a, cpu.b = 0, a, b
            cpu.cy, cpu.ac, cpu.ov = carry, 0, 0
            cpu.step()
            for name in registers:
                value = cpu.psw() if name == "psw" else getattr(cpu, name)
                results[name].append(0 if skip_zero and b == 0 else value)
    return [f"{zlib.crc32(results[name]):08X}" for name in registers]


@PAIRS_ONLY_COMPILED
@pytest.mark.parametrize(
    ("text", "carry", "expected"),
    [
        ("ADD A,B", 0, ["0644D9BB", "9A43B34F"]),
        ("ADDC A,B", 1, ["3BB1796C", "7D9FED2C"]),
        ("SUBB A,B", 0, ["CC77C850", "A5AA6EAF"]),
        ("SUBB A,B", 1, ["0CA3718D", "DDAAE689"]),
    ],
)
def test_sums_and_differences_have_the_reference_signature(text, carry, expected):
    """4316E, instruction set: CY, AC, OV of ADD, ADDC and SUBB, all operands."""
    assert signatures(text, carry) == expected


@PAIRS_ONLY_COMPILED
def test_products_have_the_reference_signature():
    """4316E, instruction set: MUL gives B:A, CY = 0, OV for more than 255."""
    assert signatures("MUL AB", 0, ("a", "b", "psw")) == ["06C7FCB6", "978D00AF", "15568B59"]


@PAIRS_ONLY_COMPILED
def test_quotients_have_the_reference_signature():
    """4316E, instruction set: DIV gives quotient and remainder, CY = OV = 0."""
    assert signatures("DIV AB", 0, ("a", "b", "psw"), skip_zero=True) == ["6D508E27", "7FAEE11D", "94780F82"]


def test_decimal_adjust_has_the_reference_signature():
    """4316E, instruction set: DA in two steps, CY is never cleared, AC and OV stay."""
    cpu = cpu_with("DA A")
    values, flags = bytearray(), bytearray()
    for cy, ac in ((0, 0), (0, 1), (1, 0), (1, 1)):
        for a in range(256):
            cpu.pc, cpu.a, cpu.cy, cpu.ac, cpu.ov = 0, a, cy, ac, 0
            cpu.step()
            values.append(cpu.a)
            flags.append(cpu.psw())
    assert f"{zlib.crc32(values):08X}" == "AC049A8B"
    assert f"{zlib.crc32(flags):08X}" == "839EDFB3"


def test_division_by_zero_keeps_a_and_b_and_sets_ov():
    """4316E, instruction set: OV = 1, CY = 0; A and B are undefined on silicon, chosen: unchanged."""
    cpu = cpu_with("DIV AB")
    cpu.a, cpu.b, cpu.cy = 0x55, 0, 1
    cpu.step()
    assert (cpu.a, cpu.b, cpu.cy, cpu.ov) == (0x55, 0, 0, 1)


@pytest.mark.parametrize("text", ["MUL AB", "DIV AB"])
def test_multiplication_and_division_leave_ac_alone(text):
    """4316E, instruction set: AC untouched by MUL and DIV."""
    cpu = cpu_with(text)
    cpu.ac = 1
    cpu.step()
    assert cpu.ac == 1
