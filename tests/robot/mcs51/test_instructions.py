"""What instructions do to flags, memory and stack, with the classic mistakes as cases.

4316E is Atmel's 8051 Hardware Manual.
"""

import pytest

from miro_robot.faults import FaultKind
from miro_robot.mcs51.cpu import Cpu
from tests.robot.mcs51.rig import RecordingBus, cpu_with, run_to_loop, sfr, stepped


def test_parity_is_that_of_acc_whatever_is_written_to_psw():
    """4316E, instruction set: P is combinational."""
    assert sfr(stepped("MOV A,#01h\nMOV PSW,#00h"), "PSW") == 0x01
    assert sfr(stepped("MOV A,#03h\nMOV PSW,#01h"), "PSW") == 0x00
    assert sfr(stepped("MOV A,#03h\nSETB PSW.0"), "PSW") == 0x00


def test_user_flags_and_bank_bits_of_psw_are_kept():
    assert sfr(stepped("MOV PSW,#0FEh"), "PSW") == 0xFE


@pytest.mark.parametrize("switch", ["SETB RS0", "MOV PSW,#08h", "ORL PSW,#08h", "XRL PSW,#08h"])
def test_every_way_of_writing_rs0_switches_the_bank(switch):
    """4316E, memory: banks by PSW.4:3, also by bit."""
    cpu = stepped(f"{switch}\nMOV R0,#55h")
    assert (cpu.peek_iram(0x08), cpu.peek_iram(0x00)) == (0x55, 0x00)


def test_upper_ram_is_reached_indirectly_and_by_the_stack_only():
    """4316E, memory: 80 to FF by @Ri and the stack; direct addresses are registers."""
    cpu = stepped("MOV R0,#90h\nMOV @R0,#12h\nMOV A,@R0\nMOV SP,#90h\nMOV B,#77h\nPUSH B")
    assert cpu.a == 0x12
    assert cpu.peek_iram(0x90) == 0x12
    assert cpu.peek_iram(0x91) == 0x77
    assert sfr(cpu, "P1") == 0xFF


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


def test_inc_and_dec_touch_no_flag():
    """4316E, instruction set."""
    cpu = stepped("MOV A,#0FFh\nINC A\nDEC A\nINC 30h\nDEC @R0")
    assert (cpu.cy, cpu.ac, cpu.ov) == (0, 0, 0)


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
    assert cpu.code_limit == 16


def test_a_stop_request_ends_the_run_after_the_instruction():
    class Stopper(RecordingBus):
        def port_written(self, port, latch, tick):
            cpu.request_stop()

    cpu = Cpu(Stopper())
    cpu.load(bytes.fromhex("759000740180fe"))
    assert cpu.run(1000) == 1
    assert (cpu.pc, cpu.cycles) == (3, 2)
    assert cpu.run(1000) == 0


def test_a_run_until_an_address_stops_before_its_instruction():
    cpu = cpu_with("MOV A,#01h\nMOV A,#02h\nMOV A,#03h")
    assert cpu.run_until_pc(2, 100) == 2
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
    class CodeInRam(RecordingBus):
        def movx_write(self, address, value, tick):
            cpu.write_code(address, value)

    cpu = Cpu(CodeInRam())
    cpu.load(bytes.fromhex("900006 7404 f0 00 80fe"))  # writes INC A over the NOP behind it
    assert cpu.run_until_pc(6, 100) == 2
    cpu.step()
    assert (cpu.a, cpu.pc) == (5, 7)
    assert not cpu.is_loaded(0x20)
    assert cpu.run_until_pc(0x20, 50) == 0
    assert not cpu.is_loaded(0x20)


def test_an_exception_in_the_bus_leaves_the_run():
    class Broken(RecordingBus):
        def port_written(self, port, latch, tick):
            raise RuntimeError("no such chip")

    cpu = Cpu(Broken())
    cpu.load(bytes.fromhex("759000"))
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
