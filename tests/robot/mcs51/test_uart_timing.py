"""The serial port to the cycle: numbers calculated by hand from 4316E section 2.13, Atmel's 8051 Hardware
Manual; that the receiver votes in states 7 to 9 and acts in state 10 is from Oki's MSM80C154S manual.

The 16x clock: timer 2 as started here counts from cycle 10 on, six times a cycle, 78 counts (156 ticks) to an
overflow, which is over with the last of its two ticks: 16x tick number k is tick 12 * 10 + 156 * k - 1 = 119
+ 156 k. Timer 1 counts from cycle 9 on, and its overflow 13 cycles later is at S5P2: tick 12 * (9 + 12) + 9,
so that k is at 105 + 156 k.
"""

import pytest

from tests.robot.mcs51.rig import cpu_with, sfr

TIMER2 = "MOV RCAP2H,#0FFh\nMOV RCAP2L,#0B2h\nMOV TL2,#0B2h\nMOV TH2,#0FFh\nMOV T2CON,#34h\n"
TIMER1 = "MOV TMOD,#20h\nMOV TH1,#0F3h\nMOV TL1,#0F3h\nORL PCON,#{smod}\nSETB TR1\n"
BIT = 2496
VECTOR = "LJMP main\nORG 0023h\nCLR P1.0\nSJMP $\nORG 003Eh\nmain:\n"  # LJMP: two cycles more before `TIMER2`


def starts(text):
    """The tick at which TXD falls first."""
    cpu = cpu_with(text + "MOV SBUF,#55h\nSJMP $")
    cpu.run(6000)
    return cpu.txd.edges()[0][0]


def test_the_start_bit_begins_at_s1p1_after_the_sixteenth_tick_of_timer_2():
    """4316E section 2.13: at S1P1 after the next /16 rollover. Tick 16 is 119 + 2496 = 2615, in cycle 217;
    S1P1 of 218 is 2616.
    """
    assert starts(TIMER2 + "MOV SCON,#50h\n") == 12 * 218 == 2616


def test_a_write_just_after_the_rollover_waits_a_whole_bit():
    """4316E section 2.13, 0 to 1 bit of wait: SCON takes cycles 10 and 11, so 204 NOPs put the write of SBUF
    at the end of cycle 217, which the rollover at tick 2615 just misses or not.
    """
    assert starts(TIMER2 + "MOV SCON,#50h\n" + "NOP\n" * 203) == 2616
    assert starts(TIMER2 + "MOV SCON,#50h\n" + "NOP\n" * 205) == 2616 + BIT


def test_timer_1_in_mode_2_clocks_every_overflow_with_smod_1():
    """4316E section 2.13: T1 mode 2, TH1 = F3h, SMOD = 1 is 9615.38 Bd. Tick 16 is 105 + 2496 = 2601, in
    cycle 216.
    """
    assert starts(TIMER1.format(smod="80h") + "MOV SCON,#50h\n") == 12 * 217


def test_timer_1_in_mode_2_clocks_every_second_overflow_with_smod_0():
    """4316E section 2.13: with SMOD = 0 every second overflow. Tick 16 is 105 + 4992 = 5097, in cycle 424."""
    assert starts(TIMER1.format(smod="00h") + "MOV SCON,#50h\n") == 12 * 425


def test_ti_comes_with_the_stop_bit_and_the_routine_four_cycles_later():
    """4316E section 2.13: TI at the 10th rollover after the write, the start of the stop bit. VECTOR's LJMP
    moves all by 2 cycles and rollovers by 24 ticks: start bit 2640, stop bit 2640 + 9 * 2496 = 25104 =
    S1P1 of cycle 2092. 4316E section 2.16: latched in 2092, polled in 2093, LCALL in 2094 and 2095, the
    routine's CLR P1.0 in 2096 shows at S1P1 of 2097.
    """
    cpu = cpu_with(VECTOR + TIMER2 + "MOV SCON,#50h\nMOV IE,#90h\nMOV SBUF,#55h\nORL PCON,#01h\nSJMP $")
    cpu.run(6000)
    assert cpu.txd.edges()[0][0] == 2640
    assert cpu.bus.sent == [(0x55, 12 * 2092)]
    assert cpu.bus.ports[0] == (1, 0xFE, 12 * 2097)


def received(fall_tick, text=TIMER2 + "MOV SCON,#50h\nSJMP $", value=0xA5, stop=1):
    cpu = cpu_with(text)
    for number, level in enumerate([0, *(value >> bit & 1 for bit in range(8)), stop]):
        cpu.rxd.append(fall_tick + number * BIT, level)
    cpu.rxd.append(fall_tick + 10 * BIT, 1)
    return cpu


def first_ri(cpu):
    """The cycle in which RI goes up."""
    while not sfr(cpu, "SCON") & 1:
        cpu.run(cpu.cycles + 1)
    return cpu.cycles - 1


@pytest.mark.parametrize(
    ("fall", "cycle"),
    [
        (12000, 3013),  # seen at tick 77 of the 16x clock, 12131; tick 77 + 154 is 36155, in S6 of cycle 3012
        (12131, 3013),
        (12132, 3026),  # one 16x tick later: 12287, and 36311 in cycle 3025
    ],
)
def test_ri_comes_154_ticks_of_the_16x_clock_after_the_fall_was_seen(fall, cycle):
    """4316E section 2.13: RI at the first S3 after state 10 of the stop bit, 154 ticks after edge detection."""
    idle = TIMER2 + "MOV SCON,#50h\n" + "NOP\n" * 4000
    assert first_ri(received(fall, idle)) == cycle


@pytest.mark.parametrize(("mode", "ticks"), [("50h", 154), ("0D0h", 154)])
def test_mode_3_decides_with_the_ninth_data_bit(mode, ticks):
    """4316E section 2.13: in modes 2 and 3 with the 9th data bit, whose place is that of mode 1's stop bit
    ([H] figure 2-27).
    """
    idle = TIMER2 + f"MOV SCON,#{mode}\n" + "NOP\n" * 4000
    assert first_ri(received(12000, idle)) == (119 + 156 * (77 + ticks)) // 12 + 1


def test_the_receive_interrupt_is_entered_four_cycles_after_ri():
    """4316E sections 2.16 and 2.13. VECTOR's LJMP moves the 16x clock by 24 ticks: k is at 143 + 156 k. The
    fall at 12000 is seen at tick 77, 12155; tick 231 is 36179, in cycle 3014; RI in 3015, polled in 3016,
    LCALL in 3017 and 3018, CLR P1.0 in 3019.
    """
    text = VECTOR + TIMER2 + "MOV SCON,#50h\nMOV IE,#90h\nORL PCON,#01h\nSJMP $"
    cpu = received(12000, text)
    cpu.run(4000)
    assert cpu.bus.ports[0] == (1, 0xFE, 12 * 3020)


@pytest.mark.parametrize(("smod", "period"), [("00h", 64), ("80h", 32)])
def test_mode_2_is_the_crystal_divided_by_64_or_32(smod, period):
    """4316E section 2.13: fosc/32 with SMOD = 1, fosc/64 with 0: 11 bits of it from start to stop bit's end."""
    cpu = cpu_with(f"ORL PCON,#{smod}\nMOV SCON,#80h\nMOV SBUF,#00h\nSJMP $")
    cpu.run(200)
    (start, low), (stop, high) = cpu.txd.edges()
    assert (low, high) == (0, 1)
    assert stop - start == 10 * period  # start, eight zeros, TB8 = 0
    assert cpu.bus.sent == [(0x00, stop)]
