"""The Line against a plain list of edges."""

from itertools import cycle, islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_robot.mcs51.line import Line

EDGES = st.lists(st.tuples(st.integers(0, 20), st.integers(0, 1)), max_size=40)


def built(initial, steps):
    """A Line and the naive level per tick, from (advance, level) steps."""
    line = Line(initial)
    tick, levels = 0, {}
    for advance, level in steps:
        tick += advance
        line.append(tick, level)
        levels[tick] = level
    return line, levels


def naive_level(initial, levels, tick):
    before = [when for when in levels if when <= tick]
    return levels[max(before)] if before else initial


@given(st.integers(0, 1), EDGES, st.lists(st.integers(-5, 900), max_size=30))
def test_levels_and_edges_around_a_tick_are_those_of_a_list(initial, steps, queries):
    line, levels = built(initial, steps)
    edges = [
        tick
        for tick in levels
        if naive_level(initial, levels, tick) != naive_level(initial, levels, tick - 1)
    ]
    for query in queries:
        assert line.level_at(query) == naive_level(initial, levels, query)
        assert line.next_edge(query) == min((tick for tick in edges if tick > query), default=NEVER_TICK)
        assert line.edge_at(query) == max((tick for tick in edges if tick <= query), default=-1)


@given(st.integers(0, 1), EDGES, st.integers(0, 400), st.lists(st.integers(0, 400), max_size=10))
def test_forgetting_changes_no_answer_from_there_on(initial, steps, cut, queries):
    line, levels = built(initial, steps)
    line.forget(cut)
    for query in queries:
        if query >= cut:
            assert line.level_at(query) == naive_level(initial, levels, query)
    assert all(tick > cut for tick, _ in line.edges())


def test_going_back_in_time_is_refused():
    line = Line()
    line.append(10, 0)
    with pytest.raises(ValueError, match="edge at tick 9 comes after one at tick 10"):
        line.append(9, 1)


def test_the_ring_wraps_and_grows_when_nothing_is_forgotten():
    line = Line()
    for tick in range(10_000):
        line.append(tick, tick & 1)
        line.forget(tick - 2000)
    assert line.level_at(9_000) == 0
    for tick in range(10_000, 30_000):
        line.append(tick, tick & 1)
    assert line.edges()[-20_000:] == [(tick, tick & 1) for tick in range(10_000, 30_000)]
    assert [line.level_at(tick) for tick in (9_001, 29_998, 29_999)] == [1, 0, 1]
    assert line.next_edge(15_000) == 15_001


def test_a_line_is_full_when_more_than_2048_edges_wait_to_be_heard():
    line = Line()
    for number in range(2048):
        assert not line.full
        line.append(10 * number, number & 1)
    assert not line.full
    assert line.full_tick() == 20_470
    line.append(20_480, 0)
    assert line.full
    assert line.full_tick() == 20_470
    line.hear(20_470)  # 2047 edges come before it
    assert not line.full
    assert line.full_tick() == NEVER_TICK
    assert len(line.edges()) == 2049  # heard is not forgotten


@settings(max_examples=20)
@given(
    st.lists(st.integers(1, 40), min_size=1, max_size=20),
    st.integers(0, 9000),
    st.lists(st.integers(0, 90_000), max_size=5),
)
def test_what_waits_is_what_came_since_the_tick_last_heard(gaps, count, heard):
    line, ticks, now = Line(), [], 0
    for gap in islice(cycle(gaps), count):
        now += gap
        ticks.append(now)
        line.append(now, 1 - line.level_at(now))
    for tick in sorted(heard):
        line.hear(tick)
        waiting = [edge for edge in ticks if edge >= tick]
        assert line.full == (len(waiting) > 2048)
        assert line.full_tick() == (waiting[2047] if len(waiting) >= 2048 else NEVER_TICK)


def test_a_line_without_a_reader_drops_its_oldest_edges():
    line = Line()
    line.unread = True
    for tick in range(10_000):
        line.append(tick, tick & 1)
        assert line.level_at(tick) == tick & 1
        assert not line.full
    kept = line.edges()
    assert 2048 <= len(kept) <= 4096
    assert kept == [(tick, tick & 1) for tick in range(10_000 - len(kept), 10_000)]


def test_the_repr_shows_the_last_edges():
    line = Line()
    line.append(5, 0)
    assert repr(line) == "Line(settled_tick=0, level=0, last edges [5:0])"
