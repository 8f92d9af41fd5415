"""The short form of `python -m tests.fuzz`: each kept input, and a moment of changes by chance."""

import pytest

from tests.fuzz import corpus, mutation
from tests.fuzz.catalogue import TARGETS
from tests.fuzz.target import Draws, Target, pieces, refused

MOMENT_S = 0.1
MOST = 40


@pytest.mark.parametrize("name", TARGETS)
def test_kept_inputs_and_changed_ones_keep_the_promise(name):
    target = TARGETS[name]
    kept = corpus.kept(name)
    run = target.make()
    outcomes = {run(data) for _, data in kept}
    assert len(outcomes) > 1, "the kept inputs all come to the same"
    mutation.campaign(name, target, run, [data for _, data in kept], 1, MOMENT_S, len(kept) + MOST)


def test_what_is_kept_is_small_and_has_the_name_of_its_content():
    assert sorted(path.name for path in corpus.FOLDER.iterdir()) == sorted(TARGETS)
    for name in TARGETS:
        kept = corpus.kept(name)
        assert 2 <= len(kept) <= corpus.MOST_FILES
        assert all(corpus.file_name(data) == file for file, data in kept)
        assert max(len(data) for _, data in kept) <= min(corpus.MOST_BYTES, TARGETS[name].most_bytes)


def test_each_target_runs_on_one_of_the_two_engines():
    assert {target.engine for target in TARGETS.values()} == {"compiled", "python"}


def _breaks_on(wanted):
    def run(data):
        if wanted in data:
            raise IndexError(wanted)
        return f"{len(data)}"

    return run


@pytest.mark.parametrize("wanted", [b"\x55\x55", b"word", b"cdcd", b"\xff"])
def test_changes_by_chance_find_what_breaks_and_say_which_input_it_was(wanted):
    run = _breaks_on(wanted)
    target = Target("a toy", lambda: run, lambda: [b"abcdefgh"], words=(b"word",))
    with pytest.raises(mutation.Broken) as caught:
        mutation.campaign("toy", target, run, [b"abcdefgh", b"U" + bytes(9)], 1, 30.0, 100_000)
    assert wanted in caught.value.data
    with pytest.raises(mutation.Broken) as again:
        mutation.campaign("toy", target, run, [b"abcdefgh", b"U" + bytes(9)], 1, 30.0, 100_000)
    assert (again.value.number, again.value.data) == (caught.value.number, caught.value.data)


def test_a_changed_input_is_no_longer_than_its_target_takes():
    target = Target("a toy", lambda: _breaks_on(b"?"), lambda: [b"abc"], most_bytes=10)
    run = _breaks_on(b"never there")
    outcomes = mutation.campaign("toy", target, run, [b"abcdefghij"], 1, 30.0, 2000)
    assert {int(outcome) for outcome in outcomes} <= set(range(11))
    assert len(outcomes) > 5


@pytest.mark.parametrize("text", ["", "two\nlines", "a bell\a", "x" * 3000])
def test_a_refusal_that_is_no_line_for_people_is_a_finding(text):
    with pytest.raises(AssertionError):
        refused(ValueError(text))


def test_refusals_of_one_kind_are_one_outcome():
    assert refused(ValueError("a.toml:12: 'x' is no key")) == refused(
        ValueError("a.toml:7: 'other' is no key")
    )
    assert refused(ValueError("a.toml:12: no key")) != refused(ValueError("a.toml:12: no value"))


def test_inputs_are_chosen_by_what_they_reach_the_smaller_first():
    def run(data):
        return "taken" if data.startswith(b"T") else "refused: " + "x" * min(len(data), 2)

    found = corpus.chosen(run, [b"Tlonger", b"T", b"a", b"b", b"cc", b"ddd", b"x" * 5000])
    assert found == [b"T", b"a", b"cc"]


def test_decisions_are_0_where_no_bytes_are_left():
    draw = Draws(b"\x05\x02\x01abc")
    assert (draw.below(4), draw.below(1 << 16), draw.take(2)) == (1, 0x102, b"ab")
    assert (draw.signed(4), draw.left, draw.below(9), draw.take(3)) == (ord("c"), 0, 0, b"")
    assert list(pieces(b"abcde", 2)) == [b"ab", b"cd", b"e"]
