"""When the bare machine's serial input begins, how it goes on, and that cuts change nothing."""

from itertools import pairwise

import pytest

from miro_exact.state import restore, snapshot
from miro_robot.bare.input import InputPiece
from miro_robot.bare.machine import BareMachine, Ended
from tests.robot.mcs51.test_bare import AUTOBAUD, ECHO, SERIAL, image

PROMPT = (
    SERIAL
    + """
prompt:
MOV SBUF,#3Eh
JNB TI,$
CLR TI
JNB RI,$
MOV A,SBUF
CLR RI
MOV @R0,A
INC R0
CJNE A,#0Dh,prompt
MOV PCON,#02h
"""
)
SLOW_POLLS = "MOV R7,#200\nw:\nDJNZ R7,w\nJB RXD,slow\nMOV PCON,#02h"  # five polls in 2000 cycles


def test_a_piece_begins_at_its_time_whether_the_program_seems_to_listen_or_not():
    text = "slow:\n" + SLOW_POLLS
    machine = BareMachine(image(text), stdin=(InputPiece(b"\x00", delay_ticks=240_000),), baud=9600)
    assert machine.run(max_cycles=100_000) == Ended.HALTED
    assert 20_000 <= machine.cpu.cycles <= 20_500
    plain = BareMachine(image(text), stdin=b"\x00", baud=9600)
    assert plain.run(max_cycles=100_000) == Ended.CYCLES


def test_a_piece_with_a_time_waits_for_a_receiver_that_is_on_and_free():
    machine = BareMachine(image(ECHO), stdin=(InputPiece(b"ab", delay_ticks=1_200_000),))
    machine.run(max_cycles=90_000)
    assert machine.input.left == 2
    machine.run(max_cycles=120_000)
    assert machine.input.left == 0


def test_a_text_releases_what_waits_for_it_and_only_once():
    pieces = (InputPiece(b"x", b">"), InputPiece(b"y", b">"), InputPiece(b"\r", b">"))
    machine = BareMachine(image("MOV R0,#40h\n" + PROMPT), stdin=pieces)
    assert machine.run(max_cycles=200_000) == Ended.HALTED
    assert bytes(machine.cpu.peek_iram(0x40 + number) for number in range(3)) == b"xy\r"


def test_a_text_counts_only_behind_the_piece_before():
    """Its first letter would fit the prompt that came before."""
    pieces = (InputPiece(b"x", b">"), InputPiece(b"\r", b">>"))
    machine = BareMachine(image("MOV R0,#40h\n" + PROMPT), stdin=pieces)
    assert machine.run(max_cycles=200_000) == Ended.CYCLES
    assert (machine.input.waiting_for, machine.input.left) == (b">>", 1)


def test_characters_keep_their_gap():
    sent = []
    machine = BareMachine(image(ECHO), stdin=b"abc", gap_ticks=480_000)
    machine.output = lambda data: sent.append(machine.cpu.cycles)
    machine.run(max_cycles=300_000)
    assert len(sent) == 3
    assert all(later - earlier >= 40_000 for earlier, later in pairwise(sent))


@pytest.mark.parametrize("crystal_hz", [11_059_200, 12_000_000, 24_000_000])
def test_the_bit_rate_is_that_of_the_crystal(crystal_hz):
    machine = BareMachine(image(AUTOBAUD), stdin=b" ", baud=2400, crystal_hz=crystal_hz)
    assert machine.run() == Ended.HALTED
    cycles = machine.cpu.peek_iram(0x30) * 9
    assert cycles % 2304 == pytest.approx(6 * crystal_hz / 12 / 2400 % 2304, abs=12)


def test_keys_that_are_added_later_are_sent_and_wait_for_nothing_else():
    out = bytearray()
    machine = BareMachine(image(ECHO), output=out.extend, live=True)
    assert machine.run(pause=50_000) == Ended.PAUSED
    machine.input.add(b"hi")
    machine.input.add(b"!")
    assert machine.run(pause=100_000) == Ended.PAUSED
    assert bytes(out) == b"hi!"


@pytest.mark.parametrize("step", [487, 1_001])
def test_a_dialogue_that_is_cut_and_saved_is_the_same(step):
    pieces = (
        InputPiece(b"x", b">", 5_000),
        InputPiece(b"y", b">"),
        InputPiece(b"", b"?"),
        InputPiece(b"z\r", delay_ticks=7),
    )
    whole, cut, other = (
        BareMachine(image("MOV R0,#40h\n" + PROMPT), stdin=pieces, gap_ticks=999) for _ in range(3)
    )
    assert whole.run() == Ended.HALTED
    pause = step
    while cut.run(pause=pause) == Ended.PAUSED:
        pause += step
        restore(other, snapshot(cut))
        cut, other = other, cut
    assert snapshot(cut) == snapshot(whole)
    assert bytes(whole.cpu.peek_iram(0x40 + number) for number in range(4)) == b"xyz\r"
