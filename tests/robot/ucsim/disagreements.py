"""Where ucsim 0.6.4 does not do what the data sheets say; there the data sheets win.

What belongs here: the list. How a random walk keeps away from these is in `exclusions.py`, what is tested in
their place in `tests/vectors/README.md`, which repeats each entry. Sources: Atmel's 8051 Hardware Manual
(4316E) and the AT89S52 data sheet (1919D).
"""

from __future__ import annotations

from typing import NamedTuple


class Disagreement(NamedTuple):
    """What both do, and who says so."""

    name: str
    ucsim: str
    data_sheet: str
    source: str


DISAGREEMENTS: tuple[Disagreement, ...] = (
    Disagreement(
        "bank-by-bit",
        "SETB, CLR, CPL and JBC of RS0 or RS1, and MOV RS0/RS1,C, leave the register bank as it was",
        "the bank is what PSW.4:3 says",
        "4316E, program status word; fixed in ucsim 0.9.9 (issue 11)",
    ),
    Disagreement(
        "parity-write",
        "P keeps what was written to PSW until ACC is written",
        "P is the parity of ACC in every cycle",
        "4316E, program status word",
    ),
    Disagreement(
        "p0-after-movx",
        "keeps the P0 latch",
        "any external access writes FFh to it",
        "4316E section 2.6",
    ),
    Disagreement(
        "movx-strobe",
        "reads and writes external RAM whatever P3 holds",
        "/RD and /WR are ANDed with the latches of P3.7 and P3.6: with 0 there, no strobe",
        "4316E section 2.5, alternate functions",
    ),
    Disagreement(
        "stack-wrap",
        "stops with an error",
        "SP is an 8-bit counter",
        "4316E, stack pointer",
    ),
    Disagreement(
        "pc-wrap",
        "a branch from below to 10000h exactly ends there and not at 0000h",
        "PC is a 16-bit register",
        "4316E, program counter",
    ),
    Disagreement(
        "movc-wrap",
        "MOVC beyond FFFFh reads 0",
        "16-bit addition, so that it goes on at 0000h",
        "4316E, MOVC",
    ),
    Disagreement(
        "level-interrupt",
        "IE0 and IE1 are sticky in level mode",
        "they follow the inverted pin, sampled at S5P2 (walks keep INT0 and INT1 high)",
        "4316E section 2.16",
    ),
    Disagreement(
        "early-write",
        "a two-cycle instruction writes timer registers and ports in its first cycle: what runs on them "
        "counts or samples the second",
        "a register changes at the end of the last cycle",
        "4316E section 2.4; for ports section 2.5.2",
    ),
    Disagreement(
        "counted-edges",
        "timers 0 and 1 as counters count rising edges",
        "they count falling edges",
        "4316E section 2.9",
    ),
    Disagreement(
        "mode-0-low",
        "TL.7:5 become 0 when a timer in mode 0 counts",
        "they are undefined; ours stay",
        "4316E section 2.9",
    ),
    Disagreement(
        "timer-1-beside-mode-3",
        "timer 1 obeys TR1 while timer 0 is in mode 3",
        "it runs whenever it is not in mode 3 itself",
        "4316E section 2.10",
    ),
    Disagreement(
        "t2ex-memory",
        "a fall of T2EX before EXEN2 was set acts once it is set",
        "a fall acts while EXEN2 is set",
        "4316E section 2.12",
    ),
    Disagreement(
        "absent-bits",
        "register addresses and bits that an AT89C52 lacks hold what is written; so does all of T2MOD",
        "undefined; T2MOD has two bits, and DCEN counts down",
        "1919D table 5-1",
    ),
    Disagreement(
        "serial-port",
        "sends and receives whole bytes, with other timing; one SBUF",
        "bit by bit with a 16x clock; SBUF is two registers",
        "4316E section 2.13",
    ),
    Disagreement(
        "interrupt-timing",
        "takes an interrupt at once, by polling order alone",
        "3 to 8 cycles after the flag, high level first",
        "4316E section 2.16, 1919D section 13",
    ),
)
