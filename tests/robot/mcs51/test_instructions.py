"""What instructions do to flags, memory and stack beyond the vectors of `tests/vectors`; their table; arithmetic.

4316E is Atmel's 8051 Hardware Manual.
"""

import zlib

import pytest

from miro_exact import engine
from miro_robot.faults import FaultKind
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import ROW, TABLE, disassemble
from tests.robot.mcs51.rig import RecordingBus, cpu_with, run_to_loop, sfr, stepped


def test_parity_is_that_of_acc_whatever_is_written_to_psw():
    """4316E, instruction set: P is combinational."""
    assert sfr(stepped("MOV A,#01h\nMOV PSW,#00h"), "PSW") == 0x01
    assert sfr(stepped("MOV A,#03h\nMOV PSW,#01h"), "PSW") == 0x00
    assert sfr(stepped("MOV A,#03h\nSETB PSW.0"), "PSW") == 0x00


@pytest.mark.parametrize("switch", ["SETB RS0", "MOV PSW,#08h", "ORL PSW,#08h", "XRL PSW,#08h"])
def test_every_way_of_writing_rs0_switches_the_bank(switch):
    """4316E, memory: banks by PSW.4:3, also by bit."""
    cpu = stepped(f"{switch}\nMOV R0,#55h")
    assert (cpu.peek_iram(0x08), cpu.peek_iram(0x00)) == (0x55, 0x00)


def test_push_sp_stores_the_incremented_pointer_and_pop_sp_ends_with_the_byte():
    """4316E, instruction set; what PUSH SP stores is chosen, silicon is not pinned down."""
    assert stepped("PUSH SP").peek_iram(0x08) == 0x08
    cpu = stepped("MOV 07h,#42h\nPOP SP")
    assert cpu.sp == 0x42


def test_ajmp_stays_in_the_page_of_the_following_instruction():
    """4316E, instruction set."""
    cpu = cpu_with("ORG 07FEh\nAJMP 0800h")
    cpu.pc = 0x7FE
    cpu.step()
    assert cpu.pc == 0x800


def test_movc_beyond_ffff_goes_on_at_0000():
    """4316E, memory: addresses are 16 bit and wrap."""
    cpu = cpu_with("MOV DPTR,#0FFFFh\nMOV A,#02h\nMOVC A,@A+DPTR")
    for _ in range(3):
        cpu.step()
    assert cpu.a == cpu.code_at(1)


def test_dptr_wraps_and_movx_by_r_takes_the_page_from_p2():
    """4316E, memory: the high address of MOVX @Ri is the P2 latch."""
    cpu = stepped(
        "MOV DPTR,#0FFFFh\nINC DPTR\nMOV P2,#12h\nMOV R1,#34h\nMOV A,#56h\nMOVX @R1,A\nMOVX A,@DPTR"
    )
    assert [write[:2] for write in cpu.bus.writes] == [(0x1234, 0x56)]
    assert [read[0] for read in cpu.bus.reads] == [0x0000]


def test_movx_puts_ff_into_the_latch_of_p0_and_tells_when_it_strobes():
    """4316E section 2.6: the read sample and the rise of WR, in ticks of the MOVX."""
    cpu = stepped("MOV P0,#00h\nMOV DPTR,#1234h\nMOVX @DPTR,A\nMOVX A,@DPTR")
    assert sfr(cpu, "P0") == 0xFF
    assert cpu.bus.ports == [(0, 0x00, 24), (0, 0xFF, 72)]
    assert cpu.bus.writes == [(0x1234, 0, 4 * 12 + 18)]
    assert cpu.bus.reads == [(0x1234, 6 * 12 + 17)]


def test_movx_strobes_are_gated_by_the_latch_of_p3():
    """4316E section 2.5."""
    cpu = stepped("MOV P3,#3Fh\nMOV DPTR,#0001h\nMOVX @DPTR,A\nMOVX A,@DPTR")
    assert cpu.bus.writes == cpu.bus.reads == []
    assert cpu.a == 0xFF


def test_registers_that_do_not_exist_read_as_ff():
    """4316E, memory: undefined on silicon, chosen."""
    assert stepped("MOV A,0A2h").a == 0xFF
    assert stepped("MOV 0A6h,#12h\nMOV A,0A6h").a == 0xFF


def test_an_undefined_opcode_is_a_fault_and_runs_as_nop():
    """4316E, instruction set: A5, one byte, one cycle."""
    cpu = stepped("NOP\nDB 0A5h\nMOV A,#07h")
    assert cpu.a == 7
    assert [(kind, pc) for kind, pc, _ in cpu.bus.faults] == [(FaultKind.UNDEFINED_OPCODE, 1)]
    assert cpu.faults == 1


def test_a_stack_that_wraps_is_a_fault():
    """4316E, memory: SP wraps FF to 00."""
    cpu = stepped("MOV SP,#0FFh\nPUSH ACC\nMOV SP,#00h\nPOP ACC")
    kinds = [kind for kind, _, _ in cpu.bus.faults]
    assert kinds == [FaultKind.STACK_OVERFLOW, FaultKind.STACK_UNDERFLOW]


def test_running_out_of_the_image_is_a_fault_at_the_first_address_outside():
    cpu = cpu_with("NOP\nNOP")
    cpu.run(3)
    assert [(kind, pc) for kind, pc, _ in cpu.bus.faults] == [(FaultKind.OUTSIDE_IMAGE, 2)]


def test_holes_in_the_image_are_outside_of_it():
    cpu = Cpu(RecordingBus())
    cpu.load(bytes(16), ((0, 2), (4, 16)))
    cpu.run(16)
    assert [pc for _, pc, _ in cpu.bus.faults] == [2, 3]


def test_a_stop_request_ends_the_run_after_the_instruction():
    cpu = cpu_with("MOV P1,#0\nMOV A,#1\nSJMP $")
    cpu.bus.port_written = lambda *_: cpu.request_stop()
    assert cpu.run(1000) == 1
    assert (cpu.pc, cpu.cycles) == (3, 2)
    assert cpu.run(1000) == 0


def test_a_run_until_an_address_stops_before_its_instruction():
    cpu = cpu_with("MOV A,#01h\nMOV A,#02h\nMOV A,#03h")
    assert cpu.run_until_any((2,), 100) == 2
    assert (cpu.a, cpu.pc) == (1, 2)
    cpu.step()
    assert cpu.a == 2


def test_a_run_until_any_of_several_addresses_says_by_pc_which():
    cpu = cpu_with("MOV A,#01h\nMOV A,#02h\nMOV A,#03h")
    assert cpu.run_until_any((4, 2), 100) == 2
    assert cpu.pc == 2
    assert cpu.run_until_any((4,), 100) == 2
    assert (cpu.a, cpu.pc) == (2, 4)
    assert cpu.run_until_any((), 4) == 0


def test_code_that_is_written_where_a_run_is_to_stop_does_not_hide_the_place():
    cpu = cpu_with("MOV DPTR,#6\nMOV A,#4\nMOVX @DPTR,A\nNOP\nSJMP $")  # writes INC A over the NOP
    cpu.bus.movx_write = lambda address, value, tick: cpu.write_code(address, value)
    assert cpu.run_until_any((6,), 100) == 2
    cpu.step()
    assert (cpu.a, cpu.pc) == (5, 7)
    assert not cpu.is_loaded(0x20)
    assert cpu.run_until_any((0x20,), 50) == 0
    assert not cpu.is_loaded(0x20)


def test_an_exception_in_the_bus_leaves_the_run():
    def broken(*_):
        raise RuntimeError("no such chip")

    cpu = cpu_with("MOV P1,#0")
    cpu.bus.port_written = broken
    with pytest.raises(RuntimeError, match="no such chip"):
        cpu.run(10)


def test_reset_puts_registers_back_and_leaves_ram_and_time():
    """4316E section 2.4 and memory."""
    cpu = run_to_loop("MOV 30h,#12h\nMOV P1,#00h\nMOV SP,#40h\nMOV IE,#85h\nMOV TMOD,#21h\nMOV SCON,#50h")
    cycles = cpu.cycles
    cpu.reset()
    assert (cpu.pc, cpu.sp, cpu.cycles, cpu.peek_iram(0x30)) == (0, 7, cycles, 0x12)
    names = ("P0", "P1", "P2", "P3", "IE", "IP", "TMOD", "TCON", "SCON", "T2CON", "PCON", "PSW")
    assert [sfr(cpu, name) for name in names] == [0xFF] * 4 + [0] * 8
    assert cpu.bus.ports[-1] == (1, 0xFF, 12 * cycles)


def test_every_opcode_stands_in_exactly_one_line():
    assert sum(row[1] for row in TABLE) == 256
    assert set(ROW) == {row[0] for row in TABLE}


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


PAIRS_ONLY_COMPILED = pytest.mark.skipif(
    engine.active() != "compiled", reason="65536 operand pairs take the uncompiled twin too long"
)


def signatures(opcodes, carry, registers, skip_zero):
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
    return {name: f"{zlib.crc32(results[name]):08X}" for name in registers}


SIGNATURES = [
    ("ADD A,B", 0, {"a": "0644D9BB", "psw": "9A43B34F"}),
    ("ADDC A,B", 1, {"a": "3BB1796C", "psw": "7D9FED2C"}),
    ("SUBB A,B", 0, {"a": "CC77C850", "psw": "A5AA6EAF"}),
    ("SUBB A,B", 1, {"a": "0CA3718D", "psw": "DDAAE689"}),
    ("MUL AB", 0, {"a": "06C7FCB6", "b": "978D00AF", "psw": "15568B59"}),  # B:A, CY = 0, OV for more than 255
    ("DIV AB", 0, {"a": "6D508E27", "b": "7FAEE11D", "psw": "94780F82"}),  # quotient, remainder; CY = OV = 0
]


@PAIRS_ONLY_COMPILED
@pytest.mark.parametrize(("text", "carry", "expected"), SIGNATURES)
def test_arithmetic_on_all_operands_has_the_reference_signature(text, carry, expected):
    """4316E, instruction set: CRC-32 of results and flags, as silicon documents and ucsim's s51 agree on them."""
    assert signatures(text, carry, expected, skip_zero=text == "DIV AB") == expected


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
