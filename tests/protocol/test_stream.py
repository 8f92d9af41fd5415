"""Stream files: what is written is read back, and what cannot be read is named by line, column and remedy."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol import stream
from miro_protocol.stream import StreamError, Transmission

comments = st.text(st.characters(blacklist_categories=("Cc", "Cs", "Zl", "Zp")), max_size=20).map(str.strip)
transmissions = st.lists(
    st.builds(
        Transmission,
        st.integers(0, stream.MAX_TICK),
        st.sampled_from(stream.DIRECTIONS),
        st.binary(min_size=1, max_size=40),
        comments,
    )
).map(lambda some: sorted(some, key=lambda one: one.tick))


@settings(deadline=None)
@given(transmissions)
def test_what_is_written_is_read_back(sent):
    assert stream.parse(stream.format_stream(sent)) == sent


def test_a_line_looks_as_the_protocol_page_shows_it():
    line = stream.format_line(Transmission(792000, ">", b"\x55\xff\x2d\xd4", "team seq=3"))
    assert line == "792000 > 55 ff 2d d4  # team seq=3"


def test_blank_lines_comments_capitals_and_windows_line_ends_are_read():
    text = "# anything\r\n\r\n  10 < AB cd\r\n   # more\r\n10 > 00 # note"
    assert stream.parse(text) == [Transmission(10, "<", b"\xab\xcd"), Transmission(10, ">", b"\0", "note")]


REFUSED = [
    ("x > 55", 1, 1, "'x' is not a tick", "0..2305843009213693951"),
    ("-1 > 55", 1, 1, "'-1' is not a tick", ""),
    ("9223372036854775808 > 55", 1, 1, "is not a tick", ""),
    ("5", 1, 2, "no direction", "write > for host to robot"),
    ("5 55", 1, 3, "'55' is not a direction", "write >"),
    ("5 >  # 55", 1, 4, "no characters", "two hex digits"),
    ("5 > 5", 1, 5, "'5' is not a character", "two hex digits"),
    ("5 > 55 0x55", 1, 8, "'0x55' is not a character", ""),
    ("5 > 55 ٣٣", 1, 8, "is not a character", ""),
    ("9 > 55\n\n 8 > 55", 3, 2, "tick 8 goes backwards", "9 came before"),
    ("# mirotwin stream 2\n", 1, 19, "stream version '2'", "reads version 1"),
    ("# mirotwin stream\n", 1, 18, "stream version 'missing'", ""),
]


@pytest.mark.parametrize(("text", "line", "column", "reason", "remedy"), REFUSED)
def test_a_wrong_line_is_named_with_place_reason_and_remedy(text, line, column, reason, remedy):
    with pytest.raises(StreamError) as caught:
        stream.parse(text, "game.stream")
    error = caught.value
    assert (error.source, error.line, error.column) == ("game.stream", line, column)
    assert reason in error.reason
    assert remedy in error.remedy
    assert str(error).startswith(f"game.stream:{line}:{column}: ")


@settings(deadline=None)
@given(st.text())
def test_any_text_at_all_is_a_stream_or_a_stream_error(text):
    try:
        sent = stream.parse(text)
    except StreamError:
        return
    assert [(one.tick, one.data) for one in stream.parse(stream.format_stream(sent))] == [
        (one.tick, one.data) for one in sent
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        Transmission(-1, ">", b"a"),
        Transmission(1 << 63, ">", b"a"),
        Transmission(0, "?", b"a"),
        Transmission(0, ">", b""),
        Transmission(0, ">", b"a", "two\nlines"),
        Transmission(0, ">", b"a", " blank"),
    ],
)
def test_what_could_not_be_read_back_is_not_written(wrong):
    with pytest.raises(ValueError, match=r"must be|at least one"):
        stream.format_line(wrong)


def test_transmissions_out_of_order_are_not_written():
    with pytest.raises(ValueError, match="must not be before 9"):
        stream.format_stream([Transmission(9, ">", b"a"), Transmission(8, ">", b"a")])


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "game.stream"
    stream.write(path, [Transmission(1, ">", b"old")])
    with pytest.raises(ValueError, match="tick = -1"):
        stream.write(path, [Transmission(-1, ">", b"new")])
    assert stream.read(path) == [Transmission(1, ">", b"old")]
    stream.write(path, [Transmission(2, "<", b"new", "über")])
    assert stream.read(path) == [Transmission(2, "<", b"new", "über")]
    assert [entry.name for entry in tmp_path.iterdir()] == ["game.stream"]


def test_a_file_that_is_not_utf_8_is_named_by_place(tmp_path):
    path = tmp_path / "game.stream"
    path.write_bytes(b"1 > 55\n2 > 55 # \xff\n")
    with pytest.raises(StreamError, match=r":2:10: byte ffh is not UTF-8"):
        stream.read(path)


@pytest.mark.parametrize("before", ["", "1 ", "1 > ", "# mirotwin stream "])
def test_a_huge_token_is_shown_in_a_few_words(before):
    with pytest.raises(StreamError) as caught:
        stream.parse(before + "5" * 10**6)
    assert len(str(caught.value)) < 300
