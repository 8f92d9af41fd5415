"""When a LED is lit."""

import pytest

from miro_robot.parts.led import Led
from tests.robot.parts.bench import Bench


@pytest.mark.parametrize(("active", "lit"), [("low", 0), ("high", 1)])
def test_it_is_lit_at_its_level_and_counts_how_often(active, lit):
    board = Bench({"lamp": (Led(active=active), {"pin": "net"})}, ["net"])
    board.drive("net", 1 - lit)
    for tick in (100, 200, 300):
        board.drive("net", lit, tick)
        assert board.read("lamp.on")
        board.drive("net", 1 - lit, tick + 50)
        assert not board.read("lamp.on")
    assert board.read("lamp.flashes") == 3


def test_one_that_is_lit_when_the_supply_comes_has_not_flashed():
    board = Bench({"lamp": (Led(active="high"), {"pin": "net"})})
    assert (board.read("lamp.on"), board.read("lamp.flashes")) == (1, 0)


def test_without_supply_it_is_dark():
    board = Bench({"lamp": (Led(), {"pin": "net"})}, ["net"])
    board.drive("net", 0)
    board.power(0)
    assert not board.read("lamp.on")
    board.power(1)
    board.drive("net", 0)
    assert board.read("lamp.on")
