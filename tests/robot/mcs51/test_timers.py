"""Timers: the documented convention to the cycle, and the lazy ones against a twin that steps every cycle.

4316E is Atmel's 8051 Hardware Manual, 1919D the AT89S52 data sheet, whose sections 10 to 12 have timer 2 too.
"""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_robot.mcs51.cpu import Cpu
from tests.naive.mcs51_timers import NaiveTimers
from tests.robot.mcs51.asm import SFRS, assemble
from tests.robot.mcs51.rig import RecordingBus, cpu_with, run_to_loop, sfr, stepped, whole_and_cut
from tests.states import snapshot

REGISTERS = ("TMOD", "TCON", "TL0", "TH0", "TL1", "TH1", "T2CON", "T2MOD", "TL2", "TH2", "RCAP2L", "RCAP2H")


def test_the_first_count_is_in_the_cycle_after_setb_tr():
    """4316E section 2.9, convention."""
    cpu = stepped("MOV TMOD,#01h\nSETB TR0\nMOV A,TL0\nMOV R0,TL0\nMOV R1,TL0")
    assert (cpu.a, cpu.peek_iram(0), cpu.peek_iram(1)) == (1, 2, 4)  # two-cycle moves read in their first


COUNT = "MOV TMOD,#01h\nMOV TL0,#{low}h\nMOV TH0,#0FFh\nSETB TR0\nNOP\nMOV A,#0F3h\n"  # then TL0 = low + 2


@pytest.mark.parametrize(
    "reader",
    ["MOV A,TL0", "MOV 30h,TL0\nMOV A,30h", "MOV R0,TL0\nMOV A,R0", "PUSH TL0\nPOP ACC", "XCH A,TL0"],
)
def test_an_operand_is_read_in_the_first_cycle_of_its_instruction(reader):
    """Chosen, no sheet says when: a timer is read with the count of that cycle."""
    assert stepped(COUNT.format(low="0F0") + reader).a == 0xF3


@pytest.mark.parametrize(("other", "less"), [("0F2h", 1), ("0F3h", 0), ("0F4h", 0)])
def test_a_compare_reads_in_its_first_cycle(other, less):
    """The same for CJNE: TL0 is F3h in its first cycle and F4h in its second."""
    cpu = stepped(COUNT.format(low="0F0").replace("0F3h", other) + "CJNE A,TL0,end\nend:")
    assert cpu.cy == less


@pytest.mark.parametrize(("low", "jumps"), [("0FC", False), ("0FD", True), ("0FE", True)])
def test_a_branch_on_a_bit_reads_in_its_first_cycle(low, jumps):
    """The same for JB and JNB: from FDh the timer overflows in their first cycle, from FCh in their second."""
    for branch, taken in (("JB", jumps), ("JNB", not jumps)):
        cpu = stepped(COUNT.format(low=low) + f"{branch} TF0,there\nNOP\nthere:", 7)
        assert (cpu.pc == len(assemble(COUNT.format(low=low))) + 4) == taken


@pytest.mark.parametrize("between", [0, 1, 5])
def test_setb_to_clr_with_k_instructions_between_counts_k_plus_1(between):
    """4316E section 2.9, convention."""
    cpu = run_to_loop("MOV TMOD,#11h\nSETB TR1\n" + "NOP\n" * between + "CLR TR1")
    assert sfr(cpu, "TL1") == between + 1


def test_a_write_wins_over_the_counts_of_its_own_instruction():
    cpu = stepped("MOV TMOD,#01h\nSETB TR0\nMOV TL0,#50h\nMOV A,TL0")
    assert cpu.a == 0x51


@pytest.mark.parametrize(
    ("mode", "tl", "th", "cycles", "after"),
    [
        (0, 0x1F, 0xFF, 1, (0x00, 0x00)),
        (0, 0xFE, 0xFF, 2, (0xE0, 0x00)),  # TL.7:5 keep what was written
        (1, 0xFF, 0xFF, 1, (0x00, 0x00)),
        (2, 0xFF, 0xF3, 1, (0xF3, 0xF3)),
        (2, 0xFF, 0xF3, 14, (0xF3, 0xF3)),
    ],
)
def test_modes_0_to_2_overflow_where_they_should(mode, tl, th, cycles, after):
    """4316E section 2.9."""
    lines = f"MOV TMOD,#{mode:02X}h\nMOV TL0,#{tl:02X}h\nMOV TH0,#{th:02X}h\nSETB TR0\n"
    cpu = run_to_loop(lines + "NOP\n" * (cycles - 1) + "CLR TR0")
    assert (sfr(cpu, "TL0"), sfr(cpu, "TH0")) == after
    assert sfr(cpu, "TCON") == 0x20


def test_mode_3_makes_two_timers_of_timer_0_and_leaves_timer_1_without_a_flag():
    """4316E section 2.9."""
    cpu = run_to_loop("MOV TMOD,#23h\nMOV TH1,#0FEh\nSETB TR1\nMOV TL0,#0FDh\nSETB TR0\n" + "NOP\n" * 8)
    assert sfr(cpu, "TCON") == 0x70
    cpu.run(cpu.cycles + 256)
    assert sfr(cpu, "TCON") == 0xF0


def test_timer_1_in_mode_3_stands_still():
    """4316E section 2.9."""
    cpu = run_to_loop("MOV TMOD,#30h\nMOV TL1,#12h\nSETB TR1\nNOP\nNOP")
    assert sfr(cpu, "TL1") == 0x12


def test_a_counter_counts_falls_one_cycle_after_their_sample():
    """4316E section 2.9."""
    cpu = cpu_with("MOV TMOD,#05h\nSETB TR0\nMOV A,TL0\nMOV A,TL0\nMOV A,TL0\nMOV A,TL0")
    cpu.set_external(3, 0xEF, 12 * 4)  # T0 low for the sample of cycle 4
    seen = []
    for _ in range(6):
        cpu.step()
        seen.append((cpu.cycles - 1, cpu.a))
    assert seen[2:] == [(3, 0), (4, 0), (5, 1), (6, 1)]


@given(
    st.lists(st.integers(60, 3000), min_size=1, max_size=12),
    st.sampled_from(["05h", "0Dh", "55h", "50h", "5Dh"]),
)
def test_falls_within_an_instruction_count_however_a_run_is_cut(ticks, mode):
    """An instruction of four cycles goes on beyond the end of its piece of a run, and pins move meanwhile."""

    def prepare():
        cpu = cpu_with(f"MOV TMOD,#{mode}\nMOV TCON,#50h\nloop:\nMUL AB\nSJMP loop")
        for number, tick in enumerate(sorted(ticks)):
            cpu.set_external(3, 0xFF if number % 2 else 0xC7, tick)  # T0, T1 and INT1
        return cpu

    whole, cut = whole_and_cut(prepare, 300)
    cut.run(whole.cycles)
    assert snapshot(whole) == snapshot(cut)


def test_a_gate_is_the_pin_and_not_the_interrupt_flag():
    """4316E section 2.9."""
    cpu = cpu_with("MOV TMOD,#09h\nSETB IT0\nSETB TR0\nNOP\nNOP\nMOV A,TL0\nMOV A,TL0\nMOV A,TL0")
    cpu.set_external(3, 0xFB, 0)
    cpu.set_external(3, 0xFF, 12 * 6)
    for _ in range(8):
        cpu.step()
    assert cpu.a == 2  # sampled high in cycle 6, counts in 7 and 8


def test_timer_2_reloads_and_flags_a_cycle_sooner_than_the_others():
    """1919D section 13: TF2 at S2P2, polled in the same cycle."""
    body = "LJMP main\nORG 000Bh\nRETI\nORG 002Bh\nRETI\nORG 0040h\nmain:\n"
    entered = {}
    for name, setup, vector in (
        ("T0", "MOV TMOD,#01h\nMOV TL0,#0F0h\nMOV TH0,#0FFh\nMOV IE,#82h\nNOP\nSETB TR0\n", 0x0B),
        ("T2", "MOV TMOD,#01h\nMOV TL2,#0F0h\nMOV TH2,#0FFh\nMOV IE,#0A0h\nNOP\nSETB TR2\n", 0x2B),
    ):
        cpu = cpu_with(body + setup + "NOP\n" * 60)
        assert cpu.run_until_any((vector,), 100) == 2
        entered[name] = cpu.cycles
    assert entered["T2"] == entered["T0"] - 1


def test_an_isr_sees_what_the_documents_give_after_a_mode_1_overflow():
    """4316E sections 2.16 and 2.9: 4, where ucsim gives 2."""
    cpu = cpu_with(
        "LJMP main\nORG 000Bh\nMOV A,TL0\nSJMP $\nORG 0040h\nmain:\n"
        "MOV TMOD,#01h\nMOV TL0,#0F0h\nMOV TH0,#0FFh\nMOV IE,#82h\nSETB TR0\n" + "NOP\n" * 60
    )
    cpu.run(60)
    assert cpu.a == 4


# ------------------------------------------------------------------------------- timer 2

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
    "auto-reload has the period of its reload value": (  # 100 cycles, counted from 10 on
        FULL + "MOV RCAP2L,#9Ch\nMOV RCAP2H,#0FFh\nMOV T2CON,#04h\n", 0xFF,
        ("TL2", "T2CON"), {10: (0xFF, 0x04), 11: (0x9C, 0x84), 110: (0xFF, 0x84), 111: (0x9C, 0x84)},
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
    assert cpu.run_until_any((0x2B,), 100) == 2
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


# ------------------------------------------------------------------------------- beside the slow twin

PINS = st.fixed_dictionaries({name: st.integers(0, 1) for name in ("int0", "int1", "t0", "t1", "t2", "t2ex")})
NEAR_TOP = st.one_of(st.integers(0, 255), st.sampled_from([0xFF, 0xFE, 0xF0, 0x1F, 0x1E, 0xFD]))
STEPS = st.lists(
    st.tuples(
        st.integers(1, 400),
        st.one_of(
            st.tuples(st.sampled_from(REGISTERS), NEAR_TOP),
            st.tuples(st.just("pins"), PINS),
            st.tuples(st.just("look"), st.none()),
        ),
    ),
    max_size=40,
)


def push(cpu, pins):
    p1 = 0xFC | pins["t2"] | pins["t2ex"] << 1
    p3 = 0xC3 | pins["int0"] << 2 | pins["int1"] << 3 | pins["t0"] << 4 | pins["t1"] << 5
    cpu.set_external(1, p1, 12 * cpu.cycles)
    cpu.set_external(3, p3, 12 * cpu.cycles)


ALL_LOW = dict.fromkeys(("int0", "int1", "t0", "t1", "t2", "t2ex"), 0)


@pytest.mark.slow
@settings(max_examples=150)
@given(st.lists(st.tuples(st.sampled_from(REGISTERS), NEAR_TOP), max_size=12), STEPS)
@example([], [(4, ("T2CON", 0x08)), (1, ("pins", ALL_LOW)), (1, ("look", None)), (1, ("look", None))])
@example([("T2CON", 0x24)], [(1, ("pins", ALL_LOW)), (1, ("T2CON", 0x2C)), (1, ("look", None))])
def test_lazy_timers_equal_those_that_step_every_cycle(setup, steps):
    cpu = Cpu(RecordingBus())
    cpu.load(bytes(0x10000))  # NOPs
    naive = NaiveTimers()
    pins = dict.fromkeys(("int0", "int1", "t0", "t1", "t2", "t2ex"), 1)
    for advance, (kind, value) in [*((0, write) for write in setup), *steps]:
        cpu.run(cpu.cycles + advance)
        for _ in range(advance):
            naive.cycle(pins)
        if kind == "pins":
            pins = value
            push(cpu, pins)
        elif kind != "look":
            cpu.peripherals.write(SFRS[kind], value, cpu.cycles)
            external = naive.tcon & 0x0F
            setattr(naive, kind.lower(), value & 0x03 if kind == "T2MOD" else value)
            naive.tcon = naive.tcon & 0xF0 | external
        seen = {name: sfr(cpu, name) for name in REGISTERS}
        seen["TCON"] &= 0xF0
        assert seen == {name: getattr(naive, name.lower()) for name in REGISTERS}
        assert cpu.peripherals.timer2.clock_out == naive.clock_out
