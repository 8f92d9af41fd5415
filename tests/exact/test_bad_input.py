"""The one line of input that cannot be used."""

import pickle

import pytest

from miro_exact.bad_input import BadInput, amount


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
