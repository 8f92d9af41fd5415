"""The bare board of `fw run`: RAM, terminal, ends of a run, dumps."""

from pathlib import Path

import pytest

from miro_exact.state import restore, snapshot
from miro_robot.bare.machine import BareMachine, Ended
from miro_robot.faults import FaultKind
from miro_robot.image import Image, Symbols
from tests.robot.mcs51.asm import assemble

SERIAL = "MOV RCAP2H,#0FFh\nMOV RCAP2L,#0B2h\nMOV T2CON,#34h\nMOV SCON,#50h\n"
ECHO = SERIAL + "loop:\nJNB RI,$\nMOV A,SBUF\nCLR RI\nMOV SBUF,A\nJNB TI,$\nCLR TI\nSJMP loop"
AUTOBAUD = """
MOV R2,#00h
MOV R3,#00h
CLR A
JB RXD,$
measure:
INC A
NOP
NOP
NOP
NOP
NOP
NOP
JNB RXD,measure
MOV 30h,A
SJMP $
"""


def image(text):
    code = assemble(text)
    return Image(
        path=Path("test.ihx"),
        code=code + b"\xff" * (0x10000 - len(code)),
        used=((0, len(code)),),
        size=len(code),
        sha256="",
        symbols=Symbols({}),
    )


def test_stdin_is_echoed_byte_by_byte():
    out = bytearray()
    machine = BareMachine(image(ECHO), stdin=b"hello, world\n", output=out.extend)
    assert machine.run(max_cycles=100_000) == Ended.CYCLES
    assert bytes(out) == b"hello, world\n"


def test_the_next_byte_waits_until_ri_was_cleared():
    slow = SERIAL + "loop:\nJNB RI,$\nMOV @R0,SBUF\nINC R0\nMOV R7,#00h\nw:\nMOV R6,#20\nDJNZ R6,$\n"
    slow += "DJNZ R7,w\nCLR RI\nSJMP loop"
    machine = BareMachine(image("MOV R0,#30h\n" + slow), stdin=b"abcdef")
    machine.run(max_cycles=200_000)
    assert bytes(machine.cpu.peek_iram(0x30 + n) for n in range(6)) == b"abcdef"


def test_a_program_may_measure_the_bit_rate_of_its_first_character():
    machine = BareMachine(image(AUTOBAUD), stdin=b" ", baud=9600)
    assert machine.run() == Ended.HALTED
    low_cycles = machine.cpu.peek_iram(0x30) * 9
    assert low_cycles == pytest.approx(6 * 2_000_000 / 9600, abs=12)  # start bit and five zeros of a space


def test_without_a_baud_rate_nothing_is_sent_to_a_receiver_that_is_off():
    machine = BareMachine(image(AUTOBAUD), stdin=b" ")
    assert machine.run(max_cycles=50_000) == Ended.CYCLES
    assert machine.cpu.peek_iram(0x30) == 0


def test_external_ram_is_64_kb_apart_from_code():
    machine = BareMachine(
        image("MOV DPTR,#0000h\nMOV A,#5Ah\nMOVX @DPTR,A\nMOV A,#00h\nMOVC A,@A+DPTR\nSJMP $")
    )
    assert machine.run() == Ended.HALTED
    assert machine.cpu.a == 0x90
    assert machine.dump()["xram_hex"].startswith("5a00")


def test_code_in_xram_runs_what_it_writes():
    store = "MOV A,#{}\nMOVX @DPTR,A\nINC DPTR\n"
    text = "MOV DPTR,#0100h\n" + "".join(store.format(byte) for byte in ("74h", "33h", "22h"))
    text += "LCALL 0100h\nSJMP $"
    machine = BareMachine(image(text), code_in_xram=True)
    assert machine.run() == Ended.HALTED
    assert machine.cpu.a == 0x33
    assert machine.faults == []
    other = BareMachine(image(text))
    assert other.run(max_cycles=1000) == Ended.FAULT


def test_a_run_stops_at_an_address_and_goes_on():
    machine = BareMachine(image("NOP\nNOP\nMOV A,#01h\nSJMP $"))
    assert machine.run(until=2, max_cycles=1000) == Ended.UNTIL
    assert machine.cpu.a == 0
    assert machine.run() == Ended.HALTED


def test_a_program_ends_with_its_first_jump_to_itself():
    machine = BareMachine(image("MOV A,#01h\nINC A\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert (machine.cpu.pc, machine.cpu.cycles, machine.cpu.instructions) == (3, 4, 3)


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
    machine = BareMachine(image(text))
    assert machine.run() == Ended.HALTED
    assert (machine.cpu.pc, machine.cpu.cycles, machine.cpu.instructions) == end


@pytest.mark.parametrize("main", ["SJMP $", "JB F0,done\nSJMP main"])
def test_a_limit_that_is_not_reached_changes_nothing(main):
    text = "LJMP start\nORG 0023h\nCLR RI\nMOV A,SBUF\nDJNZ R7,back\nLJMP done\nback:\nRETI\nstart:\n"
    text += SERIAL + f"MOV R7,#5\nMOV IE,#90h\nmain:\n{main}\ndone:\nNOP\nSJMP $"
    free, limited = (BareMachine(image(text), stdin=b"hello") for _ in range(2))
    until = assemble(text).rindex(b"\x00\x80\xfe")
    assert free.run(until=until) == Ended.UNTIL
    assert limited.run(until=until, max_cycles=1_000_000) == Ended.UNTIL
    assert free.dump() == limited.dump()


def test_a_jump_to_itself_that_interrupts_leave_is_no_end():
    program = "LJMP main\nORG 000Bh\nINC 30h\nRETI\nmain:\nMOV TMOD,#02h\nSETB TR0\nMOV IE,#82h\nSJMP $"
    machine = BareMachine(image(program))
    assert machine.run(pause=1_000_000) == Ended.PAUSED
    assert machine.cpu.peek_iram(0x30) > 0


def test_bytes_that_only_look_like_a_jump_to_itself_end_nothing():
    machine = BareMachine(image("MOV 80h,#0FEh\nMOV DPTR,#80FEh\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert (machine.cpu.pc, machine.cpu.dptr) == (6, 0x80FE)


@pytest.mark.parametrize("step", [1, 7, 333, 1_001])
@pytest.mark.parametrize("text", [ECHO, SERIAL + "MOV SBUF,#41h\nSJMP $", "NOP\nMOV PCON,#01h\nSJMP $"])
def test_a_run_that_is_paused_is_the_same_run(text, step):
    whole, cut = (BareMachine(image(text), stdin=b"hi!") for _ in range(2))
    limit = 12_000 if text == ECHO else None
    ended = whole.run(max_cycles=limit)
    pause = step
    while (cut_ended := cut.run(max_cycles=limit, pause=pause)) == Ended.PAUSED:
        pause += step if pause < 20_000 else 100_000
    assert cut_ended == ended
    assert snapshot(cut) == snapshot(whole)


def test_a_fault_names_kind_place_and_tick():
    machine = BareMachine(image("NOP\nDB 0A5h\nSJMP $"))
    assert machine.run(max_cycles=1000) == Ended.FAULT
    fault = machine.faults[0]
    assert (fault.kind, fault.pc, fault.tick) == (FaultKind.UNDEFINED_OPCODE, 1, 24)
    assert str(fault) == "firmware executed the undefined opcode A5 at 0x0001, tick 24"
    forgiving = BareMachine(image("NOP\nDB 0A5h\nSJMP $"), stop_on_fault=False)
    assert forgiving.run() == Ended.HALTED


def test_the_last_character_is_sent_before_a_run_halts():
    out = bytearray()
    machine = BareMachine(image(SERIAL + "MOV SBUF,#41h\nSJMP $"), output=out.extend)
    assert machine.run() == Ended.HALTED
    assert bytes(out) == b"A"


@pytest.mark.parametrize(
    ("mode", "lasts"), [("#00h", 30), ("#80h", 1_000), ("#0D8h", 1_000)], ids=["mode 0", "mode 2", "mode 3"]
)
def test_a_program_may_send_as_much_as_it_likes(mode, lasts):
    out = bytearray()
    text = f"MOV TMOD,#20h\nMOV TH1,#0FFh\nMOV TCON,#40h\nMOV SCON,{mode}\nloop:\nMOV SBUF,#55h\nJNB TI,$\n"
    machine = BareMachine(image(text + "CLR TI\nSJMP loop"), output=out.extend)
    assert machine.run(max_cycles=1_000 * lasts) == Ended.CYCLES
    assert bytes(out) == b"U" * len(out)
    assert len(out) > 1_000


def test_a_program_may_wave_with_p3_1_as_long_as_it_likes():
    machine = BareMachine(image("loop:\nCPL TXD\nSJMP loop"))
    assert machine.run(max_cycles=300_000) == Ended.CYCLES


def test_progress_is_told_and_the_dump_has_the_registers():
    told = []
    machine = BareMachine(image("SETB EA\nMOV B,#12h\nloop:\nNOP\nSJMP loop"))
    assert machine.run(until=6, max_cycles=500_000, progress=told.append) == Ended.UNTIL
    assert machine.run(max_cycles=500_000, progress=told.append) == Ended.CYCLES
    assert told[-1] == machine.cpu.cycles
    dump = machine.dump()
    assert (dump["pc"], dump["sfr"]["f0"], len(dump["iram_hex"]), len(dump["xram_hex"])) == (
        5,
        0x12,
        512,
        0x20000,
    )


def test_a_saved_machine_goes_on_with_the_same_bits():
    machine = BareMachine(image(ECHO), stdin=b"some words to echo")
    machine.run(max_cycles=11_111)
    other = BareMachine(image(ECHO))
    restore(other, snapshot(machine))
    assert snapshot(other) == snapshot(machine)
    machine.run(max_cycles=60_000)
    other.run(max_cycles=60_000)
    assert snapshot(other) == snapshot(machine)


@pytest.mark.parametrize(
    ("baud", "crystal_hz", "said"), [(5, 24_000_000, "750000"), (400_000, 11_059_200, "345600")]
)
def test_a_baud_rate_that_no_receiver_reaches_is_refused(baud, crystal_hz, said):
    with pytest.raises(ValueError, match=f"baud {baud} is outside 50..{said} at {crystal_hz} Hz"):
        BareMachine(image("NOP"), baud=baud, crystal_hz=crystal_hz)


def test_a_crystal_that_no_8051_has_is_refused():
    with pytest.raises(ValueError, match="crystal 5 Hz is outside"):
        BareMachine(image("NOP"), crystal_hz=5)


def test_a_limit_does_not_keep_a_program_from_ending():
    machine = BareMachine(image("NOP\nSJMP $"))
    assert machine.run(max_cycles=1000) == Ended.HALTED
    assert machine.cpu.cycles == 3
    assert BareMachine(image("NOP\nSJMP $")).run(max_cycles=1) == Ended.CYCLES


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
    machine = BareMachine(image(text + "\nSJMP $"))
    assert machine.run(max_cycles=limit) == Ended.HALTED
    assert machine.cpu.cycles == cycles


def test_a_sleep_that_a_timer_ends_is_no_end():
    text = "LJMP main\nORG 000Bh\nINC 30h\nRETI\nmain:\nMOV TMOD,#02h\nSETB TR0\nMOV IE,#82h\n"
    machine = BareMachine(image(text + "again:\nMOV PCON,#01h\nSJMP again"))
    assert machine.run(max_cycles=5_000) == Ended.CYCLES
    assert machine.cpu.peek_iram(0x30) > 10


def test_input_that_is_still_to_come_wakes_a_sleeper():
    text = "LJMP main\nORG 0023h\nMOV A,SBUF\nCLR RI\nMOV 30h,A\nRETI\nmain:\n" + SERIAL
    machine = BareMachine(image(text + "MOV IE,#90h\nagain:\nMOV PCON,#01h\nSJMP again"), stdin=b"xyz")
    assert machine.run() == Ended.HALTED
    assert machine.cpu.peek_iram(0x30) == ord("z")
    woken = machine.cpu.cycles
    assert machine.run(pause=woken + 100_000) == Ended.HALTED
    assert (machine.cpu.cycles, machine.cpu.idle) == (woken, 1)


@pytest.mark.parametrize("sleep", ["SJMP $", "MOV PCON,#01h"])
@pytest.mark.parametrize("mode", ["", "MOV SCON,#00h\n"], ids=["uart", "shift register"])
def test_a_run_ends_with_the_last_character_that_is_being_sent(sleep, mode):
    out = bytearray()
    machine = BareMachine(image(SERIAL + mode + "MOV SBUF,#41h\n" + sleep), output=out.extend)
    assert machine.run() == Ended.HALTED
    assert bytes(out) == b"A"
    assert machine.cpu.sfr(0x98) & 0x02  # TI
    shorter = BareMachine(image(SERIAL + mode + "MOV SBUF,#41h\n" + sleep))
    assert shorter.run(pause=machine.cpu.cycles - 2) == Ended.PAUSED
    assert not shorter.cpu.sfr(0x98) & 0x02


def test_power_down_stops_the_transmitter_too():
    out = bytearray()
    machine = BareMachine(image(SERIAL + "MOV SBUF,#41h\nMOV PCON,#02h"), output=out.extend)
    assert machine.run() == Ended.HALTED
    assert (bytes(out), machine.cpu.cycles) == (b"", 12)


def test_interrupts_that_are_switched_off_at_the_end_do_not_hide_it():
    wait = "MOV R7,#200\nwait:\nDJNZ R7,wait\n"
    machine = BareMachine(image("SETB ET0\nSETB EA\n" + wait + "CLR EA\nSJMP $"))
    assert machine.run() == Ended.HALTED
    assert machine.cpu.cycles == 1 + 1 + 1 + 400 + 1 + 2


def test_faults_beyond_a_hundred_are_counted():
    machine = BareMachine(image("loop:\nDB 0A5h\nSJMP loop"), stop_on_fault=False)
    assert machine.run(max_cycles=3 * 130) == Ended.CYCLES
    assert (len(machine.faults), machine.faults_lost) == (100, 30)


def test_code_that_data_has_overwritten_is_known():
    store = "MOV DPTR,#0002h\nMOV A,#77h\nMOVX @DPTR,A\nMOV DPTR,#4000h\nMOVX @DPTR,A\nSJMP $"
    shared, apart = BareMachine(image(store), code_in_xram=True), BareMachine(image(store))
    assert shared.run() == apart.run() == Ended.HALTED
    assert (shared.changed_code(), apart.changed_code()) == ([2], [])
