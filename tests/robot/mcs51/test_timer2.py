"""Timer 2: the cycle in which T2EX and T2 act, calculated by hand. 4316E is Atmel's 8051 Hardware Manual, 1919D the
AT89S52 data sheet, whose sections 10 to 12 have timer 2 too.
"""

import pytest

from tests.robot.mcs51.rig import cpu_with, sfr

T2EX_LOW, T2_LOW = 0xFD, 0xFE  # on P1
CAPTURE, RELOAD, BAUD, TR2, EXEN2 = 0x01, 0x00, 0x30, 0x04, 0x08


def falling(cycle, setup, levels=T2EX_LOW):
    """NOPs after `setup`, and a pin that is first low in the sample of `cycle`."""
    cpu = cpu_with(setup + "NOP\n" * 200)
    cpu.set_external(1, levels, 12 * cycle)
    return cpu


def at(cpu, cycle, *names):
    """Registers with all cycles below `cycle` done."""
    cpu.run(cycle)
    assert cpu.cycles == cycle
    return tuple(sfr(cpu, name) for name in names)


@pytest.mark.parametrize("mode", [CAPTURE, RELOAD, BAUD])
def test_exf2_is_up_after_the_cycle_that_follows_the_sample(mode):
    """4316E sections 2.4 and 2.12: T2EX is sampled at S5P2, a fall is between two samples, and the next cycle
    acts on it.
    """
    cpu = falling(20, f"MOV T2CON,#{mode | EXEN2:02X}h\n")
    assert at(cpu, 20, "T2CON") == at(cpu, 21, "T2CON") == (mode | EXEN2,)
    assert at(cpu, 22, "T2CON") == (mode | EXEN2 | 0x40,)


FULL = "MOV TL2,#0FFh\nMOV TH2,#0FFh\n"
DCEN = "MOV T2MOD,#01h\n" + FULL + "MOV RCAP2L,#0FEh\nMOV RCAP2H,#0FFh\nMOV T2CON,#04h\n"
BY_HAND = {  # set-up, the pin that falls in cycle 20, registers, and what they are with all cycles below so many done
    "a capture takes the count of the cycle before": (  # TR2 set at the end of cycle 1 counts from 2 on
        f"MOV T2CON,#{CAPTURE | EXEN2 | TR2}\n", T2EX_LOW, ("TL2", "RCAP2L"), {21: (19, 0), 22: (20, 19)},
    ),
    "without EXEN2 T2EX does nothing": (
        f"MOV RCAP2L,#80h\nMOV T2CON,#{TR2}\n", T2EX_LOW, ("TL2", "T2CON"), {30: (26, TR2)},
    ),
    "a counter counts in the cycle after the sample": ("MOV T2CON,#06h\n", T2_LOW, ("TL2",), {21: (0,), 22: (1,)}),
    "a counter that overflows reloads and flags": (
        FULL + "MOV RCAP2L,#34h\nMOV RCAP2H,#12h\nMOV T2CON,#06h\n", T2_LOW,
        ("TH2", "TL2", "T2CON"), {22: (0x12, 0x34, 0x86)},
    ),
    "in capture mode an overflow goes to zero": (  # counts from cycle 8 on
        FULL.replace("0FFh", "0F0h", 1) + "MOV RCAP2L,#34h\nMOV T2CON,#05h\n", 0xFF,
        ("TH2", "TL2", "T2CON"), {23: (0xFF, 0xFF, 0x05), 24: (0x00, 0x00, 0x85)},
    ),
    "with DCEN and T2EX high it counts up and each overflow toggles EXF2": (
        DCEN, 0xFF, ("TL2", "T2CON"),
        {12: (0xFF, 0x04), 13: (0xFE, 0xC4), 14: (0xFF, 0xC4), 15: (0xFE, 0x84), 16: (0xFF, 0x84), 17: (0xFE, 0xC4)},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("setup", "levels", "names", "expected"), BY_HAND.values(), ids=BY_HAND)
def test_registers_are_in_each_cycle_as_calculated_by_hand(setup, levels, names, expected):
    """4316E sections 2.9 and 2.12."""
    cpu = falling(20, setup, levels)
    assert {cycle: at(cpu, cycle, *names) for cycle in expected} == expected


def test_a_reload_by_t2ex_goes_before_the_count_of_its_cycle():
    """4316E section 2.12: with CP/RL2 = 0 a fall of T2EX loads RCAP2."""
    cpu = falling(20, f"MOV RCAP2L,#80h\nMOV T2CON,#{RELOAD | EXEN2 | TR2:02X}h\n")
    assert at(cpu, 21, "TL2") == (17,)
    assert at(cpu, 22, "TL2") == (0x81,)


@pytest.mark.parametrize(("written_in", "flag"), [(19, 0x40), (20, 0x40), (21, 0x00), (22, 0x00)])
def test_exen2_counts_as_it_stands_in_the_cycle_that_acts(written_in, flag):
    """4316E section 2.4: a register changes at the end of its instruction, so a write in the sample's own
    cycle counts.
    """
    cpu = falling(20, "NOP\n" * written_in + "SETB 0CBh\n")
    assert at(cpu, 40, "T2CON") == (EXEN2 | flag,)


def test_a_read_in_the_cycle_of_the_sample_does_not_see_exf2_yet():
    """4316E section 2.12."""
    for reader, seen in ((20, EXEN2), (21, EXEN2 | 0x40)):
        cpu = falling(20, "MOV T2CON,#08h\n" + "NOP\n" * (reader - 2) + "MOV A,T2CON\n")
        cpu.run(reader + 1)
        assert cpu.a == seen


def test_exf2_is_answered_a_cycle_later_than_an_external_interrupt():
    """4316E section 2.16: latched in cycle n, first ISR cycle n + 4. The sample of cycle 20 sets EXF2 in
    cycle 21 (chosen: it is latched at S5P2 of that cycle), so the routine begins in cycle 25 - where INT0
    would begin in 24.
    """
    cpu = falling(20, "LJMP main\nORG 002Bh\nSJMP $\nORG 0040h\nmain:\nMOV IE,#0A0h\nMOV T2CON,#08h\n")
    assert cpu.run_until_pc(0x2B, 100) == 2
    assert cpu.cycles == 25


def test_dcen_counts_down_to_rcap2_and_then_from_ffff():
    """4316E section 2.12: with DCEN and T2EX low it counts down; where TH2:TL2 equals RCAP2 it underflows to
    FFFF, sets TF2 and toggles EXF2.
    """
    setup = "MOV T2MOD,#01h\nMOV TL2,#05h\nMOV TH2,#10h\nMOV RCAP2L,#03h\nMOV RCAP2H,#10h\nMOV T2CON,#04h\n"
    cpu = cpu_with(setup + "NOP\n" * 40)
    cpu.set_external(1, T2EX_LOW, 0)
    seen = [at(cpu, 12 + n, "TH2", "TL2", "T2CON") for n in range(5)]
    assert seen == [
        (0x10, 0x05, 0x04),
        (0x10, 0x04, 0x04),
        (0x10, 0x03, 0x04),
        (0xFF, 0xFF, 0xC4),
        (0xFF, 0xFE, 0xC4),
    ]


def test_dcen_follows_t2ex_from_the_cycle_after_the_sample():
    """4316E sections 2.4 and 2.12: the direction is that of the last sample."""
    cpu = falling(20, "MOV T2MOD,#01h\nMOV TL2,#40h\nMOV T2CON,#04h\n")  # counts from cycle 6 on
    assert at(cpu, 21, "TL2") == (0x40 + 15,)
    assert at(cpu, 22, "TL2") == (0x40 + 14,)


@pytest.mark.parametrize("which", [0x20, 0x10])
def test_as_a_baud_generator_it_counts_six_times_a_cycle_and_sets_no_tf2(which):
    """4316E section 2.12: fosc/2 with RCLK or TCLK, reloading from RCAP2, no TF2."""
    cpu = cpu_with(f"MOV RCAP2L,#0F0h\nMOV RCAP2H,#0FFh\nMOV T2CON,#{which | 0x04:02X}h\n" + "NOP\n" * 11000)
    assert at(cpu, 6 + 10, "TL2") == (60,)
    cpu.run(6 + 65536 // 6 + 8)  # 65536 counts are 10922 cycles and 4 counts
    assert sfr(cpu, "T2CON") == which | 0x04
    assert sfr(cpu, "TH2") == 0xFF
    assert sfr(cpu, "TL2") == 0xF0 + (8 * 6 - 4) % 16


@pytest.mark.parametrize("reload", [0xFFF4, 0xFFE8])
def test_clock_out_toggles_p1_0_every_65536_minus_rcap2_counts(reload):
    """4316E section 2.12: fosc / (4 * (65536 - RCAP2)); counts are two ticks, and a period has two overflows."""
    setup = (
        f"MOV T2MOD,#02h\nMOV RCAP2L,#{reload & 0xFF:02X}h\nMOV RCAP2H,#0FFh\nMOV TL2,#{reload & 0xFF:02X}h\n"
    )
    cpu = cpu_with(setup + "MOV TH2,#0FFh\nMOV T2CON,#04h\n" + "NOP\n" * 60)
    half = (65536 - reload) // 6  # cycles
    levels = []
    for cycle in range(12, 12 + 6 * half):
        cpu.run(cycle)
        levels.append(cpu.peripherals.pin_levels(1, cycle - 1) & 1)
    first = levels[0]
    assert levels == [first ^ (n // half & 1) for n in range(6 * half)]
    assert sfr(cpu, "T2CON") == 0x04
