"""Stream files: what is written is read back, and what cannot be read is named by line, column and remedy."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol import stream, stream_header, stream_line
from miro_protocol.actions import Fault, PinLevel, Power, Put, RadioState, Reseed, Reset
from miro_protocol.stream import Entry, StreamError
from miro_protocol.transmission import DIRECTIONS, Transmission

comments = st.text(st.characters(blacklist_categories=("Cc", "Cs", "Zl", "Zp")), max_size=20).map(str.strip)
ticks = st.integers(0, stream.MAX_TICK)
networks = st.integers(0, stream_line.MAX_NETWORK)
plain = st.builds(Transmission, ticks, st.sampled_from(DIRECTIONS), st.binary(min_size=1, max_size=40))


@st.composite
def flawed(draw):
    """A transmission of any network with any bad stop bits."""
    sent = draw(plain)
    bad_stop = draw(st.sets(st.integers(0, len(sent.data) - 1), max_size=5))
    return Transmission(sent.tick, sent.direction, sent.data, draw(networks), tuple(sorted(bad_stop)))


slots, levels = st.integers(0, stream_line.MAX_SLOT), st.integers(0, 1)
put_values = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.integers(-(1 << 62), 1 << 62),
    st.booleans(),
    st.text(max_size=50),
)
events = st.one_of(
    st.builds(Reset, ticks, networks, slots, levels),
    st.builds(Power, ticks, networks, slots, levels),
    st.builds(RadioState, ticks, networks, st.sampled_from(stream_line.RADIO_STATES)),
    st.builds(PinLevel, ticks, st.from_regex(r"\AP[0-3]\.[0-7]\Z"), levels),
    st.builds(
        Put, ticks, networks, slots, st.from_regex(r"\A[a-z]{1,5}(\.[a-z0-9_]{1,9}){1,3}\Z"), put_values
    ),
)


def in_order(what):
    entries = st.lists(st.builds(Entry, what, comments))
    return entries.map(lambda some: tuple(sorted(some, key=lambda one: one.what.tick)))


HEADERS = [
    "",
    "seed = 7",
    'scenario = "fig6"\n\nseed = 9223372036854775807 # the last one\n',
    '  version = "0.1"\nfirmware_sha256 = "' + "0f" * 32 + '"',
    '[scenario]\nname = "mine"\n[set]\n"a.b" = 3\n[expect]\nno_fault = true',
    'version = """\n two\nlines"""',
]
headers = st.sampled_from(HEADERS).map(stream_header.of_text)


@given(in_order(plain))
def test_what_version_1_has_words_for_is_written_in_it_and_read_back(entries):
    text = stream.format_stream(entries)
    assert text.startswith("# mirotwin stream 1\n")
    assert stream.parse(text).entries == entries


@pytest.mark.slow
@settings(max_examples=200)
@given(in_order(st.one_of(plain, flawed(), events)), headers)
def test_what_is_written_is_read_back(entries, header):
    text = stream.format_stream(entries, header)
    found = stream.parse(text)
    assert (found.entries, found.header) == (entries, header)
    assert stream.format_stream(found.entries, found.header) == text


@pytest.mark.parametrize(
    "new",
    [
        Transmission(5, ">", b"a", 1),
        Transmission(5, ">", b"a", 0, (0,)),
        Reset(5, 0, 0, 1),
        RadioState(5, 0, "up"),
        PinLevel(5, "P1.0", 1),
    ],
)
def test_what_is_new_makes_a_file_of_version_2(new):
    assert stream.format_stream([new]).startswith("# mirotwin stream 2\n")


def test_a_put_or_the_header_of_a_board_makes_a_file_of_version_3():
    assert stream.format_stream([Put(5, 0, 0, "eyes.distance_cm", 60)]).startswith("# mirotwin stream 3\n")
    header = stream_header.of_text('board = "car.board.toml"\ncrystal_hz = 11059200')
    assert stream.format_stream([], header).startswith("# mirotwin stream 3\n")


@pytest.mark.parametrize(
    "what", ["flip FFh.7", "encoder right b1", "lm629 left busy", "power dip", "rxd 0", "rxd inverted"]
)
def test_a_hardware_fault_makes_a_file_of_version_3_and_is_read_back(what):
    text = stream.format_stream([Fault(5, 1, 2, what)])
    assert text == f"# mirotwin stream 3\n5 *@1/2 {what}\n"
    assert [entry.what for entry in stream.parse(text).entries] == [Fault(5, 1, 2, what)]


def test_lines_look_as_the_protocol_page_shows_them():
    line = stream.format_line(Transmission(792000, ">", b"\x55\xff\x2d\xd4"), "team seq=3")
    assert line == "792000 > 55 ff 2d d4  # team seq=3"
    assert stream.format_line(Transmission(792000, "<", b"\x55\xff", 1, (0,))) == "792000 <@1 55! ff"
    assert stream.format_line(Reset(5, 0, 2, 1)) == "5 *@0/2 reset 1"
    assert stream.format_line(Power(5, 0, 2, 0)) == "5 *@0/2 power 0"
    assert stream.format_line(RadioState(5, 1, "noise")) == "5 *@1 radio noise"
    assert stream.format_line(Reseed(5, 1, 10042)) == "5 *@1 reseed 10042"
    assert stream.format_line(PinLevel(5, "P3.2", 0)) == "5 * P3.2 0"
    assert stream.format_line(Put(5, 0, 0, "eyes.distance_cm", 60)) == "5 * eyes.distance_cm = 60"
    assert stream.format_line(Put(5, 1, 2, "eyes.echo", "no #")) == '5 *@1/2 eyes.echo = "no \\u0023"'


def test_blank_lines_comments_capitals_and_windows_line_ends_are_read():
    text = "# anything\r\n\r\n  10 < AB cd\r\n   # more\r\n10 > 00 # note"
    found = stream.parse(text).entries
    assert found == (Entry(Transmission(10, "<", b"\xab\xcd")), Entry(Transmission(10, ">", b"\0"), "note"))
    assert [entry.line for entry in found] == [3, 5]


def test_header_lines_are_comments_in_version_1():
    assert stream.parse("# mirotwin stream 1\n#: nothing = that is TOML\n5 > 55").header == stream.Header()


def test_comments_may_stand_between_the_lines_of_a_header():
    found = stream.parse("# mirotwin stream 2\n#: seed = 3\n# why\n\n#:scenario = 'fig8'\n5 > 55")
    assert (found.header.seed, found.header.scenario) == (3, "fig8")


def test_a_tick_may_be_a_time_with_its_unit():
    found = stream.parse("4ms > 55\n.5s > 56\n12000001t > 57\n12000001 < 58\n").entries
    assert [entry.what.tick for entry in found] == [96_000, 12_000_000, 12_000_001, 12_000_001]
    assert stream.format_stream(found).startswith("# mirotwin stream 1\n96000 > 55\n")


@pytest.mark.parametrize("header", ["crystal_hz = 11059200", "[bare]\n#: crystal_hz = 11059200"])
def test_a_time_counts_the_ticks_of_the_crystal_that_the_header_names(header):
    found = stream.parse(f"# mirotwin stream 3\n#: {header}\n1.5ms > 55\n").entries
    assert [entry.what.tick for entry in found] == [16_588], "rounded down"


V2 = "# mirotwin stream 2\n"
V3 = "# mirotwin stream 3\n"
REFUSED = [
    ("x > 55", 1, 1, "'x' is not a tick", "0..2305843009213693951"),
    ("-1 > 55", 1, 1, "'-1' is not a tick", ""),
    ("9223372036854775808 > 55", 1, 1, "is not a tick", ""),
    ("4m > 55", 1, 1, "'4m' is not a tick", "or with a time such as 4ms or 1.5s"),
    ("4.5 > 55", 1, 1, "'4.5' is not a tick", ""),
    ("1s > 55\n999ms > 55", 2, 1, "tick 23976000 goes backwards", "the line before has 24000000"),
    ("999999999h > 55", 1, 1, "is not a tick", ""),
    ("5", 1, 2, "no direction", "write > for host to robot"),
    ("5 55", 1, 3, "'55' is not a direction", "write >"),
    ("5 >  # 55", 1, 4, "no characters", "two hex digits"),
    ("5 > 5", 1, 5, "'5' is not a character", "two hex digits"),
    ("5 > 55 0x55", 1, 8, "'0x55' is not a character", ""),
    ("5 > 55 ٣٣", 1, 8, "is not a character", ""),
    ("9 > 55\n\n 8 > 55", 3, 2, "tick 8 goes backwards", "the line before has 9"),
    ("# mirotwin stream 4\n", 1, 19, "stream version '4'", "reads versions 1 to 3"),
    ("# mirotwin stream\n", 1, 18, "stream version 'missing'", ""),
    ("5 > 55 aa!", 1, 8, "'aa!' is not known in stream version 1", "`# mirotwin stream 2`"),
    ("5 >@1 55", 1, 3, "'>@1' is not known in stream version 1", ""),
    ("5 * P1.0 1", 1, 3, "'*' is not known in stream version 1", ""),
    (V2 + "5 > 55!!", 2, 5, "'55!!' is not a character", ""),
    (V2 + "5 >@65536 55", 2, 3, "network 65536", "networks 0..65535"),
    (V2 + "5 >@0/1 55", 2, 3, "'>@0/1' is not a direction", ""),
    (V2 + "5 *@0/5 reset 1", 2, 3, "slot 5", "slots 0..4"),
    (V2 + "5 *@0 reset 1", 2, 3, "'*@0 reset 1' is not an action", "*@N/SLOT reset 0|1"),
    (V2 + "5 *@0/1 reset 2", 2, 3, "is not an action", ""),
    (V2 + "5 *@0/1 radio up", 2, 3, "is not an action", ""),
    (V2 + "5 *@0 radio off", 2, 3, "is not an action", ""),
    (V2 + "5 *@0 P1.0 1", 2, 3, "is not an action", ""),
    (V2 + "5 * P1.8 1", 2, 3, "is not an action", ""),
    (V2 + "5 * P1.0 1 1", 2, 13, "not an action", ""),
    (V2 + "5 *  # P1.0", 2, 4, "not an action", ""),
    (V2 + "5 *@0 reseed 1", 2, 7, "'reseed' is not known in stream version 2", "`# mirotwin stream 3`"),
    (
        V3 + "5 *@0 reseed 9223372036854775808",
        2,
        14,
        "seed 9223372036854775808",
        "seeds 0..9223372036854775807",
    ),
    (V3 + "5 *@0/1 reseed 1", 2, 3, "is not an action", "`*@N reseed SEED`"),
    (V3 + "5 *@0 reseed -1", 2, 3, "is not an action", ""),
    (V2 + "5 * eyes.distance_cm = 60", 2, 5, "is not known in stream version 2", "`# mirotwin stream 3`"),
    (V3 + "5 * eyes = 60", 2, 5, "'eyes = 60' is not PART.KEY = VALUE", "eyes.distance_cm = 60"),
    (V3 + "5 * eyes.echo = none", 2, 5, "'none' is no number, text or boolean", 'eyes.echo = "none"'),
    (V3 + "5 * eyes.echo = [1]", 2, 5, "'[1]' is no number", ""),
    (V3 + "5 * eyes.distance_cm = nan", 2, 5, "nan cannot be put", "a finite number"),
    (V3 + "5 * eyes.distance_cm = 9" + "9" * 30, 2, 5, "an integer of 103 bits", "63 at most"),
    (V3 + "5 * eyes.echo = 'a#b'", 2, 5, "is no number, text", ""),
    (V2 + "5 *@0/1 encoder left lost", 2, 9, "is not known in stream version 2", "`# mirotwin stream 3`"),
    (V3 + "5 *@0/1 encoder left", 2, 9, "'encoder left' is no hardware fault", "encoder left|right lost|a0"),
    (V3 + "5 *@0/1 flip 2Ah.8", 2, 9, "'flip 2Ah.8' is no hardware fault", "ADDR.BIT as 2Ah.3"),
    (V3 + "5 *@0/1 power dip now", 2, 9, "is no hardware fault", ""),
    (V3 + "5 *@0/1 power dop", 2, 3, "is not an action", ""),
    (V3 + "5 *@0 rxd 1", 2, 3, "a fault of no robot", "*@N/SLOT"),
    (V3 + "#: board = 5", 2, 4, "board: Expected", "the path of a board file"),
    (V3 + "#: crystal_hz = 0", 2, 4, "crystal_hz: Expected", "hertz"),
    (V2 + "9 > 55\n8 * P1.0 0", 3, 1, "tick 8 goes backwards", ""),
    (V2 + "5 > 55\n#: seed = 1", 3, 1, "a line of the header after the first tick", "above all ticks"),
    (
        V2 + "#: seed = 1\n#: sead = 2\n",
        3,
        4,
        "unknown key 'sead'",
        "did you mean seed? a header has scenario",
    ),
    (V2 + "\n#:seed = -1\n5 > 55", 3, 3, "seed: Expected `int` >= 0", "0..9223372036854775807"),
    (V2 + "#: seed = 9223372036854775808", 2, 4, "seed: Expected `int` <= 9223372036854775807", ""),
    (V2 + "#: [expect]\n#: a = nan\n#: [seed]\n", 4, 5, "seed: Expected `int | null`", ""),
    (V2 + "#: firmware_sha256 = 'AB'", 2, 4, "firmware_sha256: Expected `str` matching", "64 hex digits"),
    (V2 + "#: seed = 1\n#: seed = = 2", 3, 11, "not TOML: ", "one TOML document"),
    (V2 + "#: a = '", 2, 4, "not TOML: ", ""),
    (V2 + "#: [set\n", 2, 4, "not TOML: ", ""),
    (V2 + "#: a" + ".a" * 20 + " = 1", 2, 4, "a key of more than 16 parts", ""),
    (V2 + "#: a = " + "[" * 5000, 2, 4, "nested too deeply", ""),
    (V2 + "#: seed = " + "9" * 5000, 2, 4, "an integer of thousands of digits", ""),
    (V2 + "#: # " + "x" * (513 << 10), 2, 4, "the header: holds more than 512 KiB", "right file?"),
]


@pytest.mark.parametrize(("text", "line", "column", "reason", "remedy"), REFUSED, ids=range(len(REFUSED)))
def test_a_wrong_line_is_named_with_place_reason_and_remedy(text, line, column, reason, remedy):
    with pytest.raises(StreamError) as caught:
        stream.parse(text, "game.stream")
    error = caught.value
    assert (error.path, error.place) == ("game.stream", (line, column))
    assert reason in error.what
    assert remedy in error.remedy
    assert str(error).startswith(f"game.stream:{line}:{column}: ")
    assert len(str(error)) < 300


PIECES = ["5 ", "7 ", "> ", "<@1 ", "*@0/1 ", "* ", "55 ", "aa! ", "reset ", "radio ", "up ", "P1.0 ", "1 "]
PIECES += ["*@0 ", "reseed "]
PIECES += ["\n", "#: ", "# ", "seed = 1\n", "[set]\n", "scenario = ", "'fig6'", "@", "\r\n", "!", "\x85"]
PIECES += ["flip 2ah.3 ", "encoder ", "left ", "rxd 0 ", "power dip "]
PIECES += ["9" * 30, "eyes.d ", "= ", "6.5", '"a"', "true"]
texts = st.one_of(st.text(), st.lists(st.sampled_from(PIECES), max_size=30).map("".join))


@settings(max_examples=300)
@given(st.sampled_from(["", "# mirotwin stream 1\n", V2, V3]), texts)
def test_any_text_at_all_is_a_stream_or_a_stream_error(head, text):
    try:
        found = stream.parse(head + text)
    except StreamError:
        return
    again = stream.parse(stream.format_stream([entry.what for entry in found.entries], found.header))
    assert [entry.what for entry in again.entries] == [entry.what for entry in found.entries]
    assert again.header == found.header


@pytest.mark.parametrize("comment", ["one\rtwo", "one\x0btwo", "one\x1etwo", "one\x85two", "one\u2028two"])
def test_a_comment_that_was_read_can_be_written_whatever_editors_take_for_the_end_of_a_line(comment):
    found = stream.parse(f"1 > 55 # {comment}")
    assert found.entries[0].comment == comment
    assert stream.parse(stream.format_stream(found.entries)) == found


@pytest.mark.parametrize(
    ("wrong", "comment"),
    [
        (Transmission(-1, ">", b"a"), ""),
        (Transmission(1 << 63, ">", b"a"), ""),
        (Transmission(0, "?", b"a"), ""),
        (Transmission(0, ">", b""), ""),
        (Transmission(0, ">", b"a", -1), ""),
        (Transmission(0, ">", b"a", 0, (1,)), ""),
        (Transmission(0, ">", b"ab", 0, (1, 0)), ""),
        (Reset(0, 0, 5, 1), ""),
        (Reset(0, 0, 0, 2), ""),
        (Power(0, 0, 5, 1), ""),
        (Power(0, 0, 0, 2), ""),
        (RadioState(0, 0, "off"), ""),
        (Reseed(0, 0, 1 << 63), ""),
        (PinLevel(0, "P4.0", 1), ""),
        (Fault(0, 0, 5, "rxd 0"), ""),
        (Fault(0, 0, 0, "rxd 2"), ""),
        (Put(0, 0, 0, "eyes", 1), ""),
        (Put(0, 0, 5, "eyes.d", 1), ""),
        (Put(0, 0, 0, "eyes.d", 1e400), ""),
        (Put(0, 0, 0, "eyes.d", "\ud800"), ""),
        (Transmission(0, ">", b"a"), "two\nlines"),
        (Transmission(0, ">", b"a"), " blank"),
    ],
)
def test_what_could_not_be_read_back_is_not_written(wrong, comment):
    with pytest.raises(
        ValueError, match=r"must be|is no hardware fault|at least one|cannot be put|half a character"
    ):
        stream.format_line(wrong, comment)


def test_a_header_with_a_carriage_return_is_not_written():
    header = stream_header.of_text('version = "a"\r\nseed = 1')
    with pytest.raises(ValueError, match="carriage return"):
        stream.format_stream([], header)


def test_transmissions_out_of_order_are_not_written():
    with pytest.raises(ValueError, match="must not be before 9"):
        stream.format_stream([Transmission(9, ">", b"a"), Transmission(8, ">", b"a")])


@pytest.mark.parametrize(
    ("event", "who"),
    [
        ("*@0/1 reset 1", "`mirotwin replay`"),
        ("*@0/1 power 0", "`mirotwin replay`"),
        ("*@0 radio down", "`mirotwin replay`"),
        ("*@0 reseed 1", "`mirotwin replay`"),
        ("* P1.0 0", "`mirotwin fw run --pins FILE`"),
    ],
)
def test_who_cannot_act_on_an_event_refuses_it_and_says_who_can(event, who):
    found = stream.parse(f"{V3}1 > 55\n5 {event}\n", "a.stream")
    with pytest.raises(
        StreamError, match=r"a\.stream:3:1: an action, which this command does not support; "
    ) as caught:
        found.transmissions()
    assert who in caught.value.remedy


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "game.stream"
    stream.write(path, [Transmission(1, ">", b"old")])
    with pytest.raises(ValueError, match="tick = -1"):
        stream.write(path, [Transmission(-1, ">", b"new")])
    assert stream.read(path).transmissions() == [Transmission(1, ">", b"old")]
    stream.write(path, [Entry(Transmission(2, "<", b"new"), "über")])
    assert stream.read(path).entries == (Entry(Transmission(2, "<", b"new"), "über"),)
    assert [entry.name for entry in tmp_path.iterdir()] == ["game.stream"]


def test_a_file_that_is_not_utf_8_is_named_by_place(tmp_path):
    path = tmp_path / "game.stream"
    path.write_bytes(b"1 > 55\n2 > 55 # \xff\n")
    with pytest.raises(StreamError, match=r":2:10: byte ffh is not UTF-8"):
        stream.read(path)


@pytest.mark.parametrize("before", ["", "1 ", "1 > ", "# mirotwin stream ", V2 + "1 *@0 ", V2 + "1 >@"])
def test_a_huge_token_is_shown_in_a_few_words(before):
    with pytest.raises(StreamError) as caught:
        stream.parse(before + "5" * 10**6)
    assert len(str(caught.value)) < 300
