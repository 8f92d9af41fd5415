"""An LM629 on a board of one's own: what a test reads of it, what a saved board goes on with, what is refused."""

import hashlib
import sys

import pytest

from miro_exact.plugins import PluginError
from miro_exact.state import Flat
from miro_robot.build import board_of
from miro_sim.scenario.board_file import board_of_table, load_board, table_of
from tests import children
from tests.robot.board.rig import CYCLE, MS, RESET, START, image_of
from tests.robot.board.test_step_by_step import tell_left

FILTER = [*tell_left(0x1E, 0x030F, 0x0190, 0x0028, 0x0BB8, 0x07D0), *tell_left(0x04)]
FORWARD = [*tell_left(0x1F, 0x1828, 0, 0x4000, 4, 0), *tell_left(0x01)]
DRIVE = (
    START
    + RESET
    + "\n".join([*FILTER, *FORWARD, "loop:", "MOV P2,#52", "MOV A,P0", "MOV P2,#54", "SJMP loop"])
)


def board_with(text):
    board = board_of(load_board("miro"), image_of(text))
    board.cpu.rxd.settled_tick = 1 << 60
    return board


def test_a_test_reads_what_chip_and_robot_do():
    board = board_with(DRIVE)
    pulses = []
    for ms in range(1, 401):
        board.run(ms * MS)
        pulses.append(board.value("left", "pwm"))
    assert board.faults == []
    assert board.value("left", "desired_velocity") == 4.0
    assert abs(board.value("left", "velocity") - 4) <= 1
    assert abs(board.value("left", "position") - board.value("left", "desired_position")) <= 4
    assert 10 < max(pulses) <= 127
    assert sum(pulses) > 0
    assert board.value("left", "status") == 0x04  # the reset's flag: trajectory complete
    assert board.value("right", "pwm") == 0
    assert board.value("drive", "x_cm") > 1.0
    assert board.value("drive", "heading_deg") < -5.0  # only the left wheel is driven


@pytest.mark.parametrize("tick", [0, 40_000, 2_585 * CYCLE, 100 * MS + 5, 200 * MS + 2_001])
def test_a_board_that_was_saved_goes_on_as_it_was(tick):
    whole, saved, loaded = (board_with(DRIVE) for _ in range(3))
    whole.run(tick)
    saved.run(tick)
    Flat(loaded).load(Flat(saved).save())
    for board in (whole, loaded):
        board.run(300 * MS)
    assert Flat(loaded).save() == Flat(whole).save()


def test_a_saved_chip_at_another_time_than_its_part_is_refused():
    board = board_with(DRIVE)
    board.run(100 * MS)
    flat = Flat(board)
    board.parts[1].chip.next_tick += 4
    damaged = flat.save()
    board.parts[1].chip.next_tick -= 4
    with pytest.raises(ValueError, match="left has its next event"):
        flat.load(damaged)


def test_another_crystal_is_refused_with_the_remedy():
    table = {**table_of(load_board("miro")), "crystal_hz": 11_059_200}
    with pytest.raises(PluginError, match="ticks of 24 MHz; set crystal_hz = 24000000"):
        board_of(board_of_table(table, "car.board.toml"), image_of(DRIVE))


def test_pulses_that_come_to_a_port_pin_are_seen_there_in_time():
    """`mag` on P1.7, too: firmware that waits for it must not run past its edges."""
    table = table_of(load_board("miro"))
    table["parts"]["left"]["pins"]["mag"] = "P1.7"
    count = "loop:\nJNB P1.7,$\nINC 40h\nJB P1.7,$\nSJMP loop"
    board = board_of(
        board_of_table(table, "car.board.toml"),
        image_of(START + RESET + "\n".join([*FILTER, *FORWARD, count])),
    )
    board.run(100 * MS)
    before = board.cpu.peek_iram(0x40)
    board.run(104 * MS)
    assert (board.cpu.peek_iram(0x40) - before) % 256 in (46, 47, 48)  # 11.7 kHz for 4 ms


def saved_after(ms):
    """Of the whole state, the net list's too."""
    board = board_with(DRIVE)
    board.run(ms * MS + 5)
    return hashlib.sha256(Flat(board).save()).hexdigest()


SCRIPT = """
from miro_exact import engine
engine.select("python")
from tests.robot.parts.test_lm629 import saved_after
print(saved_after(30))
"""


def test_compiled_and_uncompiled_chips_on_nets_end_in_the_same_state():
    done = children.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, cwd=children.ROOT
    )
    assert done.stdout.strip() == saved_after(30)
