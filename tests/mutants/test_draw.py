"""The mutants of the firmware have an order and names that stay, and a seed draws the same ones everywhere."""

from collections import Counter
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.mutants.draw import COUNT, SEED, drawn, mutants_of, source_files

SOURCES = source_files()
MUTANTS = mutants_of(SOURCES)


def test_the_order_is_that_of_the_places_and_names_are_unique():
    assert [one.id for one in mutants_of(source_files())] == [one.id for one in MUTANTS]
    places = [(one.file, one.line, one.column) for one in MUTANTS]
    assert places == sorted(places)
    assert len({one.id for one in MUTANTS}) == len(MUTANTS) > 2000


def test_a_name_says_where_the_old_text_stands():
    for one in MUTANTS:
        line = "\n".join(SOURCES[one.file].splitlines()[one.line - 1 :])
        assert line.startswith(one.change.old, one.column - 1), one.id


@settings(max_examples=30)
@given(st.integers(0, 200), st.integers(0, 200), st.integers(0, 1 << 62))
def test_a_longer_draw_begins_with_the_shorter_one(one, other, seed):
    short, long = sorted((one, other))
    some = MUTANTS[::10]
    found = drawn(some, long, seed)
    assert found[:short] == drawn(some, short, seed)
    assert len(set(found)) == long


def test_another_seed_draws_others():
    assert drawn(MUTANTS, COUNT, SEED) != drawn(MUTANTS, COUNT, SEED + 1)


def test_every_operator_in_every_file_is_drawn_and_the_rest_is_in_proportion():
    found = drawn(MUTANTS)
    there = Counter((one.file, one.change.operator) for one in MUTANTS)
    taken = Counter((one.file, one.change.operator) for one in found)
    assert set(taken) == set(there)
    highest_taken = max(Fraction(taken[group] - 1, count) for group, count in there.items())
    lowest_left = min(Fraction(taken[group], count) for group, count in there.items() if taken[group] < count)
    assert highest_taken <= lowest_left
