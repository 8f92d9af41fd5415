"""Firmware that mistreats its LM629 makes the same faults on the net list as on the compiled board, with ticks."""

import pytest

from miro_robot.plant import Plant
from tests.robot.board.rig import MS, board_with, image_of
from tests.robot.board.test_faults import CASES
from tests.sim.netlist.net_board import NetBoard


def net_board_with(text, stop_on_fault=True, options=None):
    board = NetBoard(Plant(), options=options, stop_on_fault=stop_on_fault, image=image_of(text))
    board.cpu.rxd.settled_tick = 1 << 60
    return board


@pytest.mark.parametrize("stops", [True, False])
@pytest.mark.parametrize("what", CASES)
def test_every_fault_has_the_same_tick_place_and_words(what, stops):
    boards = [make(CASES[what][0], stop_on_fault=stops) for make in (board_with, net_board_with)]
    for board in boards:
        board.run(20 * MS)
    assert boards[0].faults
    assert boards[0].faults == boards[1].faults
    assert boards[0].fault_count == boards[1].fault_count
