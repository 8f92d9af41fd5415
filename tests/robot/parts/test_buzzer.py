"""When a buzzer sounds, for how long, and with which tone."""

import pytest

from miro_robot.parts.buzzer import Buzzer
from tests.robot.parts.bench import Bench

MS = 12_000


def bench(**keys):
    board = Bench({"horn": (Buzzer(**keys), {"pin": "net"})}, drives=["net"])
    board.drive("net", 1)
    return board


def test_an_active_one_sounds_while_it_is_on():
    board = bench()
    board.drive("net", 0, 10 * MS)
    board.run(15 * MS)
    assert (board.read("horn.on"), board.read("horn.sounded_ms")) == (True, 5.0)
    board.drive("net", 1, 30 * MS)
    board.run(99 * MS)
    assert (board.read("horn.on"), board.read("horn.sounded_ms"), board.read("horn.frequency_hz")) == (
        False,
        20.0,
        0,
    )


@pytest.mark.parametrize("active", ["low", "high"])
def test_a_passive_one_has_the_frequency_of_its_pin_until_two_periods_after_the_last_pulse(active):
    board = bench(kind="passive", active=active)
    for half in range(10):
        board.drive("net", half % 2, 10 * MS + half * 6000)  # 1 kHz
    flowed = 10 * MS + (8 if active == "low" else 9) * 6000  # last
    board.run(flowed + 23_999)
    assert (board.read("horn.on"), board.read("horn.frequency_hz")) == (True, 1000.0)
    board.run(flowed + 24_000)
    assert (board.read("horn.on"), board.read("horn.frequency_hz")) == (False, 0.0)
    # From the second pulse on. Active high, the first was at tick 0, when the supply came up.
    second = 10 * MS + (12_000 if active == "low" else 6_000)
    assert board.read("horn.sounded_ms") == (flowed + 24_000 - second) / MS


def test_a_level_and_clicks_are_no_tone():
    board = bench(kind="passive")
    for click in range(4):
        board.drive("net", 0, (100 + 60 * click) * MS)
        board.drive("net", 1, (101 + 60 * click) * MS)
        assert not board.read("horn.on")
    assert board.read("horn.sounded_ms") == 0


@pytest.mark.parametrize("kind", ["active", "passive"])
def test_without_supply_it_is_silent_and_keeps_how_long_it_has_sounded(kind):
    board = bench(kind=kind)
    for pulse in range(5):
        board.drive("net", 0, (10 + 2 * pulse) * MS)
        board.drive("net", 1, (11 + 2 * pulse) * MS)
    board.drive("net", 0, 20 * MS)
    board.run(21 * MS)
    before = board.read("horn.sounded_ms")
    assert board.read("horn.on")
    board.power(0)
    board.run(100 * MS)
    assert (board.read("horn.on"), board.read("horn.sounded_ms")) == (False, before)
    board.power(1)
    board.drive("net", 0)
    assert board.read("horn.on") == (kind == "active")
    assert board.read("horn.sounded_ms") == before
