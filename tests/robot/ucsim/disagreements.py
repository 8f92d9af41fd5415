"""Where ucsim 0.6.4 does not do what the data sheets say; there the data sheets win. Where they leave open what
happens, the entry says what was chosen.

How a random walk keeps away from these is in `exclusions.py`; each is shown on both machines in
`test_disagreements.py`. `tests/vectors/README.md` repeats the list: `python -m tests.robot.ucsim.disagreements`
prints the table that has to stand there. Sources: Atmel's 8051 Hardware Manual (4316E), the AT89S52 data sheet
(1919D) and the AT89C51AC2 data sheet (4127H).
"""

from typing import NamedTuple


class Disagreement(NamedTuple):
    """What both do, and who says so."""

    name: str
    ucsim: str
    data_sheet: str
    source: str
    held_by: str  # the test that holds ours to the sheet, beside the one in `test_disagreements.py`


DISAGREEMENTS = (
    Disagreement(
        "bank-by-bit",
        "SETB, CLR, CPL and JBC of RS0 or RS1, and MOV RS0/RS1,C, leave the register bank as it was",
        "the bank is what PSW.4:3 says",
        "4316E, program status word; fixed in ucsim 0.9.9 (issue 11)",
        "test_instructions.py::test_every_way_of_writing_rs0_switches_the_bank",
    ),
    Disagreement(
        "parity-write",
        "P keeps what was written to PSW until ACC is written",
        "P is the parity of ACC in every cycle",
        "4316E, program status word",
        "test_instructions.py::test_parity_is_that_of_acc_whatever_is_written_to_psw",
    ),
    Disagreement(
        "p0-after-movx",
        "keeps the P0 latch",
        "any external access writes FFh to it",
        "4316E section 2.6",
        "test_instructions.py::test_movx_puts_ff_into_the_latch_of_p0_and_tells_when_it_strobes",
    ),
    Disagreement(
        "movx-strobe",
        "reads and writes external RAM whatever P3 holds",
        "/RD and /WR are ANDed with the latches of P3.7 and P3.6: with 0 there, no strobe",
        "4316E section 2.5, alternate functions",
        "test_instructions.py::test_movx_strobes_are_gated_by_the_latch_of_p3",
    ),
    Disagreement(
        "stack-wrap",
        "stops with an error",
        "SP is an 8-bit counter",
        "4316E, stack pointer",
        "test_instructions.py::test_a_stack_that_wraps_is_a_fault",
    ),
    Disagreement(
        "pc-wrap",
        "a branch, or JMP @A+DPTR, to 10000h exactly ends there and not at 0000h; one beyond wraps",
        "PC is a 16-bit register",
        "4316E, program counter",
        "test_opcodes.py::test_code_wraps_at_64_kb",
    ),
    Disagreement(
        "movc-wrap",
        "MOVC beyond FFFFh reads 0",
        "16-bit addition, so that it goes on at 0000h",
        "4316E, MOVC",
        "test_instructions.py::test_movc_beyond_ffff_goes_on_at_0000",
    ),
    Disagreement(
        "level-interrupt",
        "IE0 and IE1 are sticky in level mode",
        "they follow the inverted pin, sampled at S5P2 (walks keep INT0 and INT1 high)",
        "4316E section 2.16",
        "test_interrupts.py::test_a_level_flag_follows_the_pin_both_ways",
    ),
    Disagreement(
        "early-write",
        "a two-cycle instruction writes timer registers and ports in its first cycle: what runs on them "
        "counts or samples the second",
        "a register changes at the end of the last cycle",
        "4316E section 2.4; for ports section 2.5.2",
        "test_timers.py::test_a_write_wins_over_the_counts_of_its_own_instruction",
    ),
    Disagreement(
        "late-read",
        "JB, JNB and CJNE A,dir see a running timer as it is in their second cycle, all others of two cycles in "
        "their first",
        "when an operand is read is not documented; chosen: always in the first cycle",
        "none; 4316E section 2.4 gives the fetches only",
        "test_timers.py::test_an_operand_is_read_in_the_first_cycle_of_its_instruction",
    ),
    Disagreement(
        "counted-edges",
        "timers 0 and 1 as counters count rising edges",
        "they count falling edges",
        "4316E section 2.9",
        "test_timers.py::test_a_counter_counts_falls_one_cycle_after_their_sample",
    ),
    Disagreement(
        "mode-0-low",
        "TL.7:5 become 0 when a timer in mode 0 counts",
        "indeterminate, to be ignored; chosen: they stay as written (of two emulators named emu8051, that of "
        "H. Villeneuve clears them, that of J. Komppa keeps them)",
        "none for the choice; 4316E section 2.9, and 4127H (AT89C51AC2), timer 0, mode 0",
        "test_timers.py::test_modes_0_to_2_overflow_where_they_should",
    ),
    Disagreement(
        "timer-1-beside-mode-3",
        "timer 1 obeys TR1 while timer 0 is in mode 3",
        "it runs whenever it is not in mode 3 itself",
        "4316E section 2.10",
        "test_timers.py::test_mode_3_makes_two_timers_of_timer_0_and_leaves_timer_1_without_a_flag",
    ),
    Disagreement(
        "t2ex-memory",
        "a fall of T2EX before EXEN2 was set acts once it is set",
        "a fall acts while EXEN2 is set",
        "4316E section 2.12",
        "test_timer2.py::test_exen2_counts_as_it_stands_in_the_cycle_that_acts",
    ),
    Disagreement(
        "absent-bits",
        "register addresses and bits that an AT89C52 lacks hold what is written; so does all of T2MOD",
        "undefined; T2MOD has two bits, and DCEN counts down",
        "1919D table 5-1",
        "test_instructions.py::test_registers_that_do_not_exist_read_as_ff",
    ),
    Disagreement(
        "serial-port",
        "sends and receives whole bytes, with other timing; one SBUF",
        "bit by bit with a 16x clock; SBUF is two registers",
        "4316E section 2.13",
        "test_uart.py::test_bits_last_208_cycles_at_9600_baud",
    ),
    Disagreement(
        "count-down",
        "counts up whatever T2MOD says",
        "with DCEN and T2EX low timer 2 counts down",
        "1919D section 11",
        "test_timer2.py::test_dcen_counts_down_to_rcap2_and_then_from_ffff",
    ),
    Disagreement(
        "interrupt-latency",
        "takes an interrupt at once",
        "latched at S5P2, polled in the next cycle, 3 to 8 cycles after the flag",
        "4316E section 2.16, 1919D section 13",
        "test_interrupts.py::test_latency_is_three_to_eight_full_cycles",
    ),
    Disagreement(
        "interrupt-priority",
        "of two pending ones takes the first in polling order, also if it is of low priority",
        "high level first",
        "4316E section 2.16",
        "test_interrupts.py::test_of_two_at_once_the_priority_decides_and_then_the_polling_order",
    ),
    Disagreement(
        "interrupt-delay",
        "takes an interrupt right after a bit of IE, or IP, was written",
        "one more instruction after RETI and any write to IE or IP",
        "4316E section 2.16",
        "test_interrupts.py::test_latency_is_three_to_eight_full_cycles",
    ),
)


def table():
    """As Markdown, for the README."""
    lines = [
        "| name | ucsim 0.6.4 | data sheet, and ours | source | held by `tests/robot/mcs51/` |",
        "|" + "---|" * 5,
    ]
    for entry in DISAGREEMENTS:
        lines.append(
            f"| {entry.name} | {entry.ucsim} | {entry.data_sheet} | {entry.source} | `{entry.held_by}` |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(table(), end="")
