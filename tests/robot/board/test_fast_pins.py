"""Port pins that move as fast as they can: a board goes on, or waits until its listener has heard TXD."""

import itertools

from miro_robot.mcs51.cpu import REACHED, WIRE_FULL
from tests.alone import Alone
from tests.robot.board.rig import board_with, image_of
from tests.states import snapshot

TOGGLE = "\n".join(["loop:", "CPL TXD", *(f"XRL P{port},#0FDh" for port in range(4)), "SJMP loop"])
EVERY_CYCLE = "\n".join(["loop:", *["CPL TXD"] * 60, "SJMP loop"])
SHIFT = "MOV SCON,#0\nloop:\nMOV SBUF,#55h\nMOV R2,#5\nDJNZ R2,$\nSJMP loop"


def listened(program):
    board = board_with(program, stop_on_fault=False)
    board.cpu.txd.unread = False
    return board


def test_a_board_without_a_listener_goes_on():
    board = board_with(TOGGLE, stop_on_fault=False)
    assert board.run(2_400_000) == REACHED
    assert board.fault_count > 1000
    assert len(board.cpu.txd.edges()) <= 4096


def test_so_does_the_bare_machine():
    machine = Alone(image_of(TOGGLE))
    machine.run(max_cycles=200_000)
    assert machine.cpu.cycles >= 200_000
    assert len(machine.cpu.txd.edges()) <= 4096


def test_with_a_listener_it_waits_after_the_instruction_with_the_2049th_edge():
    board = listened(EVERY_CYCLE)
    assert board.run(2_400_000) == WIRE_FULL
    assert len(board.cpu.txd.edges()) == 2049
    stopped = board.cpu.cycles
    assert board.run(2_400_000) == WIRE_FULL
    assert board.cpu.cycles == stopped
    board.cpu.txd.hear(board.cpu.txd.full_tick())
    assert board.run(2_400_000) == WIRE_FULL
    assert board.cpu.cycles > stopped + 2000


def test_so_it_does_when_the_serial_port_makes_the_edges():
    board = listened(SHIFT)
    assert board.run(2_400_000) == WIRE_FULL
    assert 2049 <= len(board.cpu.txd.edges()) < 2049 + 20
    assert board.cpu.txd.last_tick() < 12 * board.cpu.cycles


def test_waiting_changes_no_bit():
    whole, pieces = listened(TOGGLE), listened(TOGGLE)
    while whole.run(1_000_000):
        whole.cpu.txd.hear(1 << 60)  # more than there is
    for tick in itertools.count(7_001, 7_001):
        while pieces.run(min(tick, 1_000_000)):
            pieces.cpu.txd.hear(pieces.cpu.txd.full_tick())
        if tick >= 1_000_000:
            break
    assert snapshot(pieces) == snapshot(whole)
