"""One remedy for a word that is not among the known ones."""

from pathlib import Path

import pytest

from miro_exact.bad_input import did_you_mean

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("word", "known", "remedy", "said"),
    [
        ("rnu", ["run", "report"], "", "did you mean run?"),
        ("rnu", ["run", "report"], "there are two", "did you mean run? there are two"),
        ("rUN", ["Run", "REPORT"], "", "did you mean Run?"),
        ("x", ["run", "report"], "there are two", "there are two"),
        ("x", [], "", ""),
        ("run" * 100_000, ["run"], "", ""),
    ],
)
def test_the_nearest_known_word_comes_first(word, known, remedy, said):
    assert did_you_mean(word, known, remedy) == said


def test_it_is_the_only_place_that_guesses_what_was_meant():
    folders = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    guessing = [path.name for path in files if "get_close_matches" in path.read_text(encoding="utf-8")]
    assert guessing == ["bad_input.py"]
