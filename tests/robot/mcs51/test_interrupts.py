"""Interrupts: latency to the cycle, priorities, what blocks them, what clears them.

4316E is Atmel's 8051 Hardware Manual.
"""

import pytest

from tests.robot.mcs51.rig import RecordingBus, cpu_with, sfr

VECTORS = (0x03, 0x0B, 0x13, 0x1B, 0x23, 0x2B)
ROUTINES = "".join(f"ORG {vector:04X}h\nCLR P1.{number}\nRETI\n" for number, vector in enumerate(VECTORS))
ISRS = f"LJMP main\n{ROUTINES}ORG 0040h\nmain:\n"
INT0_LOW, INT1_LOW, BOTH_LOW = 0xFB, 0xF7, 0xF3


def entries(cpu):
    """(bit of P1, first cycle of the routine) per routine entered; CLR bit is its first, one-cycle instruction."""
    before, found = 0xFF, []
    for port, latch, tick in cpu.bus.ports:
        if port == 1:
            found.append(((before ^ latch).bit_length() - 1, tick // 12 - 1))
            before = latch
    return found


def ran(body, pushes, cycles=200):
    cpu = cpu_with(ISRS + body)
    for levels, cycle in pushes:
        cpu.set_external(3, levels, 12 * cycle)
    cpu.run(cycles)
    return cpu


def padded(instruction, event):
    """INT0 by edge, then NOPs, and `instruction` so placed that it begins in cycle `event` + 1."""
    setup = "MOV IE,#81h\nSETB IT0\n"  # LJMP 2 + MOV 2 + SETB 1: cycle 5 begins
    return setup + "NOP\n" * (event + 1 - 5) + instruction + "\nloop:\nNOP\nSJMP loop"


@pytest.mark.parametrize(
    ("instruction", "full_cycles"),
    [
        ("NOP\nNOP\nNOP\nNOP", 3),
        ("MOV R0,30h\nNOP", 4),  # polled in the first of its two cycles
        ("MUL AB\nNOP", 6),
        ("MOV IE,#81h\nNOP", 5),
        ("MOV IP,#00h\nMUL AB\nNOP", 8),
        ("SETB EA\nMUL AB", 7),
        ("CLR PX0\nMUL AB", 7),
    ],
)
def test_latency_is_three_to_eight_full_cycles(instruction, full_cycles):
    """4316E section 2.16: + 1 for the rest of an instruction of two cycles, + 3 for MUL and DIV, and one more
    instruction after a write to IE or IP.
    """
    cpu = ran(padded(instruction, 20), [(INT0_LOW, 20)])
    assert entries(cpu) == [(0, 20 + full_cycles + 1)]


def test_reti_lets_one_more_instruction_run():
    """4316E section 2.16."""
    cpu = cpu_with(
        """
        LJMP main
        ORG 0003h
        INC 30h
        RETI
        ORG 0040h
        main:
        MOV IE,#81h
        loop:
        INC 31h
        SJMP loop
        """
    )
    cpu.set_external(3, INT0_LOW, 0)
    cpu.run(400)
    assert abs(cpu.peek_iram(0x30) - cpu.peek_iram(0x31) * 2) <= 2  # INC and SJMP alternate between routines
    assert cpu.peek_iram(0x30) > 50


def test_reading_ie_does_not_block():
    """4316E section 2.16: the manuals differ; chosen: writes block, reads do not."""
    cpu = ran(padded("MOV A,IE\nNOP\nNOP", 20), [(INT0_LOW, 20)])
    assert entries(cpu) == [(0, 24)]


@pytest.mark.parametrize(("ip", "order"), [(0x00, [0, 2]), (0x04, [2, 0]), (0x01, [0, 2]), (0x05, [0, 2])])
def test_of_two_at_once_the_priority_decides_and_then_the_polling_order(ip, order):
    """4316E section 2.16."""
    body = f"MOV IP,#{ip:02X}h\nSETB IT0\nSETB IT1\nMOV IE,#85h\n" + "NOP\n" * 60
    cpu = ran(body, [(BOTH_LOW, 30)])
    assert [bit for bit, _ in entries(cpu)] == order


def test_a_high_one_interrupts_a_low_one_before_its_first_instruction():
    """4316E section 2.16."""
    body = "MOV IP,#04h\nSETB IT0\nSETB IT1\nMOV IE,#85h\n" + "NOP\n" * 60
    cpu = ran(
        body, [(INT0_LOW, 30), (BOTH_LOW, 31)]
    )  # INT1 latched during the first LCALL cycle at the latest
    assert entries(cpu) == [(2, 36), (0, 39)]
    assert cpu.sp == 7


def test_a_low_one_does_not_interrupt_a_low_one():
    """4316E section 2.16: two in-service flip-flops."""
    body = "SETB IT0\nSETB IT1\nMOV IE,#85h\n" + "NOP\n" * 60
    cpu = ran(body, [(INT0_LOW, 30), (BOTH_LOW, 33)])
    assert entries(cpu) == [(0, 34), (2, 40)]  # RETI, one NOP, LCALL


def test_an_edge_flag_sticks_and_is_cleared_by_the_vector():
    """4316E section 2.16."""
    cpu = ran("SETB IT0\n" + "NOP\n" * 60, [(INT0_LOW, 10), (0xFF, 12)], 50)
    assert sfr(cpu, "TCON") == 0x03
    cpu = ran("SETB IT0\nMOV IE,#81h\n" + "NOP\n" * 60, [(INT0_LOW, 10), (0xFF, 12)], 50)
    assert sfr(cpu, "TCON") == 0x01
    assert len(entries(cpu)) == 1


def test_a_level_flag_follows_the_pin_both_ways():
    """4316E section 2.16: IEx is the inverted pin at each S5P2."""
    body = "NOP\n" * 60
    assert sfr(ran(body, [(INT0_LOW, 10)], 20), "TCON") == 0x02
    assert sfr(ran(body, [(INT0_LOW, 10), (0xFF, 15)], 20), "TCON") == 0x00


def test_a_level_that_went_away_before_it_was_polled_is_forgotten():
    """4316E section 2.16."""
    body = "MOV IE,#81h\n" + "NOP\n" * 16 + "MUL AB\n" + "NOP\n" * 60  # MUL in cycles 20..23
    assert entries(ran(body, [(INT0_LOW, 19), (0xFF, 22)])) == []
    assert entries(ran(body, [(INT0_LOW, 19), (0xFF, 23)])) == [(0, 26)]


def test_a_flag_set_by_software_is_answered_as_one_that_hardware_sets_in_the_next_cycle():
    """Chosen, no sheet gives the delay: SETB TF0 ends with cycle 5, so that S5P2 of cycle 6 sees the flag; polled in
    7, LCALL in 8 and 9. The two instructions of cycles 6 and 7 still run, and CLR P1.1 in 10.
    """
    cpu = ran("MOV IE,#82h\nNOP\nSETB TF0\nINC 30h\nINC 30h\nINC 30h\n" + "NOP\n" * 20, [], 11)
    assert entries(cpu) == [(1, 10)]
    assert cpu.peek_iram(0x30) == 2


def test_a_flag_that_software_clears_counts_in_the_poll_of_its_last_cycle():
    """Rule I4: SETB TF0 ends with cycle 5 and CLR TF0 with 6, so S5P2 of cycle 6 alone sees the flag. It is polled in
    7, LCALL in 8 and 9: the routine runs with TF0 clear.
    """
    cpu = ran("MOV IE,#82h\nNOP\nSETB TF0\nCLR TF0\n" + "NOP\n" * 20, [], 40)
    assert entries(cpu) == [(1, 10)]


SOURCES = [  # vector, IE, what sets the flag, its register, what the routine finds there
    (0x03, 0x81, "SETB IT0\nSETB IE0", "TCON", 0x01),
    (0x0B, 0x82, "SETB TF0", "TCON", 0x00),
    (0x13, 0x84, "SETB IT1\nSETB IE1", "TCON", 0x04),
    (0x1B, 0x88, "SETB TF1", "TCON", 0x00),
    (0x23, 0x90, "SETB RI", "SCON", 0x01),
    (0x23, 0x90, "SETB TI", "SCON", 0x02),
    (0x2B, 0xA0, "SETB TF2", "T2CON", 0x80),
    (0x2B, 0xA0, "SETB EXF2", "T2CON", 0x40),
]


@pytest.mark.parametrize(("vector", "ie", "flag", "register", "left"), SOURCES)
def test_every_source_has_its_vector_and_only_flags_of_timers_0_and_1_and_of_edges_are_cleared(
    vector, ie, flag, register, left
):
    """4316E section 2.16."""
    cpu = cpu_with(ISRS + f"MOV IE,#{ie:02X}h\n{flag}\n" + "NOP\n" * 20)
    assert cpu.run_until_any((vector,), 60) == 2
    assert (cpu.sp, sfr(cpu, register)) == (9, left)


def test_exf2_does_not_interrupt_while_timer_2_counts_up_and_down():
    """4316E section 2.16."""
    cpu = cpu_with(ISRS + "MOV T2MOD,#01h\nMOV IE,#0A0h\nSETB EXF2\n" + "NOP\n" * 20)
    assert cpu.run_until_any((VECTORS[5],), 40) == 0


def test_without_ea_nothing_happens():
    assert entries(ran("SETB IT0\nMOV IE,#7Fh\n" + "NOP\n" * 60, [(INT0_LOW, 20)])) == []


def test_ret_ends_no_interrupt_but_reti_does():
    """4316E section 2.16."""
    text = "LJMP main\nORG 0003h\nINC 30h\n{}\nORG 0040h\nmain:\nMOV IE,#81h\nloop:\nSJMP loop"
    for ending, runs in (("RET", {1}), ("RETI", set(range(10, 100)))):
        cpu = cpu_with(text.format(ending))
        cpu.set_external(3, INT0_LOW, 0)
        cpu.run(200)
        assert cpu.peek_iram(0x30) in runs


def test_an_interrupt_entry_counts_as_two_cycles_and_no_instruction():
    cpu = cpu_with(ISRS + "MOV IE,#82h\nSETB TF0\nNOP\nNOP\nNOP")
    while cpu.pc != 0x0B:
        cpu.step()
    instructions, cycles = cpu.instructions, cpu.cycles
    assert isinstance(cpu.bus, RecordingBus)
    assert cycles == 2 + 2 + 1 + (instructions - 3) + 2
