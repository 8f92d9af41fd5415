"""Encoder edges: against a look at every tick, in Gray order, reversible."""

import math
from itertools import accumulate

from hypothesis import example, given
from hypothesis import strategies as st

from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import Lm629Options
from miro_sim.plant.drive import Quadrature
from tests.example_count import examples
from tests.naive.plant import quadrature_edges
from tests.states import snapshot

MOVES = st.floats(-40.0, 40.0)
TICKS = st.integers(64, 2048)


def edges(encoder, moved, start_tick, ticks):
    """(tick, a, b) of every edge that the chip is told of."""
    chip = Lm629(Lm629Options())
    encoder.attach(start_tick, chip)
    chip.encoder_edges = []
    encoder.turn([moved], [start_tick, start_tick + ticks])
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


SPANS = st.one_of(st.integers(1, 60), st.integers(1, 2048))
SPEEDS = st.one_of(st.floats(0.0, 0.9), st.floats(0.0, 0.9), st.floats(-0.2, 1.5))
"""Counts in the time that edges have to be apart to count for sure."""
BATCHES = st.tuples(st.sampled_from((1.0, -1.0)), st.lists(st.tuples(SPEEDS, SPANS), max_size=16))
FILTERED = Lm629Options(filter_clocks=8)
CHIPS = st.builds(
    Lm629Options, filter_clocks=st.sampled_from((8, 8, 3, 1, 0)), double_step=st.sampled_from((0, 2))
)


@examples(300)
@given(CHIPS, st.lists(BATCHES, max_size=8), st.booleans())
@example(FILTERED, [(1.0, [(0.45, 39), (17.0, 2), (0.5, 20)])], False)  # fast between two edges
@example(FILTERED, [(1.0, [(0.6, 35)]), (-1.0, [(0.8, 200)])], False)  # back before the filter has counted
@example(FILTERED, [(1.0, [(0.51, 35)]), (-1.0, [(0.7, 1)]), (1.0, [(0.7, 1), (0.8, 60)])], False)
@example(FILTERED, [(1.0, [(0.6, 35), (-0.2, 40), (0.9, 60)])], False)  # there and back
@example(FILTERED, [(1.0, [(0.9, 40)]), (1.0, [(0.9, 400)])], True)  # past a low index
def test_a_chip_that_is_told_of_a_run_of_edges_is_as_one_that_is_told_of_each(options, batches, armed):
    shafts = [Quadrature(1.0) for _ in range(2)]
    chips = [Lm629(options) for _ in range(2)]
    spacing = chips[0].encoder.spacing
    tick = 1000
    for shaft, chip in zip(shafts, chips, strict=True):
        shaft.attach(tick, chip)
        if armed:
            chip.set_index(tick, 0)
    chips[1].encoder_edges = []  # whoever looks at edges is told of each
    for way, parts in batches:
        for chip in chips:
            if armed:
                chip.encoder.arm(tick)
        moved = [way * speed * ticks / spacing for speed, ticks in parts]
        ends = list(accumulate((ticks for _, ticks in parts), initial=tick))
        for shaft in shafts:
            shaft.turn(moved, ends)
        tick = ends[-1]
        assert snapshot(chips[0]) == snapshot(chips[1])


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
