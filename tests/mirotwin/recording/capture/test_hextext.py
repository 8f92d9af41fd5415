"""Hex text: digits in any usual dress, cut anywhere, and what is no digit named with its place."""

import re
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.recording.capture.hextext import HexError, HexText

BOM = "\ufeff"
TEXTS = st.lists(
    st.sampled_from(
        [
            "55",
            "ff",
            "2D",
            "0",
            "x",
            "0x",
            "X",
            " ",
            "\n",
            ",",
            ":",
            ";",
            "#",
            "# note 5",
            "g",
            "\t",
            "é",
            "\r\n",
            BOM,
            "\ufefe",
        ]
    )
).map("".join)


def naive(text):
    """Bytes and the place of the first thing that is not one, character by character."""
    found = bytearray()
    place = 0
    while place < len(text):
        if text[place] in " \t\r\n\v\f,;:\ufeff":
            place += 1
        elif text[place] == "#":
            while place < len(text) and text[place] != "\n":
                place += 1
        elif text[place : place + 2] in ("0x", "0X"):
            place += 2
        elif re.fullmatch("[0-9a-fA-F]{2}", text[place : place + 2]):
            found.append(int(text[place : place + 2], 16))
            place += 2
        else:
            before = text[:place].replace(BOM, "").encode()
            return bytes(found), (before.count(b"\n") + 1, len(before) - before.rfind(b"\n"))
    return bytes(found), None


def read(pieces):
    reader, found = HexText("a.hex"), b""
    try:
        for piece in pieces:
            found += reader.feed(piece)
        reader.finish()
    except HexError as error:
        return found, error.place
    return found, None


@given(TEXTS, st.lists(st.integers(0, 60)))
def test_any_text_in_any_pieces_is_read_as_character_by_character(text, cuts):
    data = text.encode()
    places = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    assert read([data[start:end] for start, end in pairwise(places)]) == naive(text)


@pytest.mark.parametrize(
    "text",
    [
        "55 ff 2d",
        "55ff2d",
        "0x55, 0xFF, 0x2D",
        "55:ff:2d\n",
        "55 # five\nff;2d",
        "# 00\n55ff\t2D",
        "55\r\nFF\r\n2d\r\n",
    ],
)
@pytest.mark.parametrize("before", ["", BOM, BOM + "# note\r\n"])
def test_usual_ways_to_write_bytes_are_read(text, before):
    assert read([(before + text).encode()]) == (b"\x55\xff\x2d", None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("55 f", r"a.hex:1:4: the digit 'f' stands alone; write two hex digits"),
        ("55\n ff zz", r"a.hex:2:5: 'z' is no hex digit"),
        ("5 5", r"a.hex:1:1: the digit '5' stands alone"),
        (BOM + "55 zz", r"a.hex:1:4: 'z' is no hex digit"),
        (BOM + "55\r\nff zz", r"a.hex:2:4: 'z' is no hex digit"),
    ],
)
def test_what_is_no_pair_is_named_with_line_and_column(text, message):
    reader = HexText("a.hex")
    reader.feed(text.encode())
    with pytest.raises(HexError, match=message):
        reader.finish()
