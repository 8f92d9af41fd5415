"""Every fault that firmware can make, by the shortest program that makes it: kind, tick, instruction and symbol.

Ticks are counted by hand: 12 a machine cycle, LJMP takes 2 cycles, so `main` begins in cycle 2.
"""

import json
import sys
from pathlib import Path

import msgspec
import pytest

from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.wiring import Latch, load_wiring
from tests import children
from tests.robot.board.rig import CYCLE, MS, RESET, START, board_with, raw_movx_wiring
from tests.states import restore, snapshot, values

COMMAND_LEFT = "MOV P0,#2\nCLR P2.0\nCLR P2.3\nCLR P2.2\nSETB P2.2\n"  # 2 cycles, then 4 of one cycle
TIMER_0 = "MOV TMOD,#01h\nMOV TH0,#0FFh\nMOV TL0,#0F0h\nMOV IE,#82h\nSETB TR0\nidle:\nSJMP idle"
STUCK_INTERRUPT = f"LJMP main\nORG 0Bh\nstuck:\nSJMP stuck\nORG 30h\nmain:\n{TIMER_0}"

CASES = {
    "the undefined opcode": (
        START + "NOP\nguilty:\nDB 0A5h",
        (FaultKind.UNDEFINED_OPCODE, 4 * CYCLE, 0x31, ""),  # LJMP, NOP, it
    ),
    "a push into the last byte and one more": (
        START + "MOV SP,#0FEh\nPUSH ACC\nguilty:\nPUSH ACC",
        (FaultKind.STACK_OVERFLOW, 8 * CYCLE, 0x35, "SP 00h, its stack is 01h to FFh"),  # 4 x 2 cycles
    ),
    "a call whose return address goes round": (
        START + "MOV SP,#0FEh\nguilty:\nACALL main",
        (FaultKind.STACK_OVERFLOW, 6 * CYCLE, 0x33, "SP 00h, its stack is 01h to FFh"),
    ),
    "a return with nothing on the stack": (
        START + "MOV SP,#00h\nguilty:\nRET",
        (FaultKind.STACK_UNDERFLOW, 6 * CYCLE, 0x33, "SP FFh, its stack is 01h to FFh"),
    ),
    "running off the end": (
        START + "NOP\nguilty:",
        (FaultKind.OUTSIDE_IMAGE, 3 * CYCLE, 0x31, ""),  # found before it is executed
    ),
    "reading both chips": (
        START + "ANL P2,#0E7h\nguilty:\nCLR P2.1",
        (FaultKind.BUS_CONTENTION, 5 * CYCLE, 0x33, ""),
    ),
    "a command right after a command": (
        START + RESET + COMMAND_LEFT + "guilty:\nCLR P2.2",
        (FaultKind.LM629_BUSY, 2589 * CYCLE, 0x49, ""),  # 2 + 4 + 1 + 5 x 515, then 6 + 1
    ),
    "a reset pulse of one machine cycle": (
        START + "CLR P2.5\nguilty:\nSETB P2.5",
        (FaultKind.LM629_TIMING, 4 * CYCLE, 0x32, "/RST pulse 500 ns, 1333 ns needed"),
    ),
    "PS together with /WR": (
        START + RESET + "CLR P2.3\nguilty:\nANL P2,#0FAh",
        (FaultKind.LM629_TIMING, 2585 * CYCLE, 0x40, "PS set-up 0 ns, 30 ns needed"),
    ),
    "releasing all of P2 at the end of a write": (
        START + RESET + COMMAND_LEFT[: -len("SETB P2.2\n")] + "guilty:\nMOV P2,#0FFh",
        (FaultKind.LM629_TIMING, 2589 * CYCLE, 0x47, "PS hold 0 ns, 30 ns needed"),
    ),
    "an interrupt that never ends": (
        STUCK_INTERRUPT,  # at cycle 2000, 4000 ... 22000 it is in service; its jumps end in odd cycles
        (FaultKind.MAIN_LOOP_STARVED, 22001 * CYCLE, 0x0B, ""),
    ),
    "an interrupt routine that is a plain function": (
        "LJMP main\nORG 0Bh\nguilty:\nRET\nORG 30h\nmain:\n" + TIMER_0,
        (FaultKind.INTERRUPT_NOT_LEFT, 33 * CYCLE, 0x0B, ""),  # overflow at the end of cycle 27
    ),
}


@pytest.mark.parametrize("what", CASES)
def test_a_fault_names_kind_tick_instruction_and_symbol(what):
    text, (kind, tick, pc, detail) = CASES[what]
    board = board_with(text)
    assert board.run(20 * MS) == 1
    symbol = "stuck" if kind == FaultKind.MAIN_LOOP_STARVED else "guilty"
    assert board.faults == [FirmwareFault(kind, tick, pc, symbol, detail)]
    assert board.fault_count == 1


def test_every_kind_is_provoked():
    of_files = {FaultKind.NET_CONTENTION, FaultKind.MOVX_WITHOUT_STROBE}  # of boards of files
    assert {kind for _, (kind, *_) in CASES.values()} == set(FaultKind) - of_files


def test_a_fault_reads_as_a_sentence():
    board = board_with(CASES["a reset pulse of one machine cycle"][0])
    board.run(MS)
    assert str(board.faults[0]) == (
        "firmware violated an LM629 bus timing limit (/RST pulse 500 ns, 1333 ns needed) at 0x0032 in guilty, tick 48"
    )


def test_the_run_ends_after_the_guilty_instruction():
    board = board_with(START + "guilty:\nDB 0A5h\nMOV 40h,#1\nSJMP $")
    board.run(MS)
    assert (board.cpu.pc, board.cpu.cycles, board.cpu.peek_iram(0x40)) == (0x31, 3, 0)


def test_a_scenario_that_does_not_stop_counts_and_goes_on():
    board = board_with(
        START + "MOV R7,#5\nagain:\nDB 0A5h\nDJNZ R7,again\nMOV 40h,#1\nSJMP $", stop_on_fault=False
    )
    assert board.run(MS) == 0
    assert board.cpu.peek_iram(0x40) == 1
    assert [fault.tick for fault in board.faults] == [CYCLE * (4 + 3 * n) for n in range(5)]
    assert board.fault_count == 5


def test_a_fault_without_end_is_counted_and_kept_a_thousand_times():
    board = board_with(START + "again:\nDB 0A5h\nSJMP again", stop_on_fault=False)
    board.run(MS)
    assert board.fault_count == 666  # 1 + 2 cycles each, of 2000 - 2
    board.run(2 * MS)
    assert (board.fault_count, len(board.faults)) == (1333, 1000)


def test_a_write_to_a_chip_in_reset_is_lost_like_one_to_a_busy_chip():
    board = board_with(START + "CLR P2.0\nCLR P2.3\nguilty:\nCLR P2.2")
    board.run(MS)
    assert [(fault.kind, fault.symbol) for fault in board.faults] == [(FaultKind.LM629_BUSY, "guilty")]


# ------------------------------------------------------------------------------------- the main loop


def starved_ticks(text, ms=50):
    board = board_with(text, stop_on_fault=False)
    board.run(ms * MS)
    assert {fault.kind for fault in board.faults} <= {FaultKind.MAIN_LOOP_STARVED}
    return [fault.tick for fault in board.faults]


def test_an_interrupt_that_never_ends_is_reported_every_10_ms():
    assert starved_ticks(STUCK_INTERRUPT) == [CYCLE * (20_000 * n + 2001) for n in (1, 2, 3, 4)]


def test_an_interrupt_that_is_asked_for_again_and_again_leaves_no_time_either():
    """TI is never cleared: RETI, one instruction of the main loop, and the interrupt again: 9 cycles a round."""
    text = (
        "LJMP main\nORG 23h\nINC 40h\nNOP\nNOP\nRETI\nORG 30h\nmain:\nMOV IE,#90h\nSETB TI\nloop:\nSJMP loop"
    )
    ticks = starved_ticks(text, ms=12)
    assert len(ticks) == 1
    assert 22000 * CYCLE <= ticks[0] < 22004 * CYCLE


@pytest.mark.parametrize("loop", ["NOP\nSJMP loop", "MOV PCON,#1\nSJMP loop"])
def test_a_main_loop_that_gets_a_little_time_or_sleeps_is_not_starved(loop):
    """Timer 0 interrupts every 64 cycles; the routine takes 51 of them."""
    text = "LJMP main\nORG 0Bh\nPUSH ACC\nMOV R6,#20\nDJNZ R6,$\nPOP ACC\nRETI\nORG 30h\nmain:\n"
    text += f"MOV TMOD,#02h\nMOV TH0,#0C0h\nMOV IE,#82h\nSETB TR0\nloop:\n{loop}"
    assert starved_ticks(text) == []


def test_a_main_loop_that_shuts_interrupts_out_is_not_starved():
    """EA goes up right before each interrupt is taken, as if it had interrupted at once; but the loop had its time."""
    text = "LJMP main\nORG 23h\nRETI\nORG 30h\nmain:\nMOV IE,#10h\nSETB TI\nloop:\nCLR EA\nMOV R7,#100\nDJNZ R7,$\n"
    assert starved_ticks(text + "SETB EA\nSJMP loop") == []


def test_after_ret_in_place_of_reti_the_interrupt_stays_in_service_and_starves_the_main_loop():
    board = board_with("LJMP main\nORG 0Bh\nRET\nORG 30h\nmain:\n" + TIMER_0, stop_on_fault=False)
    board.run(12 * MS)
    assert [fault.kind for fault in board.faults] == [
        FaultKind.INTERRUPT_NOT_LEFT,
        FaultKind.MAIN_LOOP_STARVED,
    ]
    assert 22000 * CYCLE <= board.faults[1].tick <= 22001 * CYCLE


def test_nested_interrupts_count_as_one():
    """The low routine never ends; high ones come and go above it."""
    text = "LJMP main\nORG 0Bh\nlow:\nSJMP low\nORG 1Bh\nCLR TF1\nRETI\nORG 30h\nmain:\nMOV IP,#08h\n"
    text += TIMER_0.replace("01h", "21h").replace("82h", "8Ah").replace("SETB TR0", "SETB TR0\nSETB TR1")
    assert len(starved_ticks(text, ms=12)) == 1


def test_saving_in_a_starving_interrupt_does_not_shift_the_fault():
    whole = board_with(STUCK_INTERRUPT)
    whole.run(12 * MS)
    for ms in (0.5, 1.0, 4.5, 10.99):
        first, second = board_with(STUCK_INTERRUPT), board_with(STUCK_INTERRUPT)
        first.run(int(ms * MS))
        restore(second, snapshot(first))
        second.run(12 * MS)
        assert second.faults == whole.faults
        assert snapshot(second) == snapshot(whole)


def test_marks_are_saved_only_while_interrupts_hold_the_cpu():
    board = board_with(STUCK_INTERRUPT)
    board.run(MS // 2)
    assert values(board.cpu)["marks"] == 0
    board.run(3 * MS + 100)
    assert values(board.cpu)["marks"] == 3


def test_how_a_run_is_cut_does_not_shift_the_fault():
    board = board_with(STUCK_INTERRUPT)
    tick = 0
    while not board.run(tick):
        tick += 7 * CYCLE
    assert [fault.tick for fault in board.faults] == [22001 * CYCLE]


# ------------------------------------------------------------------------------- an LM629 on the MOVX strobes

ADDRESS_LEFT_COMMAND = "MOV DPTR,#0F600h\n"  # high byte F6h: /CS left and PS low; low byte 00h
WRITE = START + RESET + ADDRESS_LEFT_COMMAND + "MOV A,#02h\nguilty:\nMOVX @DPTR,A\nMOV 40h,#1\nSJMP $"
READ = START + RESET + ADDRESS_LEFT_COMMAND + "guilty:\nMOVX A,@DPTR\nMOV 40h,A\nSJMP $"


def test_a_movx_write_lets_its_data_go_too_early():
    board = board_with(WRITE, raw_movx_wiring())
    board.run(3 * MS)
    fault = (
        FaultKind.LM629_TIMING,
        2585 * CYCLE + 19,
        0x43,
        "guilty",
        "write data hold 17 ns, 120 ns needed",
    )
    assert board.faults == [FirmwareFault(*fault)]


def test_a_movx_read_takes_its_data_too_early():
    board = board_with(READ, raw_movx_wiring())
    board.run(3 * MS)
    fault = (FaultKind.LM629_TIMING, 2584 * CYCLE + 17, 0x41, "guilty", "read access 118 ns, 180 ns needed")
    assert board.faults == [FirmwareFault(*fault)]


def test_the_strobes_of_a_movx_reach_the_chip_that_is_addressed():
    board = board_with(WRITE, raw_movx_wiring(), stop_on_fault=False)
    board.run(3 * MS)
    rises = 2585 * CYCLE + 18
    assert board.left.commands == [(rises, 0x02, b"")]
    assert board.right.commands == []
    assert board.left.status_at(rises + 479) & 1 == 1
    assert board.cpu.peek_iram(0x40) == 1
    board = board_with(READ, raw_movx_wiring(), stop_on_fault=False)
    board.run(3 * MS)
    assert board.cpu.peek_iram(0x40) == 0x84


def test_a_movx_by_dptr_disturbs_an_lm629_whose_strobes_are_on_p2():
    """On the MIRO board nothing hangs on the external bus, but P2 shows the high address byte all the same: with
    D3h, /RST, /WR and /CS left go down for 12 ticks.
    """
    board = board_with(START + "MOV DPTR,#0D300h\nguilty:\nMOVX @DPTR,A\nSJMP $", stop_on_fault=False)
    board.run(MS)
    moment = {(fault.kind, fault.tick, fault.symbol) for fault in board.faults}
    assert (FaultKind.LM629_TIMING, 4 * CYCLE + 20, "guilty") in moment  # the reset pulse ends
    assert (FaultKind.LM629_BUSY, 4 * CYCLE + 8, "guilty") in moment


def latched_wiring():
    """All control lines on one output latch, data on another port: what MOVX is good for here."""
    miro = load_wiring()
    nets = {
        net: source.replace("P2.", "CTRL.") for net, source in miro.nets.items() if not net.startswith("P1")
    }
    return msgspec.structs.replace(
        miro, name="latched", data="P1", nets=nets, latch=(Latch("CTRL", address=0),)
    )


def test_strobes_on_an_output_latch_meet_every_limit():
    def put(*values):
        return "".join(f"MOV A,#{value}\nMOVX @DPTR,A\n" for value in values)

    text = START + "MOV DPTR,#0\n" + put("0DFh", "0FFh")  # a reset pulse of 3 cycles
    text += RESET[RESET.index("MOV R6") :] + "MOV P1,#2\n"
    text += put("0FEh", "0F6h", "0F2h", "0F6h", "0FEh")  # PS, /CS, /WR low and high again
    board = board_with(text + "MOV P1,#0FFh\nSJMP $", latched_wiring())
    assert board.run(3 * MS) == 0
    assert board.faults == []
    assert [command[1:] for command in board.left.commands] == [(0x02, b"")]


def test_a_reset_by_the_shortest_program_that_is_long_enough_is_no_fault():
    board = board_with(START + "CLR P2.5\nMOV R7,#1\nDJNZ R7,$\nSETB P2.5\nSJMP $")  # 4 cycles: 2 us
    assert board.run(2 * MS) == 0
    assert board.faults == []
    assert board.left.status == board.right.status == 0x84


# --------------------------------------------------------------------------------------- both engines

SCRIPT = """
import json
from miro_exact import engine
engine.select("python")
from tests.robot.board.test_faults import all_faults
print(json.dumps(all_faults()))
"""


def all_faults():
    """The faults of all programs of this page, as plain values."""
    boards = [board_with(text) for text, _ in CASES.values()]
    boards += [board_with(text, raw_movx_wiring(), stop_on_fault=False) for text in (WRITE, READ)]
    for board in boards:
        board.run(12 * MS)
    return [[str(fault) for fault in board.faults] for board in boards]


def test_compiled_and_uncompiled_boards_find_the_same_faults():
    done = children.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
    )
    assert json.loads(done.stdout) == all_faults()
