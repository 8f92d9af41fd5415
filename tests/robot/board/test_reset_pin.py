"""The reset pin goes up whenever somebody wants it to."""

from miro_exact.state import Flat
from miro_protocol.frames import TeamFrame, encode
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring

BIT_TICKS = 2500
MS = 24_000


def test_a_reset_at_any_moment_is_no_fault_of_the_firmware():
    board = Board(load_wiring(), Plant())
    board.load(load_hex(image_path()))
    board.cpu.rxd.settled_tick = 1000 * MS
    tick = 40 * MS
    board.run(tick - 240)
    for value in encode(TeamFrame(0, 1, ((100, -100),) * 3), 3):
        for place, level in enumerate([0, *(value >> bit & 1 for bit in range(8)), 1]):
            board.cpu.rxd.append(tick + place * BIT_TICKS, level)
        tick += 10 * BIT_TICKS
    board.run(tick)
    state = Flat(board)
    decoding = state.save()
    writing = 0
    for later in range(0, 2 * MS, 36):  # the frame is tested, then both LM629 are written
        state.load(decoding)
        board.run(tick + later)
        writing += not board.cpu.idle
        board.set_reset(1)
        board.run(tick + later + 48)
        board.set_reset(0)
        board.run(tick + later + MS)
        assert not board.faults, later
    assert writing > 800
