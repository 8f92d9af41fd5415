"""The short form of `python -m tests.fuzz`: each kept input, and a moment of changes by chance; and the command."""

import importlib.util
import sys

import pytest

from tests import children
from tests.fuzz import campaign, corpus, mutation
from tests.fuzz.catalogue import TARGETS
from tests.fuzz.target import Draws, Target, pieces, refused

MOMENT_S = 0.1
MOST = 40


@pytest.mark.parametrize("name", TARGETS)
def test_kept_inputs_and_changed_ones_keep_the_promise(name):
    target = TARGETS[name]
    kept = corpus.kept(name)
    run = target.make()
    outcomes = {run(data) for data in kept}
    assert len(outcomes) > 1, "the kept inputs all come to the same"
    mutation.campaign(name, target, run, kept, 1, MOMENT_S, len(kept) + MOST)


def test_what_is_kept_is_small_and_has_the_name_of_its_content():
    assert sorted(path.name for path in corpus.FOLDER.iterdir()) == sorted(TARGETS)
    for name, target in TARGETS.items():
        kept = corpus.kept(name)
        assert 2 <= len(kept) <= corpus.MOST_FILES
        assert {corpus.file_name(data) for data in kept} == {
            path.name for path in (corpus.FOLDER / name).iterdir()
        }
        assert max(map(len, kept)) <= min(corpus.MOST_BYTES, target.most_bytes)


def _breaks_on(wanted):
    def run(data):
        if wanted in data:
            raise IndexError(wanted)
        return f"{len(data)}"

    return run


@pytest.mark.parametrize("wanted", [b"\x55\x55", b"word", b"cdcd", b"\xff"])
def test_changes_by_chance_find_what_breaks_and_say_which_input_it_was(wanted):
    run = _breaks_on(wanted)
    target = Target("a toy", lambda: run, words=(b"word",))
    found = []
    for _ in range(2):
        with pytest.raises(mutation.Broken) as caught:
            mutation.campaign("toy", target, run, [b"abcdefgh", b"U" + bytes(9)], 1, 30.0, 100_000)
        found.append((caught.value.number, caught.value.data))
    assert wanted in found[0][1]
    assert found[0] == found[1]


def test_a_changed_input_is_no_longer_than_its_target_takes():
    run = _breaks_on(b"never there")
    target = Target("a toy", lambda: run, most_bytes=10)
    outcomes = mutation.campaign("toy", target, run, [b"abcdefghij"], 1, 30.0, 2000)
    assert {int(outcome) for outcome in outcomes} <= set(range(11))
    assert len(outcomes) > 5


@pytest.mark.parametrize("text", ["", "two\nlines", "a bell\a", "x" * 3000])
def test_a_refusal_that_is_no_line_for_people_is_a_finding(text):
    with pytest.raises(AssertionError):
        refused(ValueError(text))


def test_refusals_of_one_kind_are_one_outcome():
    one, same, other = ("a.toml:12: 'x' is no key", "a.toml:7: 'other' is no key", "a.toml:12: no value")
    assert refused(ValueError(one)) == refused(ValueError(same)) != refused(ValueError(other))


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


def command(*words):
    called = [sys.executable, "-m", "tests.fuzz", *words]
    environment = campaign.child_environment({})
    found = children.run(called, cwd=corpus.ROOT, env=environment, capture_output=True, text=True)
    return found.returncode, found.stdout, found.stderr


def test_targets_are_listed_with_what_they_are():
    code, out, _ = command("--list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(TARGETS)


def test_a_target_that_is_not_there_is_refused_in_a_line():
    code, _, err = command("nothing")
    assert (code, err) == (2, "there is no target 'nothing'; --list names them\n")


def test_a_campaign_by_chance_says_how_much_it_ran():
    code, out, _ = command("frames", "--plain", "--time", "0.3s")
    assert code == 0
    assert out.splitlines()[0] == "changes by chance"
    assert int(out.splitlines()[1].split()[1]) > 20


def test_one_input_is_run_again_with_what_came_of_it():
    kept = next((corpus.FOLDER / "frames").iterdir())
    code, out, _ = command("frames", "--run", str(kept))
    assert code == 0
    assert out.strip()


@pytest.mark.skipif(importlib.util.find_spec("atheris") is None, reason="needs Atheris")
def test_a_campaign_under_atheris_says_what_it_reached():
    code, out, _ = command("frames", "--time", "1s")
    assert code == 0
    assert "guided by Atheris" in out
    assert " edges, " in out
