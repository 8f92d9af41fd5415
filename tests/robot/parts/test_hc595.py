"""What a 74HC595 takes, stores and shows."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.hc595 import Hc595
from tests.robot.parts.bench import Bench

INPUTS = ["ser", "srclk", "rclk", "oe", "srclr"]
OUTPUTS = [f"q{bit}" for bit in range(8)]


def bench(*wired):
    names = [*(wired or INPUTS), *OUTPUTS, "q7s"]
    board = Bench({"chip": (Hc595(), {name: name for name in names})}, wired or INPUTS)
    board.drive_all({name: int(name == "srclr") for name in wired or INPUTS})
    return board


def pulse(board, net):
    board.drive(net, 1, board.tick + 12)
    board.drive(net, 0, board.tick + 12)


def shift(board, *levels):
    for level in levels:
        board.drive("ser", level, board.tick + 12)
        pulse(board, "srclk")


def send(board, value):
    """A byte, its highest bit first."""
    shift(board, *(value >> bit & 1 for bit in range(7, -1, -1)))


def outputs(board):
    return [board.driven(net) for net in OUTPUTS]


def test_a_byte_that_was_shifted_in_appears_when_the_storage_clock_rises():
    board = bench("ser", "srclk", "rclk")
    send(board, 0xB1)
    assert (outputs(board), board.read("chip.shifted")) == ([0] * 8, 0xB1)
    board.drive("rclk", 1, board.tick + 12)
    assert outputs(board) == [1, 0, 0, 0, 1, 1, 0, 1]
    board.drive("rclk", 0, board.tick + 12)
    assert (board.read("chip.outputs"), board.read("chip.stores"), board.read("chip.late_bits")) == (
        0xB1,
        1,
        0,
    )


def test_outputs_let_go_while_oe_is_high_and_the_registers_stay():
    board = bench()
    send(board, 0x0F)
    pulse(board, "rclk")
    board.drive("oe", 1)
    assert (outputs(board), board.driven("q7s"), board.read("chip.enabled")) == ([None] * 8, 0, False)
    send(board, 0x80)
    board.drive("oe", 0)
    assert (outputs(board), board.driven("q7s")) == ([1] * 4 + [0] * 4, 1)


def test_clear_empties_the_shift_register_alone_and_goes_before_the_clock():
    board = bench()
    send(board, 0xFF)
    pulse(board, "rclk")
    board.drive("srclr", 0)
    shift(board, 1)
    assert (board.read("chip.shifted"), board.read("chip.outputs"), board.level("q7s")) == (0, 0xFF, 0)


def test_two_in_a_row_get_sixteen_bits_from_three_pins():
    wires = {"srclk": "srclk", "rclk": "rclk"}
    board = Bench(
        {
            "a": (Hc595(), {**wires, "ser": "ser", "q7s": "link"}),
            "b": (Hc595(), {**wires, "ser": "link"}),
        },
        ["ser", "srclk", "rclk"],
    )
    board.drive_all({"ser": 0, "srclk": 0, "rclk": 0})
    send(board, 0x12)
    send(board, 0x34)
    pulse(board, "rclk")
    assert (board.read("b.outputs"), board.read("a.outputs")) == (0x12, 0x34)
    assert (board.read("a.late_bits"), board.read("b.late_bits")) == (0, 0)


def test_where_both_clocks_are_one_wire_the_storage_is_one_pulse_behind():
    wires = {"ser": "ser", "srclk": "clock", "rclk": "clock"}
    board = Bench({"chip": (Hc595(), wires)}, ["ser", "clock"])
    board.drive_all({"ser": 1, "clock": 0})
    seen = []
    for _ in range(3):
        pulse(board, "clock")
        seen.append((board.read("chip.shifted"), board.read("chip.outputs")))
    assert seen == [(1, 0), (3, 1), (7, 3)]


def test_of_data_that_move_with_the_clock_it_takes_what_was_before_and_counts_it():
    board = bench()
    board.drive_all({"ser": 1, "srclk": 1}, 100)
    assert (board.read("chip.shifted"), board.read("chip.late_bits")) == (0, 1)


def test_it_begins_anew_with_its_supply():
    board = bench()
    send(board, 0xFF)
    pulse(board, "rclk")
    board.power(0)
    assert (outputs(board), board.driven("q7s")) == ([None] * 8, None)
    board.power(1)
    assert board.driven("q7s") == 0
    board.drive("oe", 0)
    assert (outputs(board), board.read("chip.shifted")) == ([0] * 8, 0)


@pytest.mark.parametrize("unwired", [("ser", "srclk", "rclk"), ()], ids=["three wires", "five wires"])
@given(steps=st.lists(st.dictionaries(st.sampled_from(INPUTS), st.integers(0, 1), min_size=1), max_size=60))
def test_it_follows_its_function_table(unwired, steps):
    """The table of TI's sheet, row by row, over whatever edges."""
    board = bench(*unwired)
    levels = {"ser": 0, "srclk": 0, "rclk": 0, "oe": 0, "srclr": 1}
    shifted, stored = [0] * 8, [0] * 8
    for number, change in enumerate(steps):
        change = {net: level for net, level in change.items() if net in (unwired or INPUTS)}
        board.drive_all(change, 100 * number + 100)
        before, levels = levels, {**levels, **change}
        rose = [net for net in levels if levels[net] > before[net]]
        if "rclk" in rose:
            stored = shifted
        if levels["srclr"] == 0:
            shifted = [0] * 8
        elif "srclk" in rose:
            shifted = [before["ser"], *shifted[:7]]
        assert outputs(board) == ([None] * 8 if levels["oe"] else stored)
        assert board.driven("q7s") == shifted[7]
