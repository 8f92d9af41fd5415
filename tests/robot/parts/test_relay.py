"""When a relay's contact follows its coil."""

import pytest

from miro_robot.parts.relay import Relay
from tests.robot.parts.bench import Bench

MS = 12_000


def bench(seed=0, **keys):
    board = Bench({"relay": (Relay(**keys), {"coil": "coil", "contact": "out"})}, ["coil"], seed=seed)
    board.drive("coil", 0 if keys.get("active") == "high" else 1)
    return board


def test_its_contact_closes_10_ms_after_the_coil_has_current_and_opens_5_ms_after_it_has_none():
    board = bench()
    board.drive("coil", 0, 1000)
    board.drive("coil", 1, 1000 + 50 * MS)
    board.run(100 * MS)
    assert board.edges_of("out") == [(1000 + 10 * MS, 0), (1000 + 55 * MS, 1)]
    assert board.read("relay.switched") == 2


def test_one_that_is_active_high_pulls_in_at_power_on_where_ports_are_high():
    board = Bench({"relay": (Relay(active="high"), {"coil": "coil"})})
    assert (board.read("relay.energized"), board.read("relay.closed")) == (True, False)
    board.run(10 * MS + 1)
    assert board.read("relay.closed")


def test_a_normally_closed_contact_to_vcc_opens():
    board = bench(rest="closed", to="vcc")
    assert (board.driven("out"), board.read("relay.closed")) == (1, True)
    board.drive("coil", 0)
    board.run(10 * MS + 1)
    assert (board.driven("out"), board.read("relay.closed")) == (None, False)


def test_a_coil_that_is_switched_back_too_soon_moves_nothing():
    board = bench()
    board.drive("coil", 0, 1000)
    board.drive("coil", 1, 1000 + 9 * MS)
    board.run(100 * MS)
    assert (board.edges_of("out"), board.read("relay.switched")) == ([], 0)


def test_without_supply_the_coil_has_no_current_and_the_contact_opens():
    board = bench()
    board.drive("coil", 0)
    board.run(20 * MS)
    board.power(0)
    assert (board.read("relay.closed"), board.read("relay.energized")) == (True, False)
    board.run(26 * MS)
    assert not board.read("relay.closed")
    board.power(1)
    board.drive("coil", 0)
    board.run(40 * MS)
    assert board.read("relay.closed")


@pytest.mark.parametrize(("stuck", "level"), [("open", 1), ("closed", 0)])
def test_a_contact_that_is_stuck_stays_and_is_mended(stuck, level):
    board = bench()
    board.put("relay.stuck", stuck)
    for coil in (0, 1, 0):
        board.drive("coil", coil)
        board.run(board.tick + 20 * MS)
        assert (board.level("out"), board.read("relay.closed")) == (level, stuck == "closed")
    board.put("relay.stuck", "none")
    assert (board.level("out"), board.read("relay.stuck"), board.read("relay.switched")) == (0, "none", 3)


def test_it_bounces_as_a_button_does_by_the_seed():
    def edges(seed):
        board = bench(seed, bounce_ms=2.0)
        board.drive("coil", 0)
        board.run(30 * MS)
        board.drive("coil", 1)
        board.run(60 * MS)
        return board.edges_of("out")

    closing = [edge for edge in edges(1) if edge[0] < 30 * MS]
    assert (closing[0], closing[-1][1]) == ((10 * MS, 0), 0)
    assert 3 <= len(closing) <= 13
    assert closing[-1][0] <= 12 * MS + 1
    assert edges(1) == edges(1) != edges(2)


def test_a_coil_that_is_switched_while_the_contact_bounces_moves_the_armature_later():
    board = bench(bounce_ms=8.0)
    board.drive("coil", 0, 0)
    board.drive("coil", 1, 11 * MS)
    board.run(60 * MS)
    assert board.read("relay.switched") == 2
    opening = [edge for edge in board.edges_of("out") if edge[0] >= 16 * MS]
    assert opening[-1][1] == 1
    assert opening[-1][0] <= 24 * MS + 1
