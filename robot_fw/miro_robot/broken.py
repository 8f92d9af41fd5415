"""Hardware faults of a board, between two instructions: a bit of RAM, a port pin, an LM629, the supply."""

from __future__ import annotations

from miro_exact.clock import CYCLE_TICKS
from miro_robot.board import Board
from miro_robot.lm629.host_port import DEAD, STUCK, WHOLE
from miro_robot.processor_board import ProcessorBoard

LM629S = {"busy": STUCK, "dead": DEAD, "ok": WHOLE}


def break_processor(board: ProcessorBoard, fault: str) -> None:
    """Does the fault if any board can have it."""
    word, *values = fault.split()
    if word == "flip":
        address, bit = values[0].split("h.")
        place = int(address, 16)
        board.cpu.poke_iram(place, board.cpu.peek_iram(place) ^ 1 << int(bit))
    elif word == "pin":
        level = -1 if values[1] == "ok" else int(values[1])
        board.hold_pin(int(values[0][1]), int(values[0][3]), level)
    elif word == "power":
        board.dip()


def break_board(board: Board, fault: str) -> None:
    """Does the fault if it is one of the board alone; any other one begins where its chips are now."""
    # Where the chips are depends on where the run was cut; up to the processor's own time it does not.
    board.sync(board.cpu.cycles * CYCLE_TICKS)
    word, *values = fault.split()
    if word == "lm629":
        (board.left if values[0] == "left" else board.right).port.broken = LM629S[values[1]]
    else:
        break_processor(board, fault)
