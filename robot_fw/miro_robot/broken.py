"""Hardware faults of a board, between two instructions: a bit of RAM, an LM629, the supply."""

from __future__ import annotations

from miro_exact.clock import CYCLE_TICKS
from miro_robot.board import Board
from miro_robot.lm629.host_port import DEAD, STUCK, WHOLE
from miro_robot.mcs51.cpu import Cpu

LM629S = {"busy": STUCK, "dead": DEAD, "ok": WHOLE}


def flip_bit(cpu: Cpu, where: str) -> None:
    """Turns a bit of internal RAM over: 2Ah.3."""
    address, bit = where.split("h.")
    cpu.poke_iram(int(address, 16), cpu.peek_iram(int(address, 16)) ^ 1 << int(bit))


def break_board(board: Board, what: str) -> None:
    """Does the fault if it is one of the board alone; any other one begins where its chips are now."""
    # Where the chips are depends on where the run was cut; up to the processor's own time it does not.
    board.sync(board.cpu.cycles * CYCLE_TICKS)
    word, *values = what.split()
    if word == "flip":
        flip_bit(board.cpu, values[0])
    elif word == "lm629":
        (board.left if values[0] == "left" else board.right).port.broken = LM629S[values[1]]
    elif word == "power":
        board.dip()
