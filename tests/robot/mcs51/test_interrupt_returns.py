"""An interrupt routine that ends in RET is a fault, as its level stays blocked; other uses of RET in one are none."""

import pytest

from miro_robot.faults import FaultKind
from tests.robot.mcs51.rig import cpu_with
from tests.states import restore, snapshot

INT0_LOW, INT1_LOW, BOTH_LOW, HIGH = 0xFB, 0xF7, 0xF3, 0xFF
SETUP = "SETB IT0\nSETB IT1\nMOV IE,#85h\n"
MAIN = "main:\nMOV SP,#40h\n" + SETUP + "loop:\nINC 30h\nACALL work\nSJMP loop\nwork:\nINC 31h\nRET\n"
NOT_LEFT = FaultKind.INTERRUPT_NOT_LEFT


def program(int0="RETI", int1="RETI", more="", main=MAIN):
    return f"LJMP main\nORG 03h\nLJMP int0\nORG 13h\nLJMP int1\nORG 40h\nint0:\n{int0}\nint1:\n{int1}\n{more}\n{main}"


def ran(text, pushes, cycles=400):
    """The CPU after so many cycles; `pushes` are (levels on P3, cycle)."""
    cpu = cpu_with(text)
    for levels, cycle in pushes:
        cpu.set_external(3, levels, 12 * cycle)
    cpu.run(cycles)
    return cpu


def kinds(cpu):
    return [kind for kind, _, _ in cpu.bus.faults]


@pytest.mark.parametrize("cycle", range(20, 32))
def test_a_routine_that_ends_in_ret_is_a_fault_at_its_ret_wherever_it_came_in(cycle):
    cpu = ran(program("INC 32h\nRET"), [(INT0_LOW, cycle), (HIGH, 100), (INT0_LOW, 200)])
    ((kind, pc, tick),) = cpu.bus.faults
    assert (kind, pc) == (NOT_LEFT, 0x42)
    assert 12 * (cycle + 3) < tick < 12 * (cycle + 20)
    assert cpu.peek_iram(0x32) == 1  # the second interrupt never came


@pytest.mark.parametrize("priority", [0, 1])
def test_it_is_one_at_either_priority_and_within_another_routine(priority):
    low = "INC 32h\n" + "NOP\n" * 40 + "RETI"
    setup = f"MOV IP,#{0x04 * priority:02X}h\n"
    main = MAIN.replace("SETB IT0", setup + "SETB IT0")
    alone = ran(program(low, "RET", main=main), [(INT1_LOW, 30)])
    assert kinds(alone) == [NOT_LEFT]
    nested = ran(program(low, "RET", main=main), [(INT0_LOW, 30), (BOTH_LOW, 50)])
    assert kinds(nested) == [NOT_LEFT]


HARMLESS = {
    "functions that the routine calls": (
        "ACALL one\nACALL one\nRETI",
        "one:\nACALL two\nRET\ntwo:\nINC 32h\nRET",
    ),
    "a jump by PUSH and RET": (
        "PUSH ACC\nMOV A,#there\nPUSH ACC\nCLR A\nPUSH ACC\nRET\nthere:\nPOP ACC\nRETI",
        "",
    ),
    "a level that a RETI lowered before": ("ACALL lower\nINC 32h\nRET\nlower:\nRETI", ""),
    "a level that a RETI lowered, and RETI again": ("ACALL lower\nINC 32h\nRETI\nlower:\nRETI", ""),
    "a return address that the routine replaced": (
        "POP ACC\nPOP ACC\nMOV A,#there\nPUSH ACC\nCLR A\nPUSH ACC\nRET\nthere:\nMOV A,#again\nPUSH ACC\nCLR A\n"
        "PUSH ACC\nRETI\nagain:\nLJMP loop",
        "",
    ),
    "another stack": (
        "MOV 60h,#there\nMOV 61h,#00h\nMOV 33h,SP\nMOV SP,#61h\nRET\nthere:\nMOV SP,33h\nRETI",
        "",
    ),
    "a switch of Keil's, which pops its return address": (
        "LCALL case\nRETI\ncase:\nPOP DPH\nPOP DPL\nPUSH DPL\nPUSH DPH\nRET",
        "",
    ),
}


@pytest.mark.parametrize("what", HARMLESS)
@pytest.mark.parametrize("cycle", range(24, 30))
def test_other_returns_within_a_routine_are_none(what, cycle):
    body, more = HARMLESS[what]
    pushes = [(INT0_LOW, cycle), (HIGH, 100), (INT0_LOW, 160), (HIGH, 200), (BOTH_LOW, 240)]
    cpu = ran(program("INC 34h\n" + body, "INC 35h\nRETI", more), pushes)
    assert cpu.bus.faults == []
    assert (cpu.peek_iram(0x34), cpu.peek_iram(0x35)) == (3, 1)


def test_a_routine_with_variables_on_the_stack_that_ends_in_ret_is_a_fault_too():
    """As a function that SDCC compiled with --stack-auto."""
    frame = "MOV A,SP\nADD A,#4\nMOV SP,A\nACALL work\nMOV A,SP\nADD A,#0FCh\nMOV SP,A\nRET"
    assert kinds(ran(program(frame), [(INT0_LOW, 30)])) == [NOT_LEFT]


@pytest.mark.parametrize("cycle", range(24, 60))
def test_after_a_routine_that_jumped_to_0_no_function_that_returns_to_the_interrupted_place_is_one(cycle):
    cpu = ran(program("LJMP 0"), [(INT0_LOW, cycle)], cycles=2_000)
    assert cpu.bus.faults == []
    assert cpu.peek_iram(0x31) > 0


def test_functions_that_main_calls_afterwards_are_no_further_faults():
    pushes = [(INT0_LOW, 30)]
    cpu = ran(program("RET"), pushes, cycles=5_000)
    assert kinds(cpu) == [NOT_LEFT]
    assert cpu.peek_iram(0x31) > 0


def test_a_reset_in_the_routine_forgets_it():
    cpu = ran(program("SJMP $"), [(INT0_LOW, 30), (HIGH, 60)], 100)
    cpu.reset()
    cpu.run(1_000)
    assert cpu.bus.faults == []


@pytest.mark.parametrize("cut", range(28, 50))
def test_a_run_that_is_saved_and_loaded_in_the_routine_has_the_same_fault(cut):
    text = program("NOP\nNOP\nNOP\nRET")
    whole = ran(text, [(INT0_LOW, 30)])
    first, second = ran(text, [(INT0_LOW, 30)], cut), cpu_with(text)
    restore(second, snapshot(first))
    second.run(400)
    assert first.bus.faults + second.bus.faults == whole.bus.faults
    assert kinds(whole) == [NOT_LEFT]
