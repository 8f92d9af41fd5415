"""What a button puts on its net, and how it bounces."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.button import Button
from tests.robot.parts.bench import Bench

MS = 12_000


def bench(seed=0, **keys):
    return Bench({"key": (Button(**keys), {"pin": "net"})}, seed=seed)


def test_a_pressed_button_pulls_its_net_down_and_lets_it_go():
    board = bench()
    assert board.level("net") == 1
    board.put("key.pressed", True, 100)
    board.put("key.pressed", True, 150)
    board.put("key.pressed", False, 200)
    assert board.edges_of("net") == [(100, 0), (200, 1)]


def test_a_normally_closed_one_opens():
    board = bench(rest="closed")
    assert (board.level("net"), board.read("key.closed"), board.read("key.pressed")) == (0, True, False)
    board.put("key.pressed", True, 100)
    assert board.edges_of("net")[-1] == (100, 1)


def test_one_to_vcc_drives_its_net_high():
    board = Bench({"key": (Button(to="vcc"), {"pin": "net"})})
    board.put("key.pressed", True, 5)
    assert board.driven("net") == 1
    board.put("key.pressed", False, 9)
    assert board.driven("net") is None


def test_a_contact_needs_no_supply():
    board = bench()
    board.put("key.pressed", True, 5)
    board.power(0)
    assert board.level("net") == 0
    board.power(1)
    assert (board.level("net"), board.read("key.pressed")) == (0, True)


@given(st.integers(0, 1000), st.floats(0.01, 20.0), st.lists(st.integers(1, 400_000), min_size=1, max_size=6))
def test_it_bounces_within_its_time_and_ends_as_it_is_pressed(seed, bounce_ms, waits):
    board = bench(seed, bounce_ms=bounce_ms)
    for number, wait in enumerate(waits):
        pressed = number % 2 == 0
        begin = board.tick + wait
        board.put("key.pressed", pressed, begin)
        board.run(begin + int(bounce_ms * MS) + 2)
        edges = [edge for edge in board.edges_of("net") if edge[0] >= begin]
        assert edges[0][0] == begin
        assert len(edges) % 2 == 1
        assert 3 <= len(edges) <= 13
        assert edges[-1][1] == (0 if pressed else 1)
        ticks = [tick for tick, _ in edges]
        assert ticks == sorted(set(ticks))


def test_its_bounces_depend_on_the_seed_alone():
    def edges(seed):
        board = bench(seed, bounce_ms=5)
        board.put("key.pressed", True, 1000)
        board.run(100_000)
        return board.edges_of("net")

    assert edges(1) == edges(1) != edges(2)


@pytest.mark.parametrize("cut", [1000, 1001, 10_000, 30_000])
def test_a_bounce_goes_on_after_it_was_saved_and_loaded(cut):
    one, other = bench(3, bounce_ms=5), bench(3, bounce_ms=5)
    one.put("key.pressed", True, 1000)
    one.run(cut)
    other.load(one.save())
    seen = len(one.edges_of("net"))
    one.run(100_000)
    other.run(100_000)
    assert other.edges_of("net") == one.edges_of("net")[seen:]
    assert other.save() == one.save()
