"""The recorded terminal of docs/start.md says what the commands print today."""

import re
import xml.etree.ElementTree as ElementTree

import pytest

from docs.film.__main__ import COLUMNS, COMMANDS, ROWS, TARGET
from docs.film.picture import PROMPT
from docs.film.terminal import Run, _lines, recorded, text_of

SVG = "{http://www.w3.org/2000/svg}"
TIME = re.compile(r"in \d+\.\d+ s \(\d+(\.\d+)? x real time")
MOST_BYTES = 150_000


def shown():
    """The rows of the picture, words by words: where they stand is its own matter."""
    rows = ElementTree.parse(TARGET).iter(SVG + "text")
    return [words("".join(span.text + " " for span in row)) for row in rows]


def words(text):
    return TIME.sub("in N s (N x real time", " ".join(text.split()))


@pytest.mark.slow
def test_the_film_shows_what_its_commands_print_today():
    expected = []
    for command, lines in zip(COMMANDS, recorded(COMMANDS, COLUMNS, ROWS), strict=True):
        typed = PROMPT + command
        expected += [typed[at : at + COLUMNS] for at in range(0, len(typed), COLUMNS)]
        expected += [text_of(line) for line in lines]
    assert shown() == [words(text) for text in expected], "python -m docs.film makes it again"


def test_the_film_ends_on_a_check_that_failed_with_its_reason_and_place():
    end = "\n".join(shown()[-5:])
    assert "expectation failed: tracks_within_cm: net0/robot0: tick " in end
    assert "wanted at most 3 cm from the reference, found " in end
    assert "equals the recorded one in all 180 control periods" in end


def test_the_film_is_small_and_takes_nothing_from_elsewhere():
    text = TARGET.read_text(encoding="utf-8")
    assert len(text) < MOST_BYTES
    assert re.findall(r"https?:[^\"\s]*", text) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"<script|<image|url\(|@import", text)


def test_what_a_progress_bar_drew_and_erased_is_not_in_a_recording():
    bar = "\x1b[?25lrunning \x1b[35m----\x1b[0m 40%\r\x1b[2Krunning 100%\n\r\x1b[1A\x1b[2K\x1b[?25h"
    assert _lines(f"{bar}\x1b[1mdone\x1b[0m well\r\n", 80) == [(Run("done", True), Run(" well", False))]


def test_a_line_is_broken_where_the_terminal_ends_and_an_empty_one_stays():
    assert _lines("abcdef\r\n\r\ng\r\n", 4) == [
        (Run("abcd", False),),
        (Run("ef", False),),
        (),
        (Run("g", False),),
    ]


def test_a_code_that_cannot_be_shown_is_refused():
    with pytest.raises(ValueError, match="not shown"):
        _lines("\x1b[5Cx", 80)
