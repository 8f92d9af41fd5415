"""The board alone of `fw run`: RAM, terminal, ends of a run, dumps, serial input, levels of pins from a file."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.faults import FaultKind
from miro_sim.scenario.terminal import InputPiece, PinEvent, read_pins
from tests.alone import Alone, Ended
from tests.robot.mcs51.asm import assemble, image_of
from tests.states import restore, snapshot

SERIAL = "MOV RCAP2H,#0FFh\nMOV RCAP2L,#0B2h\nMOV T2CON,#34h\nMOV SCON,#50h\n"
ECHO = SERIAL + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nMOV SBUF,A\nJNB TI,$\nCLR TI\nSJMP loop"
AUTOBAUD = "MOV R2,#0\nMOV R3,#0\nCLR A\nJB RXD,$\n"
AUTOBAUD += "measure:\nINC A\n" + "NOP\n" * 6 + "JNB RXD,measure\nMOV 30h,A\nSJMP $"


def test_stdin_is_echoed_byte_by_byte():
    out = bytearray()
    machine = Alone(image_of(ECHO), stdin=b"hello, world\n", output=out.extend)
    assert machine.run(max_cycles=100_000) == Ended.CYCLES
    assert bytes(out) == b"hello, world\n"


def test_with_wait_the_next_byte_waits_until_ri_was_cleared():
    slow = SERIAL + "loop:\nJNB RI,$\nMOV @R0,SBUF\nINC R0\nMOV R7,#00h\nw:\nMOV R6,#20\nDJNZ R6,$\n"
    slow += "DJNZ R7,w\nCLR RI\nSJMP loop"
    machine = Alone(image_of("MOV R0,#30h\n" + slow), stdin=b"abcdef", wait=True)
    machine.run(max_cycles=200_000)
    assert bytes(machine.cpu.peek_iram(0x30 + n) for n in range(6)) == b"abcdef"


def test_a_program_may_measure_the_bit_rate_of_its_first_character():
    machine = Alone(image_of(AUTOBAUD), stdin=b" ", baud=9600)
    assert machine.run() == Ended.HALTED
    low_cycles = machine.cpu.peek_iram(0x30) * 9
    assert low_cycles == pytest.approx(6 * 2_000_000 / 9600, abs=12)  # start bit and five zeros of a space


def test_without_a_baud_rate_nothing_is_sent_to_a_receiver_that_is_off():
    machine = Alone(image_of(AUTOBAUD), stdin=b" ")
    assert machine.run(max_cycles=50_000) == Ended.CYCLES
    assert machine.cpu.peek_iram(0x30) == 0


def test_external_ram_is_64_kb_apart_from_code():
    machine = Alone(image_of("MOV DPTR,#0000h\nMOV A,#5Ah\nMOVX @DPTR,A\nMOV A,#00h\nMOVC A,@A+DPTR\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert machine.cpu.a == 0x90
    assert machine.dump()["xram_hex"].startswith("5a00")


def test_code_in_xram_runs_what_it_writes():
    store = "MOV A,#{}\nMOVX @DPTR,A\nINC DPTR\n"
    text = "MOV DPTR,#0100h\n" + "".join(store.format(byte) for byte in ("74h", "33h", "22h"))
    text += "LCALL 0100h\nSJMP $"
    machine = Alone(image_of(text), code_in_xram=True)
    assert machine.run() == Ended.HALTED
    assert machine.cpu.a == 0x33
    assert machine.faults == []
    other = Alone(image_of(text))
    assert other.run(max_cycles=1000) == Ended.FAULT


def test_where_a_program_may_end_is_searched_once_for_an_image():
    first, other = (Alone(image_of(text)) for text in ("NOP\nSJMP $", "SJMP $\nNOP"))
    assert (first.board.loops, other.board.loops) == ((1,), (0,))
    again = Alone(image_of("NOP\nSJMP $"), code_in_xram=True)
    assert again.board.loops is first.board.loops


def test_a_run_stops_at_an_address_and_goes_on():
    machine = Alone(image_of("NOP\nNOP\nMOV A,#01h\nSJMP $"))
    assert machine.run(until=2, max_cycles=1000) == Ended.UNTIL
    assert machine.cpu.a == 0
    assert machine.run() == Ended.HALTED


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("SJMP $", (0, 2, 1)),
        ("LJMP 0000h", (0, 2, 1)),
        ("NOP\nAJMP 0001h", (1, 3, 2)),
        ("SETB EA\nSJMP $", (2, 3, 2)),
    ],
)
def test_whatever_jump_leads_to_itself_ends_a_program_where_no_interrupt_may_come(text, end):
    machine = Alone(image_of(text))
    assert machine.run() == Ended.HALTED
    assert (machine.cpu.pc, machine.cpu.cycles, machine.cpu.instructions) == end


@pytest.mark.parametrize("main", ["SJMP $", "JB F0,done\nSJMP main"])
def test_a_limit_that_is_not_reached_changes_nothing(main):
    text = "LJMP start\nORG 0023h\nCLR RI\nMOV A,SBUF\nDJNZ R7,back\nLJMP done\nback:\nRETI\nstart:\n"
    text += SERIAL + f"MOV R7,#5\nMOV IE,#90h\nmain:\n{main}\ndone:\nNOP\nSJMP $"
    free, limited = (Alone(image_of(text), stdin=b"hello") for _ in range(2))
    until = assemble(text).rindex(b"\x00\x80\xfe")
    assert free.run(until=until) == Ended.UNTIL
    assert limited.run(until=until, max_cycles=1_000_000) == Ended.UNTIL
    assert free.dump() == limited.dump()


def test_a_jump_to_itself_that_interrupts_leave_is_no_end():
    program = "LJMP main\nORG 000Bh\nINC 30h\nRETI\nmain:\nMOV TMOD,#02h\nSETB TR0\nMOV IE,#82h\nSJMP $"
    machine = Alone(image_of(program))
    assert machine.run(pause=1_000_000) == Ended.PAUSED
    assert machine.cpu.peek_iram(0x30) > 0


def test_bytes_that_only_look_like_a_jump_to_itself_end_nothing():
    machine = Alone(image_of("MOV 80h,#0FEh\nMOV DPTR,#80FEh\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert (machine.cpu.pc, machine.cpu.dptr) == (6, 0x80FE)


@pytest.mark.parametrize("step", [1, 7, 333, 1_001])
@pytest.mark.parametrize("text", [ECHO, SERIAL + "MOV SBUF,#41h\nSJMP $", "NOP\nMOV PCON,#01h\nSJMP $"])
def test_a_run_that_is_paused_is_the_same_run(text, step):
    whole, cut = (Alone(image_of(text), stdin=b"hi!") for _ in range(2))
    limit = 12_000 if text == ECHO else None
    ended = whole.run(max_cycles=limit)
    pause = step
    while (cut_ended := cut.run(max_cycles=limit, pause=pause)) == Ended.PAUSED:
        pause += step if pause < 20_000 else 100_000
    assert cut_ended == ended
    assert snapshot(cut) == snapshot(whole)


def test_a_fault_names_kind_place_and_tick():
    machine = Alone(image_of("NOP\nDB 0A5h\nSJMP $"))
    assert machine.run(max_cycles=1000) == Ended.FAULT
    fault = machine.faults[0]
    assert (fault.kind, fault.pc, fault.tick) == (FaultKind.UNDEFINED_OPCODE, 1, 24)
    assert str(fault) == "firmware executed the undefined opcode A5 at 0x0001, tick 24"
    forgiving = Alone(image_of("NOP\nDB 0A5h\nSJMP $"), stop_on_fault=False)
    assert forgiving.run() == Ended.HALTED


@pytest.mark.parametrize(
    ("mode", "lasts"), [("#00h", 30), ("#80h", 1_000), ("#0D8h", 1_000)], ids=["mode 0", "mode 2", "mode 3"]
)
def test_a_program_may_send_as_much_as_it_likes(mode, lasts):
    out = bytearray()
    text = f"MOV TMOD,#20h\nMOV TH1,#0FFh\nMOV TCON,#40h\nMOV SCON,{mode}\nloop:\nMOV SBUF,#55h\nJNB TI,$\n"
    machine = Alone(image_of(text + "CLR TI\nSJMP loop"), output=out.extend)
    assert machine.run(max_cycles=1_000 * lasts) == Ended.CYCLES
    assert bytes(out) == b"U" * len(out)
    assert len(out) > 1_000


def test_the_dump_has_the_registers():
    machine = Alone(image_of("SETB EA\nMOV B,#12h\nloop:\nNOP\nSJMP loop"))
    assert machine.run(until=6, max_cycles=500_000) == Ended.UNTIL
    assert machine.cpu.pc == 6
    assert machine.run(max_cycles=500_000) == Ended.CYCLES
    dump = machine.dump()
    assert (dump["pc"], dump["sfr"]["f0"], len(dump["iram_hex"]), len(dump["xram_hex"])) == (
        5,
        0x12,
        512,
        0x20000,
    )


@pytest.mark.parametrize(
    ("baud", "crystal_hz", "said"), [(5, 24_000_000, "750000"), (400_000, 11_059_200, "345600")]
)
def test_a_baud_rate_that_no_receiver_reaches_is_refused(baud, crystal_hz, said):
    with pytest.raises(ValueError, match=f"baud {baud} is outside 50..{said} at {crystal_hz} Hz"):
        Alone(image_of("NOP"), baud=baud, crystal_hz=crystal_hz)


def test_a_crystal_that_no_8051_has_is_refused():
    with pytest.raises(ValueError, match="crystal 5 Hz is outside"):
        Alone(image_of("NOP"), crystal_hz=5)


def test_a_limit_does_not_keep_a_program_from_ending():
    machine = Alone(image_of("NOP\nSJMP $"))
    assert machine.run(max_cycles=1000) == Ended.HALTED
    assert machine.cpu.cycles == 3
    assert Alone(image_of("NOP\nSJMP $")).run(max_cycles=1) == Ended.CYCLES


@pytest.mark.parametrize("limit", [None, 1_000_000])
@pytest.mark.parametrize(
    ("text", "cycles"),
    [
        ("MOV PCON,#01h", 2),
        ("MOV PCON,#02h", 2),
        ("MOV IE,#90h\nMOV PCON,#01h", 4),
        ("MOV IE,#90h\nMOV SCON,#50h\nMOV PCON,#01h", 6),
        ("MOV IE,#85h\nMOV PCON,#01h", 4),
        ("MOV IE,#8Ah\nMOV PCON,#01h", 4),
        ("SETB TR0\nMOV IE,#82h\nMOV PCON,#02h", 5),
    ],
    ids=["idle", "power-down", "serial off", "serial on", "pins", "timers off", "timer that stands"],
)
def test_a_program_that_sleeps_for_good_ends_in_that_cycle(text, cycles, limit):
    machine = Alone(image_of(text + "\nSJMP $"))
    assert machine.run(max_cycles=limit) == Ended.HALTED
    assert machine.cpu.cycles == cycles


def test_a_sleep_that_a_timer_ends_is_no_end():
    text = "LJMP main\nORG 000Bh\nINC 30h\nRETI\nmain:\nMOV TMOD,#02h\nSETB TR0\nMOV IE,#82h\n"
    machine = Alone(image_of(text + "again:\nMOV PCON,#01h\nSJMP again"))
    assert machine.run(max_cycles=5_000) == Ended.CYCLES
    assert machine.cpu.peek_iram(0x30) > 10


def test_input_that_is_still_to_come_wakes_a_sleeper():
    text = "LJMP main\nORG 0023h\nMOV A,SBUF\nCLR RI\nMOV 30h,A\nRETI\nmain:\n" + SERIAL
    machine = Alone(image_of(text + "MOV IE,#90h\nagain:\nMOV PCON,#01h\nSJMP again"), stdin=b"xyz")
    assert machine.run() == Ended.HALTED
    assert machine.cpu.peek_iram(0x30) == ord("z")
    woken = machine.cpu.cycles
    assert machine.run(pause=woken + 300_000) == Ended.HALTED
    assert (machine.cpu.cycles, machine.cpu.idle) == (woken, 1)


@pytest.mark.parametrize("sleep", ["SJMP $", "MOV PCON,#01h"])
@pytest.mark.parametrize("mode", ["", "MOV SCON,#00h\n"], ids=["uart", "shift register"])
def test_a_run_ends_with_the_last_character_that_is_being_sent(sleep, mode):
    out = bytearray()
    machine = Alone(image_of(SERIAL + mode + "MOV SBUF,#41h\n" + sleep), output=out.extend)
    assert machine.run() == Ended.HALTED
    assert bytes(out) == b"A"
    assert machine.cpu.sfr(0x98) & 0x02  # TI
    shorter = Alone(image_of(SERIAL + mode + "MOV SBUF,#41h\n" + sleep))
    assert shorter.run(pause=machine.cpu.cycles - 2) == Ended.PAUSED
    assert not shorter.cpu.sfr(0x98) & 0x02


def test_power_down_stops_the_transmitter_too():
    out = bytearray()
    machine = Alone(image_of(SERIAL + "MOV SBUF,#41h\nMOV PCON,#02h"), output=out.extend)
    assert machine.run() == Ended.HALTED
    assert (bytes(out), machine.cpu.cycles) == (b"", 12)


def test_interrupts_that_are_switched_off_at_the_end_do_not_hide_it():
    wait = "MOV R7,#200\nwait:\nDJNZ R7,wait\n"
    machine = Alone(image_of("SETB ET0\nSETB EA\n" + wait + "CLR EA\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert machine.cpu.cycles == 1 + 1 + 1 + 400 + 1 + 2


def test_faults_beyond_a_thousand_are_counted():
    machine = Alone(image_of("loop:\nDB 0A5h\nSJMP loop"), stop_on_fault=False)
    assert machine.run(max_cycles=3 * 1030) == Ended.CYCLES
    assert (len(machine.faults), machine.board.fault_count) == (1000, 1030)


def test_code_that_data_has_overwritten_is_known():
    store = "MOV DPTR,#0002h\nMOV A,#77h\nMOVX @DPTR,A\nMOV DPTR,#4000h\nMOVX @DPTR,A\nSJMP $"
    shared, apart = Alone(image_of(store), code_in_xram=True), Alone(image_of(store))
    assert shared.run() == apart.run() == Ended.HALTED
    assert (shared.board.changed_code(), apart.board.changed_code()) == ([2], [])


# ------------------------------------------------------------------------------- serial input

PROMPT = SERIAL + "prompt:\nMOV SBUF,#3Eh\nJNB TI,$\nCLR TI\nJNB RI,$\nMOV A,SBUF\nCLR RI\n"
PROMPT += "MOV @R0,A\nINC R0\nCJNE A,#0Dh,prompt\nMOV PCON,#02h"
SLOW_POLLS = "MOV R7,#200\nw:\nDJNZ R7,w\nJB RXD,slow\nMOV PCON,#02h"  # five polls in 2000 cycles


def test_a_piece_begins_at_its_time_whether_the_program_seems_to_listen_or_not():
    text = "slow:\n" + SLOW_POLLS
    machine = Alone(image_of(text), stdin=(InputPiece(b"\x00", delay_ticks=240_000),), baud=9600)
    assert machine.run(max_cycles=100_000) == Ended.HALTED
    assert 20_000 <= machine.cpu.cycles <= 20_500
    plain = Alone(image_of(text), stdin=b"\x00", baud=9600)
    assert plain.run(max_cycles=100_000) == Ended.CYCLES


def test_a_piece_with_a_time_waits_for_a_receiver_that_is_on_and_free():
    machine = Alone(image_of(ECHO), stdin=(InputPiece(b"ab", delay_ticks=1_200_000),))
    machine.run(max_cycles=90_000)
    assert machine.input.left == 2
    machine.run(max_cycles=120_000)
    assert machine.input.left == 0


def test_a_text_releases_what_waits_for_it_and_only_once():
    pieces = (InputPiece(b"x", b">"), InputPiece(b"y", b">"), InputPiece(b"\r", b">"))
    machine = Alone(image_of("MOV R0,#40h\n" + PROMPT), stdin=pieces)
    assert machine.run(max_cycles=200_000) == Ended.HALTED
    assert bytes(machine.cpu.peek_iram(0x40 + number) for number in range(3)) == b"xy\r"


BIT_TICKS = 2496  # of SERIAL
LOSES_EVERY_SECOND = f"""MOV R0,#40h
{SERIAL}
loop:
JNB RI,$
MOV @R0,SBUF
INC R0
MOV R7,#12
work:
MOV R6,#100
DJNZ R6,$
DJNZ R7,work
CLR RI
SJMP loop
"""
"""Works on each character for 2436 cycles, which is 1.17 times its length, before it clears RI."""


def starts_of(machine):
    """Start ticks of the characters, as they are put on RXD."""
    starts, send = [], machine.input._send

    def noted(start):
        starts.append(start)
        send(start)

    machine.input._send = noted
    return starts


@pytest.mark.parametrize(("wait", "taken"), [(False, b"AC\0\0"), (True, b"ABCD")])
def test_a_parser_that_is_slower_than_the_line_loses_every_second_character(wait, taken):
    machine = Alone(image_of(LOSES_EVERY_SECOND), stdin=b"ABCD", wait=wait)
    machine.run(max_cycles=50_000)
    assert bytes(machine.cpu.peek_iram(0x40 + number) for number in range(4)) == taken


@pytest.mark.parametrize("text", [ECHO, LOSES_EVERY_SECOND])
@pytest.mark.parametrize("gap_ticks", [0, 7, 480_000])
def test_characters_follow_at_the_rate_of_the_line_whatever_the_program_does(text, gap_ticks):
    pieces = (InputPiece(b"ABCDE" * 20), InputPiece(b""), InputPiece(b"FG"))
    machine = Alone(image_of(text), stdin=pieces, gap_ticks=gap_ticks)
    starts = starts_of(machine)
    machine.run(max_cycles=5_000_000)
    assert len(starts) == 102
    assert {later - earlier for earlier, later in pairwise(starts)} == {10 * BIT_TICKS + gap_ticks}


@pytest.mark.parametrize(("baud", "delay"), [(9600, 1), (9600, 77), (None, 140), (None, 250)])
def test_the_first_character_begins_when_the_receiver_is_switched_on(baud, delay):
    before = f"MOV R6,#40\nw:\nMOV R7,#{delay}\nDJNZ R7,$\nDJNZ R6,w\n"
    on = 6 + 1 + 40 * (1 + 2 * delay + 2) + 2  # cycles until SCON is written
    timed = SERIAL.replace("MOV SCON,#50h\n", "") + before + "MOV SCON,#50h\n"
    machine = Alone(image_of(timed + "JNB RI,$\nSJMP $"), stdin=b"A", baud=baud)
    starts = starts_of(machine)
    machine.run(max_cycles=100_000)
    assert starts == [12 * on + 240]


def test_without_a_baud_rate_it_begins_when_the_clock_of_the_receiver_runs():
    text = "MOV SCON,#50h\nMOV TMOD,#20h\nMOV TH1,#0F3h\nMOV R7,#0\nMOV R6,#9\nw:\nDJNZ R7,w\nDJNZ R6,w\n"
    machine = Alone(image_of(text + "SETB TR1\nloop:\nJNB RI,$\nSJMP loop"), stdin=b"AB")
    starts = starts_of(machine)
    machine.run(max_cycles=100_000)
    overflow = 12 * (8 + 9 * 514 + 256)
    assert overflow < starts[0] < overflow + 12 * 150
    assert starts[1] - starts[0] == 10 * 32 * 12 * 13


@pytest.mark.parametrize("control", ["50h", "90h", "0D0h", "0F0h"])
@pytest.mark.parametrize("wait", [False, True])
def test_every_mode_of_the_receiver_takes_all_characters(control, wait):
    """Those of 9 bits have no time for the next start bit during their eleventh bit."""
    text = "MOV R0,#40h\nMOV TMOD,#20h\nMOV TH1,#0F3h\nMOV TL1,#0F3h\nSETB TR1\n"
    text += f"MOV SCON,#{control}\nloop:\nJNB RI,$\nCLR RI\nMOV @R0,SBUF\nINC R0\nSJMP loop"
    machine = Alone(image_of(text), stdin=b"ABCDEFGH", wait=wait)
    machine.run(max_cycles=100_000)
    assert bytes(machine.cpu.peek_iram(0x40 + number) for number in range(8)) == b"ABCDEFGH"


def test_a_receiver_that_is_switched_off_does_not_stop_the_line():
    text = SERIAL + "JNB RI,$\nMOV SCON,#00h\nSJMP $"
    machine = Alone(image_of(text), stdin=b"ABCD")
    starts = starts_of(machine)
    machine.run(max_cycles=50_000)
    assert {later - earlier for earlier, later in pairwise(starts)} == {10 * BIT_TICKS}


def test_each_piece_has_a_delay_of_its_own():
    pieces = (InputPiece(b"ab", delay_ticks=240_000), InputPiece(b"c", delay_ticks=33_333), InputPiece(b"d"))
    machine = Alone(image_of(ECHO), stdin=pieces)
    starts = starts_of(machine)
    machine.run(max_cycles=50_000)
    ends = [start + 10 * BIT_TICKS for start in starts]
    assert starts == [240_000, ends[0], ends[1] + 33_333, ends[2]]


def test_a_text_counts_only_behind_the_piece_before():
    """Its first letter would fit the prompt that came before."""
    pieces = (InputPiece(b"x", b">"), InputPiece(b"\r", b">>"))
    machine = Alone(image_of("MOV R0,#40h\n" + PROMPT), stdin=pieces)
    assert machine.run(max_cycles=200_000) == Ended.CYCLES
    assert (machine.input.waiting_for, machine.input.left) == (b">>", 1)


def test_a_text_that_was_sent_before_the_last_character_of_a_piece_began_does_not_count():
    """The second character is put on the line as the program sends its prompt, and begins 300 cycles after that."""
    text = SERIAL + "JNB RI,$\nMOV SBUF,#3Eh\nSJMP loop\nloop:\nJNB F0,loop"
    pieces = (InputPiece(b"a"), InputPiece(b"b", delay_ticks=10 * BIT_TICKS + 4_000), InputPiece(b"c", b">"))
    machine = Alone(image_of(text), stdin=pieces)
    assert machine.run(max_cycles=200_000) == Ended.CYCLES
    assert (machine.input.waiting_for, machine.input.left) == (b">", 1)


def test_characters_keep_their_gap():
    sent = []
    machine = Alone(image_of(ECHO), stdin=b"abc", gap_ticks=480_000)
    machine.wire.output = lambda data: sent.append(machine.cpu.cycles)
    machine.run(max_cycles=300_000)
    assert len(sent) == 3
    assert all(later - earlier >= 40_000 for earlier, later in pairwise(sent))


@pytest.mark.parametrize("crystal_hz", [11_059_200, 12_000_000, 24_000_000])
def test_the_bit_rate_is_that_of_the_crystal(crystal_hz):
    machine = Alone(image_of(AUTOBAUD), stdin=b" ", baud=2400, crystal_hz=crystal_hz)
    assert machine.run() == Ended.HALTED
    cycles = machine.cpu.peek_iram(0x30) * 9
    assert cycles % 2304 == pytest.approx(6 * crystal_hz / 12 / 2400 % 2304, abs=12)


def test_keys_that_are_added_later_are_sent_and_wait_for_nothing_else():
    out = bytearray()
    machine = Alone(image_of(ECHO), output=out.extend, live=True)
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
        Alone(image_of("MOV R0,#40h\n" + PROMPT), stdin=pieces, gap_ticks=999) for _ in range(3)
    )
    assert whole.run() == Ended.HALTED
    pause = step
    while cut.run(pause=pause) == Ended.PAUSED:
        pause += step
        restore(other, snapshot(cut))
        cut, other = other, cut
    assert snapshot(cut) == snapshot(whole)
    assert bytes(whole.cpu.peek_iram(0x40 + number) for number in range(4)) == b"xyz\r"


# ------------------------------------------------------------------------------- levels of pins, from a file


def square_wave(port, bit, count, period, begin=240):
    """Falls and rises, `period` ticks from fall to fall."""
    return tuple(
        PinEvent(begin + number * period + half * (period // 2), port, bit, half)
        for number in range(count)
        for half in (0, 1)
    )


@pytest.mark.parametrize(
    ("bit", "setup", "counter"),
    [
        ((3, 4), "MOV TMOD,#05h\nSETB TR0", (0x8C, 0x8A)),
        ((3, 5), "MOV TMOD,#50h\nSETB TR1", (0x8D, 0x8B)),
        ((1, 0), "MOV T2CON,#06h", (0xCD, 0xCC)),
    ],
    ids=["T0", "T1", "T2"],
)
def test_a_program_counts_the_edges_of_a_file(bit, setup, counter):
    pins = square_wave(*bit, count=1_000, period=48)
    machine = Alone(image_of(setup + "\nwait:\nNOP\nSJMP wait"), pins=pins)
    machine.run(max_cycles=5_000)
    high, low = (machine.cpu.sfr(address) for address in counter)
    assert high << 8 | low == 1_000


def test_a_falling_pin_interrupts_and_wakes():
    text = (
        "LJMP main\nORG 0003h\nINC 30h\nRETI\nmain:\nSETB IT0\nMOV IE,#81h\nagain:\nMOV PCON,#01h\nSJMP again"
    )
    pins = square_wave(3, 2, count=50, period=100_000)
    machine = Alone(image_of(text), pins=pins)
    assert machine.run() == Ended.HALTED
    assert machine.cpu.peek_iram(0x30) == 50
    assert machine.cpu.cycles >= pins[-2].tick // 12


def test_pins_that_can_wake_nothing_keep_no_program_from_ending():
    pins = (PinEvent(24_000_000, 3, 2, 0),)
    for text, cycles in (("MOV PCON,#01h", 2), ("MOV IE,#81h\nMOV PCON,#02h", 4), ("SJMP $", 2)):
        machine = Alone(image_of(text), pins=pins)
        assert machine.run() == Ended.HALTED
        assert machine.cpu.cycles == cycles


def test_a_pin_is_low_from_the_cycle_that_samples_its_tick():
    machine = Alone(image_of("NOP\nNOP\nMOV A,P1\nMOV 30h,P1\nSJMP $"), pins=(PinEvent(12 * 3, 1, 7, 0),))
    machine.run()
    assert (machine.cpu.a, machine.cpu.peek_iram(0x30)) == (0xFF, 0x7F)


def test_levels_on_rxd_are_characters_for_the_receiver():
    bit = 24_000_000 // 9615
    start = 480_000
    levels = [0, *(0x5A >> number & 1 for number in range(8)), 1]
    pins = tuple(PinEvent(start + number * bit, 3, 0, level) for number, level in enumerate(levels))
    machine = Alone(image_of(SERIAL + "JNB RI,$\nMOV A,SBUF\nSJMP $"), pins=pins)
    assert machine.run(max_cycles=100_000) == Ended.HALTED
    assert machine.cpu.a == 0x5A


@pytest.mark.parametrize("options", [{"stdin": b"a"}, {"stdin": (InputPiece(b"a", b"> "),)}, {"live": True}])
def test_rxd_is_driven_by_pins_or_by_input(options):
    with pytest.raises(ValueError, match=r"P3\.0 is RXD"):
        Alone(image_of("NOP"), pins=(PinEvent(0, 3, 0, 0),), **options)


@pytest.mark.parametrize("step", [37, 333])
def test_pins_and_pauses_give_the_same_bits(step):
    text = "MOV TMOD,#05h\nSETB TR0\nwait:\nMOV P2,TL0\nSJMP wait"
    pins = square_wave(3, 4, 900, 60) + (PinEvent(60_000, 3, 0, 0), PinEvent(60_001, 3, 0, 1))
    whole, cut = (Alone(image_of(text), pins=pins) for _ in range(2))
    whole.run(max_cycles=8_000)
    other = Alone(image_of(text), pins=pins)
    for pause in range(step, 8_000, step):
        cut.run(max_cycles=8_000, pause=pause)
        if pause % (5 * step) == 0:
            restore(other, snapshot(cut))
            cut, other = other, cut
    cut.run(max_cycles=8_000)
    assert snapshot(cut) == snapshot(whole)


def test_edges_on_every_tick_are_taken_in_bounded_steps():
    pins = tuple(PinEvent(tick, 3, 0, tick & 1) for tick in range(240, 60_000))
    machine = Alone(image_of("wait:\nSJMP wait2\nwait2:\nSJMP wait"), pins=pins)
    assert machine.run(max_cycles=6_000) == Ended.CYCLES


def test_a_file_has_comments_and_empty_lines():
    text = "# pins\n\n0 * P1.0 1  # high\r\n  24 * P3.2 0\n24 * P3.3 0\n"
    assert read_pins(text, "a.pins") == (PinEvent(0, 1, 0, 1), PinEvent(24, 3, 2, 0), PinEvent(24, 3, 3, 0))


def test_a_level_on_a_pin_may_have_a_time_of_the_boards_crystal():
    text = "0 * P1.0 1\n1ms * P3.2 0\n2.5ms * P3.2 1\n"
    assert [event.tick for event in read_pins(text, "a.pins", 11_059_200)] == [0, 11_059, 27_648]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 * P1.0 1\n0 * P4.0 1\n", "a.pins:2: '0 * P4.0 1' is no pin event; write TICK * P1.0 0|1"),
        ("0 P1.0 1\n", "a.pins:1: "),
        ("1.5 * P1.0 1\n", "a.pins:1: '1.5 * P1.0 1' is no pin event; write TICK * P1.0 0|1, such as"),
        ("4sec * P1.0 1\n", "a.pins:1: "),
        ("0 * P1.8 1\n", "a.pins:1: "),
        ("-1 * P1.0 1\n", "a.pins:1: "),
        ("0 * P1.0 2\n", "a.pins:1: "),
        ("9 * P1.0 1\n8 * P1.1 1\n", "a.pins:2: tick 8 comes after tick 9; sort the lines by tick"),
        ("9 * P1.0 1\n9 * P1.0 0\n", "a.pins:2: P1.0 has a level at tick 9 already"),
        ("99999999999999999999 * P1.0 1\n", "a.pins:1: tick 99999999999999999999 is too late"),
        ("9" * 5000 + " * P1.0 1\n", "a.pins:1: "),
    ],
)
def test_a_line_that_is_none_is_refused_with_its_place(text, said):
    with pytest.raises(BadInput) as error:
        read_pins(text, "a.pins")
    assert str(error.value).startswith(said)


@given(st.text(alphabet="0123456789ms *P.#\n\r\t\x00é", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        events = read_pins(text, "a.pins")
    except BadInput:
        return
    assert list(events) == sorted(events, key=lambda event: event.tick)
