"""Encoder edges: against a look at every tick, in Gray order, reversible."""

import math

from hypothesis import given
from hypothesis import strategies as st

from miro_exact.state import restore, snapshot
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import Lm629Options
from miro_sim.plant.drive import Quadrature
from tests.naive.plant import quadrature_edges

MOVES = st.floats(-40.0, 40.0)
TICKS = st.integers(64, 2048)


def edges(encoder, moved, start_tick, ticks):
    """(tick, a, b) of every edge that the chip is told of."""
    chip = Lm629(Lm629Options())
    chip.encoder_edges = []
    encoder.turn(moved, start_tick, ticks, chip)
    return chip.encoder_edges


@given(st.lists(st.tuples(MOVES, TICKS), max_size=6))
def test_edges_are_those_seen_by_looking_at_every_tick(steps):
    encoder = Quadrature(1.0)
    tick = 1000
    for moved, ticks in steps:
        expected = quadrature_edges(encoder.position, moved, tick, ticks)
        found = edges(encoder, moved, tick, ticks)
        assert [edge[1:] for edge in found] == [
            ((count + 1) // 2 % 2, count // 2 % 2) for _, count in expected
        ]
        for (got, *_), (seen, _) in zip(found, expected, strict=True):
            assert abs(got - seen) <= 1  # a crossing within rounding of a tick may fall on either side
            assert tick < got <= tick + ticks
        assert [edge[0] for edge in found] == sorted(edge[0] for edge in found)
        assert encoder.count == math.floor(encoder.position)
        tick += ticks


def test_crossing_ticks_are_rounded_up_to_the_first_tick_that_has_the_new_count():
    encoder = Quadrature(1.0)  # starts at 0.5
    assert [edge[0] for edge in edges(encoder, 2.0, 0, 200)] == [50, 150]
    assert [edge[0] for edge in edges(encoder, -2.0, 1000, 200)] == [1051, 1151]


def test_forward_a_leads_b_and_backward_b_leads_a():
    encoder = Quadrature(1.0)
    assert (encoder.a(), encoder.b()) == (0, 0)
    assert [edge[1:] for edge in edges(encoder, 4.0, 0, 100)] == [(1, 0), (1, 1), (0, 1), (0, 0)]
    assert [edge[1:] for edge in edges(encoder, -5.0, 0, 100)] == [(0, 1), (1, 1), (1, 0), (0, 0), (0, 1)]


def test_a_shaft_at_rest_shows_no_edge():
    encoder = Quadrature(2048.0)
    assert edges(encoder, 0.0, 0, 2048) == []
    assert encoder.position == 0.5


def test_a_snapshot_keeps_position_and_count():
    encoder = Quadrature(3.0)
    edges(encoder, -7.3, 0, 100)
    other = Quadrature(3.0)
    restore(other, snapshot(encoder))
    assert snapshot(other) == snapshot(encoder)
    assert repr(other) == repr(encoder)
    assert edges(other, 5.0, 0, 99) == edges(encoder, 5.0, 0, 99)
