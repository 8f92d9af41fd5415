"""The one line of input that cannot be used, its remedy for a misspelt word, and files that a user names."""

import os
import pickle
from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_exact.inputs import InputError, check_regular, read_input

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("parts", "line"),
    [
        (("a.ihx", 3, "bad checksum", "rebuild it"), "a.ihx:3: bad checksum; rebuild it"),
        (("a.ihx", 0, "is empty", "rebuild it"), "a.ihx: is empty; rebuild it"),
        (("a.stream", (2, 10), "no digit"), "a.stream:2:10: no digit"),
        (("a.mcap", "offset 8", "damaged", "copy it again"), "a.mcap: offset 8: damaged; copy it again"),
        (("a.mcap", "", "is a folder", "name a file"), "a.mcap: is a folder; name a file"),
        (("", "--stdin", "is closed", "name a file"), "--stdin: is closed; name a file"),
        (("", "", "no such engine"), "no such engine"),
    ],
)
def test_file_place_what_and_remedy_make_one_line(parts, line):
    assert str(BadInput(*parts)) == line


def test_what_a_terminal_would_obey_is_escaped():
    assert str(BadInput("a\nb", "key\x1b[2J", "what", "")) == "a\\nb: key\\x1b[2J: what"


def test_a_value_of_a_megabyte_is_shown_by_its_ends():
    error = BadInput("a.toml", "key", "x" * 1_000_000 + "end", "remedy")
    assert len(str(error)) < 700
    assert str(error).startswith("a.toml: key: xxx")
    assert str(error).endswith("xxxend; remedy")
    assert len(error.what) == 1_000_003


def test_the_parts_can_be_read_from_the_error():
    error = BadInput("a.ihx", 3, "bad checksum", "rebuild it")
    assert (error.path, error.place, error.what, error.remedy) == ("a.ihx", 3, "bad checksum", "rebuild it")
    assert isinstance(error, ValueError)


def test_it_gets_from_one_process_to_another_with_its_line():
    class Narrow(BadInput):
        def __init__(self, what):
            super().__init__("a.toml", 3, what, "mend it")

    again = pickle.loads(pickle.dumps(Narrow("odd")))
    assert str(again) == "a.toml:3: odd; mend it"
    assert isinstance(again, BadInput)


def test_an_amount_of_one_is_singular():
    said = [amount(number, "frame") for number in (0, 1, 2)]
    assert said == ["0 frames", "1 frame", "2 frames"]
    assert [amount(number, "crash", "crashes") for number in ("no", 1, 2)] == [
        "no crashes",
        "1 crash",
        "2 crashes",
    ]


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


def test_a_file_up_to_the_limit_is_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x" * (1 << 20))
    assert read_input(path, 1 << 20) == path.read_bytes()
    path.write_bytes(b"x" * ((1 << 20) + 1))
    with pytest.raises(InputError, match=r"holds more than 1 MiB; is this the right file\?"):
        read_input(path, 1 << 20)


def test_a_file_with_the_prefix_has_a_limit_of_its_own(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"ab" * 100)
    assert read_input(path, 10, prefix=b"ab", prefix_limit=200) == path.read_bytes()
    with pytest.raises(InputError):
        read_input(path, 10, prefix=b"ab", prefix_limit=199)
    with pytest.raises(InputError):
        read_input(path, 10, prefix=b"ba", prefix_limit=200)


def test_devices_are_refused_but_the_empty_one(tmp_path):
    if not os.path.exists("/dev/zero"):
        pytest.skip("this system has no /dev/zero")
    with pytest.raises(InputError, match="/dev/zero: is a device"):
        read_input("/dev/zero")
    with pytest.raises(InputError, match="/dev/zero: is not a regular file"):
        check_regular("/dev/zero")
    assert read_input("/dev/null") == b""
