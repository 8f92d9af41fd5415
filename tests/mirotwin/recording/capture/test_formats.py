"""Forms are told from the beginning of a file; hex text has digits in any usual dress, cut anywhere."""

import gzip
import re
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_protocol import stream
from miro_protocol.pcapng import render
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.forms import FORMS
from mirotwin.recording.capture.hextext import HexError, HexText
from mirotwin.recording.capture.input import HEAD_BYTES


@pytest.mark.parametrize(
    ("head", "format"),
    [
        (b"", "raw"),
        (b"\x55\x55\xff\x2d\xd4", "raw"),
        (b"55 55 ff 2d d4", "hex"),
        (b"0x55,0x55", "hex"),
        (b"\xef\xbb\xbf55 55 FF 2D D4\r\n", "hex"),
        (b"\xef\xbb\xbf# a capture\r\n55 fF\r\n", "hex"),
        (b"\xef\xbb\xbf792000 > 55 55\r\n", "stream"),
        (b"\xef\xbb\xbf", "raw"),
        (b"# a capture\n55 ff\n", "hex"),
        (b"792000 > 55 55", "stream"),
        (b"\n  # note\n\n 0 < 55", "stream"),
        (b"# mirotwin stream 1\n", "stream"),
        (b"\xef\xbb\xbf# mirotwin stream 1\n", "stream"),
        (render([Transmission(0, ">", b"a")]), "pcapng"),
        (b"\xd4\xc3\xb2\xa1", "pcap"),
        (b"\x89MCAP0\r\n", "recording"),
        (b"\x89MCA", "recording"),
        (b"\x89MC", "raw"),
        (b"792000 55", "hex"),
        (b"a" * HEAD_BYTES, "hex"),
        (b" " + b"a" * (HEAD_BYTES - 1), "hex"),  # half a pair at the end of the part that is looked at
    ],
)
def test_the_beginning_tells_the_format(head, format):
    assert detect(head).form == format


@pytest.mark.parametrize(
    "text",
    [b"hello", b"55 5", b"# only a comment", b"12 | 55", b"   \n", b"\xef\xbb\xbfhello", b"\xff\xfeh\0i\0"],
)
def test_text_in_no_known_form_is_not_taken_for_bytes(text):
    remedy = "name it with --from-form, or give --from-form raw"
    assert detect(text) == ("", "is text in no form that is known", remedy)


def test_a_firmware_image_is_no_capture():
    assert detect(b":0400000002002932AF\r\n:00000001FF\r\n")[:2] == ("", "is a firmware image (Intel HEX)")


def test_an_empty_file_is_called_empty():
    assert detect(b"") == ("raw", "it is empty", "")


def test_a_packed_file_is_said_to_be_packed():
    assert detect(gzip.compress(b"x"))[:2] == ("", "is packed by gzip")


@given(st.binary(max_size=300))
def test_any_bytes_have_a_format(head):
    assert detect(head).form in ("", *FORMS)


@given(
    st.lists(st.builds(Transmission, st.just(5), st.sampled_from("<>"), st.binary(min_size=1)), min_size=1)
)
def test_what_the_library_writes_as_a_stream_is_a_stream(sent):
    text = stream.format_stream(sent)
    assert detect(text.encode()).form == "stream"
    assert detect(text.partition("\n")[2].encode()).form == "stream"


def test_the_page_of_captures_names_all_forms():
    page = (Path(__file__).parents[4] / "docs/howto/captures.md").read_text(encoding="utf-8")
    section = page.partition("| `--from-form` |\n")[2].partition("Text in no known form")[0]
    rows, _, sentence = section.partition("The form is recognised; `--from-form`")
    cells = [row.split("|")[3] for row in rows.splitlines() if row.count("|") == 4]
    assert sorted(re.findall(r"`([^`]+)`", " ".join(cells) + sentence)) == sorted(FORMS)


BOM = "\ufeff"
TEXTS = st.lists(
    st.sampled_from(
        [
            *("55", "ff", "2D", "0", "x", "0x", "X", " ", "\n", "\r\n", "\t", ",", ":", ";", "#", "# note 5"),
            *("g", "é", BOM, "\ufefe"),
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


@example(BOM + "# note 00\r\n0x55, 0XFF:2d;55\tff2D # five\n55\r\n", [])
@given(TEXTS, st.lists(st.integers(0, 60)))
def test_any_text_in_any_pieces_is_read_as_character_by_character(text, cuts):
    data = text.encode()
    places = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    assert read([data[start:end] for start, end in pairwise(places)]) == naive(text)


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
