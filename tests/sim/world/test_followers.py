"""What edges of a pin come to: the followers against rules said once more, the obvious way."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_sim.world import conditions as wait

CLOCK = 1_000_000  # a tick is a microsecond
EDGES = st.lists(st.integers(1, 40), min_size=1, max_size=30)
"""Ticks from one edge to the next."""


def edges_of(gaps, first):
    """(tick, level) of each edge, beginning with the level `first`."""
    ticks = [sum(gaps[: place + 1]) for place in range(len(gaps))]
    return [(tick, (first + place + 1) % 2) for place, tick in enumerate(ticks)]


def follow(condition, first, edges, until, cuts=()):
    """All matches up to `until`, the edges fed in pieces that end at `cuts`."""
    follower = condition.follower(5, 0, CLOCK, 0, first)
    matches, fed = [], 0
    for end in [*sorted(cuts), until]:
        new = [(tick, 5, level) for tick, level in edges if fed <= tick < end]
        noise = [(tick, 6, 1 - level) for tick, _, level in new]
        matches += follower.feed(sorted(new + noise), end)
        fed = max(fed, end)
    return matches


def pulses(edges, level):
    ends = itertools.pairwise(edges)
    return [(end, end - begun) for (begun, to), (end, _) in ends if to == level]


def periods(edges):
    rises = [tick for tick, level in edges if level]
    return list(itertools.pairwise(rises))


@given(EDGES, st.integers(0, 1), st.integers(0, 1), st.integers(0, 30), st.integers(0, 30))
def test_a_pulse_is_from_an_edge_to_the_next_if_it_is_as_wide_as_wanted(gaps, first, level, least, more):
    edges = edges_of(gaps, first)
    condition = wait.Pulse(pin="P1.0", level=level, at_least_us=least, at_most_us=least + more)
    expected = [(end, width) for end, width in pulses(edges, level) if least <= width <= least + more]
    assert follow(condition, first, edges, sum(gaps) + 1) == expected


@given(EDGES, st.integers(0, 1), st.floats(1e3, 1e6))
def test_a_frequency_is_that_of_the_last_period(gaps, first, least_hz):
    edges = edges_of(gaps, first)
    frequencies = [(end, CLOCK / (end - begun)) for begun, end in periods(edges)]
    fast = wait.Frequency(pin="P1.0", at_least_hz=least_hz)
    assert follow(fast, first, edges, sum(gaps) + 1) == [one for one in frequencies if one[1] >= least_hz]
    slow = wait.Frequency(pin="P1.0", at_most_hz=least_hz, outside=True)
    assert follow(slow, first, edges, sum(gaps) + 1) == [one for one in frequencies if one[1] > least_hz]


@given(EDGES, st.integers(0, 1), st.integers(1, 60))
def test_a_signal_that_is_too_slow_is_outside_as_soon_as_its_period_is_over(gaps, first, longest):
    edges, end = edges_of(gaps, first), sum(gaps) + 100
    condition = wait.Frequency(pin="P1.0", at_least_hz=CLOCK / longest).opposite()
    rises = [0, *(tick for tick, level in edges if level), end]
    expected = [
        (begun + longest, 0.0) for begun, until in itertools.pairwise(rises) if until - begun > longest
    ]
    assert follow(condition, first, edges, end) == expected


@given(EDGES, st.integers(0, 1))
def test_the_duty_is_the_share_of_the_last_period_in_which_the_pin_was_high(gaps, first):
    edges = edges_of(gaps, first)
    highs = dict(pulses(edges, 1))
    fall = {begun: next(tick for tick, level in edges if tick > begun) for begun, _ in periods(edges)}
    expected = [(end, highs[fall[begun]] / (end - begun)) for begun, end in periods(edges)]
    assert follow(wait.Duty(pin="P1.0"), first, edges, sum(gaps) + 1) == expected


@given(EDGES, st.integers(0, 1), st.integers(0, 1), st.integers(0, 40))
def test_a_level_counts_from_the_begin_or_from_the_last_edge(gaps, first, level, steady):
    edges, end = edges_of(gaps, first), sum(gaps) + 20
    condition = wait.Level(pin="P1.0", level=level, steady_ms=steady / 1000)
    spans = zip([(0, first), *edges], [*edges, (end, 2)], strict=True)
    expected = [
        begun + steady for (begun, at), (until, _) in spans if at == level and begun + steady <= until
    ]
    assert [tick for tick, _ in follow(condition, first, edges, end)] == expected


CONDITIONS = [
    wait.Edge(pin="P1.0", level=1),
    wait.Pulse(pin="P1.0", level=0, at_most_us=20),
    wait.Frequency(pin="P1.0", at_least_hz=3e4, outside=True),
    wait.Duty(pin="P1.0", at_least=0.5),
    wait.Level(pin="P1.0", level=1, steady_ms=0.015),
]


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda one: one.what)
@given(gaps=EDGES, first=st.integers(0, 1), cuts=st.lists(st.integers(0, 400), max_size=5))
def test_how_the_edges_come_in_pieces_changes_no_match(condition, gaps, first, cuts):
    edges, end = edges_of(gaps, first), max([sum(gaps) + 20, *cuts])
    assert follow(condition, first, edges, end, cuts) == follow(condition, first, edges, end)


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda one: one.what)
@given(gaps=EDGES, first=st.integers(0, 1))
def test_a_pin_behind_an_inverter_is_followed_as_it_sees_the_net(condition, gaps, first):
    edges = edges_of(gaps, first)
    inverted = condition.follower(5, 1, CLOCK, 0, first)
    changes = [(tick, 5, 1 - level) for tick, level in edges]
    assert inverted.feed(changes, sum(gaps) + 1) == follow(condition, first, edges, sum(gaps) + 1)


@pytest.mark.parametrize(
    ("limits", "fits", "does_not"),
    [
        ({"above": 3}, [3.01, 4], [3, -1]),
        ({"below": 3}, [2, True], [3, 3.5]),
        ({"above": 1, "below": 2}, [1.5], [1, 2]),
        ({"equals": 2}, [2, 2.0], [2.001, 1]),
        ({"equals": 2, "tolerance": 0.5}, [1.5, 2.5], [1.49, 2.51]),
        ({"equals": True}, [True, 1], [False, 0]),
        ({"equals": "on"}, ["on"], ["on ", ""]),
        ({"contains": "60"}, ["dist 60 cm", "60"], ["6 0", ""]),
        ({"equals": 2, "outside": True}, [3], [2]),
    ],
)
def test_a_value_fits_its_limits(limits, fits, does_not):
    condition = wait.Value(of="eyes.distance_cm", **limits)
    assert [value for value in (*fits, *does_not) if condition.fits(value)] == fits
    assert [value for value in (*fits, *does_not) if condition.opposite().fits(value)] == does_not


@pytest.mark.parametrize(
    ("limits", "value", "message"),
    [
        ({"above": 3}, "60 cm", "of: lcd.text is a text; use equals or contains"),
        ({"equals": 1}, "1", "of: lcd.text is a text"),
        ({"contains": "6"}, 60, "of: lcd.text is no text; use above, below or equals"),
    ],
)
def test_a_value_of_another_type_is_refused(limits, value, message):
    with pytest.raises(ValueError, match=message):
        wait.Value(of="lcd.text", **limits).fits(value)


@pytest.mark.parametrize(
    ("kind", "fields", "message"),
    [
        (wait.Pulse, {"pin": "P1.0", "at_least_us": 5, "at_most_us": 4}, "at_least_us: 5 is more than"),
        (wait.Value, {"of": "a.b"}, "value: says nothing of it; give above"),
        (wait.Value, {"of": "a.b", "above": 2, "below": 2}, "above: 2 leaves nothing below 2"),
        (
            wait.Value,
            {"of": "a.b", "equals": "x", "tolerance": 1},
            "tolerance: goes with equals and a number",
        ),
        (wait.Text, {}, "text: takes a text or a pattern; give one of the two"),
        (wait.Text, {"pattern": "(a"}, r"pattern: '\(a' is no regular expression: .*; repair it"),
    ],
)
def test_a_condition_that_can_never_be_is_refused_where_it_is_written(kind, fields, message):
    with pytest.raises(ValueError, match=message):
        kind(**fields)


TEXTS = st.binary(max_size=60)


@given(TEXTS, st.binary(min_size=1, max_size=2).filter(lambda data: data.isascii()))
def test_a_text_ends_with_each_character_that_completes_it(sent, text):
    from miro_sim.world.followers import TextFollower

    follower = TextFollower(wait.Text(text=text.decode()), 0, CLOCK)
    matches = follower.feed([(tick, 0, value) for tick, value in enumerate(sent)], 100)
    rest, expected = sent, []
    while text in rest:
        rest = rest[rest.index(text) + len(text) :]
        expected.append(len(sent) - len(rest) - 1)
    assert [tick for tick, _ in matches] == expected
