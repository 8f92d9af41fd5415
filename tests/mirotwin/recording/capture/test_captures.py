"""Captures of other tools: what each is taken for, the frames in it, and their times."""

import re
import shutil
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol import stream
from miro_protocol.frames import TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from miro_robot.firmware import image_path
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.forms import FORMS as KNOWN
from mirotwin.recording.capture.input import HEAD_BYTES, Input
from mirotwin.recording.capture.options import AS_IT_SAYS, CaptureOptions
from mirotwin.recording.capture.source import READ_ERRORS, open_capture
from tests.mirotwin.recording.capture.captured import (
    FORMS,
    FRAMES,
    SECOND,
    SESSION,
    SPACING,
    characters,
    edges,
    hexdump,
    lines,
)


@pytest.fixture
def capture(tmp_path):
    """A file of this form that holds the session."""

    def write(name, sent=SESSION):
        path = tmp_path / name
        path.write_bytes(FORMS[name].write(sent))
        return path

    return write


@pytest.mark.parametrize("name", FORMS)
def test_each_form_is_recognised_and_gives_its_frames_at_their_times(mirotwin, capture, name, tmp_path):
    form, path = FORMS[name], capture(name)
    assert detect(path.read_bytes()[:HEAD_BYTES]).form == form.detected
    code, out, err = mirotwin("decode", path)
    assert code == 0, err
    assert re.search(rf"{re.escape(str(path))}: read as .+, .+\n", err)
    assert f"frames: {len(FRAMES)} accepted, 0 stale, 0 telemetry; 0 damaged" in out
    options = [] if form.step_s else ["--assume-contiguous"]
    assert mirotwin("export", path, "--out", tmp_path / "made.stream", *options)[0] == 0
    made = stream.read(tmp_path / "made.stream").transmissions()
    assert b"".join(one.data for one in made) == b"".join(FRAMES)
    if form.step_s:
        assert [one.data for one in made] == FRAMES
        worst_s = max(abs(one.tick - sent.tick) for one, sent in zip(made, SESSION, strict=True)) / SECOND
        assert worst_s <= form.step_s


@pytest.mark.parametrize("name", [name for name, form in FORMS.items() if form.step_s is None])
def test_what_has_no_times_is_replayed_only_as_if_without_a_pause(mirotwin, capture, name):
    path = capture(name)
    assert "without times; --assume-contiguous takes all characters" in mirotwin.refuses("replay", path)
    assert mirotwin("replay", path, "--assume-contiguous", "-q")[0] == 0


def read(data, name="a.log", options=AS_IT_SAYS, form=None):
    """Transmissions in these bytes, and what is said."""
    said = []
    source = open_capture(Input.of(data, name), said.append, options, form)
    return list(source.sent), said


PAUSES = st.integers(200_000, 3_000_000)
"""Between transmissions: more than a receiver takes for following, at the coarsest step of times."""


@st.composite
def sessions(draw, both):
    """Transmissions in the order of time that do not overlap."""
    found, tick = [], draw(st.integers(0, SECOND))
    for data in draw(st.lists(st.binary(min_size=1, max_size=40), min_size=1, max_size=5)):
        found.append(Transmission(tick, draw(st.sampled_from("<>")) if both else ">", data))
        tick = found[-1].end_tick + draw(PAUSES)
    return found


@pytest.mark.parametrize("name", FORMS)
@settings(max_examples=10)
@given(data=st.data())
def test_what_is_written_in_any_form_is_read_back(name, data):
    form = FORMS[name]
    sent = data.draw(sessions(form.both))
    options = CaptureOptions(direction="down", baud=9600)
    made, _ = read(form.write(sent), name, options, KNOWN[form.detected])
    if form.step_s is None:
        assert b"".join(one.data for one in made) == b"".join(one.data for one in sent)
        return
    assert [(one.direction, one.data) for one in made] == [(one.direction, one.data) for one in sent]
    first_s = sent[0].tick / SECOND
    for one, was in zip(made, sent, strict=True):
        moved_s = (one.tick - was.tick) / SECOND
        assert abs(moved_s - round(moved_s)) <= form.step_s + 1e-7, first_s


@pytest.mark.parametrize("name", FORMS)
@settings(max_examples=15)
@given(data=st.data())
def test_a_damaged_capture_gives_transmissions_and_at_most_one_error(name, data):
    whole = FORMS[name].write(SESSION[:3])
    place, size = data.draw(st.integers(0, len(whole))), data.draw(st.integers(0, 200))
    damaged = whole[:place] + data.draw(st.binary(max_size=20)) + whole[place + size :]
    form = data.draw(st.sampled_from([None, KNOWN[FORMS[name].detected]]))
    try:
        found, said = read(damaged, name, form=form)
    except READ_ERRORS:
        return
    assert all(one.direction in (">", "<") and one.data for one in found)
    assert all(line.isprintable() for line in said)


def test_a_word_of_a_damaged_capture_is_quoted_with_its_control_characters_escaped():
    whole = FORMS["sigrok.csv"].write(SESSION[:3])
    _, said = read(whole[:83] + b"\0" + whole[83:])
    assert any(r"\x00" in line for line in said)
    assert all(line.isprintable() for line in said)


@given(st.one_of(st.binary(max_size=300), st.text(max_size=300).map(str.encode)), st.sampled_from([*KNOWN]))
def test_any_bytes_read_as_any_form_give_transmissions_or_an_error(data, name):
    try:
        found, _ = read(data, form=KNOWN[name])
    except READ_ERRORS:
        return
    assert all(one.direction in (">", "<") for one in found)


def table(spacing, seconds="{:.6f}"):
    """A table of the session with a character a row, so many ticks apart."""
    rows = ((one.tick + index * spacing, byte) for one in SESSION for index, byte in enumerate(one.data))
    return lines(
        ["Time [s],Value", *(f"{seconds.format(tick / SECOND)},0x{byte:02X}" for tick, byte in rows)]
    )


@pytest.mark.parametrize(("spacing", "baud"), [(2_083, 115_200), (12_500, 19_200), (50_000, 4_800)])
def test_a_sender_at_another_baud_rate_is_fitted_and_told(spacing, baud):
    made, said = read(table(spacing))
    assert [one.data for one in made] == FRAMES
    assert f"a sender at {baud} baud, the robots' line has 9600" in said[-1]


def test_edges_of_another_baud_rate_and_an_inverted_line_are_read():
    for name, found in (("19200 baud", edges(SESSION, 1250, 12_500)), ("inverted", edges(SESSION))):
        rows = (f"{tick / SECOND:.9f},{level ^ (name == 'inverted')}" for tick, level in found)
        made, said = read(lines(["Time [s],Channel 0", *rows]))
        assert [one.data for one in made] == FRAMES
        assert any(name in line for line in said)


@pytest.mark.parametrize(("seconds", "error_s"), [("{:.3f}", 1e-3), ("{:.2f}", 1e-2)])
def test_coarse_times_are_no_overlap(seconds, error_s):
    made, said = read(table(SPACING, seconds))
    assert b"".join(one.data for one in made) == b"".join(FRAMES)
    assert all(after.tick >= one.end_tick for one, after in pairwise(made))
    assert made[0].tick / SECOND == pytest.approx(SESSION[0].tick / SECOND, abs=error_s)
    assert len(said) == 1


def test_characters_that_come_apart_stay_apart():
    made, _ = read(lines(f"{tick / SECOND:.6f} > 55" for tick in (0, 24_960, 75_000, 99_960)))
    assert [(one.tick, one.data) for one in made] == [(0, b"\x55\x55"), (75_000, b"\x55\x55")]


def test_what_was_captured_at_the_robot_is_turned_round():
    made, said = read(lines(f"{one.tick / SECOND:.6f} RX {one.data.hex(' ')}" for one in SESSION))
    assert {one.direction for one in made} == {">"}
    assert "was captured at the robot" in said[-1]


ANSWER = encode(TelemetryFrame(3, 1), 3)


@pytest.mark.parametrize("name", ["stamped2.txt", "user0.pcap", "line.vcd"])
def test_a_wire_of_answers_is_found_to_come_from_robots(name):
    sent = [Transmission(one.tick, "<", ANSWER) for one in SESSION[:5]]
    made, _ = read(FORMS[name].write(sent), name)
    assert [(one.direction, one.data) for one in made] == [("<", ANSWER)] * 5


def test_two_channels_are_one_network():
    answers = [Transmission(one.tick, "<", ANSWER[:5]) for one in SESSION]
    rows = [(time_s, "TX", byte) for time_s, byte, _ in characters(SESSION)]
    rows += [(time_s + 0.026, "RX", byte) for time_s, byte, _ in characters(answers)]
    head = "name,type,start_time,duration,data,error"
    texts = [f'"{name}","data",{time_s:.9f},0.001,0x{byte:02X},' for time_s, name, byte in sorted(rows)]
    made, _ = read(lines([head, *texts]))
    assert {(one.direction, one.network) for one in made} == {(">", 0), ("<", 0)}
    only, _ = read(lines([head, *texts]), options=CaptureOptions(wires=("TX",)))
    assert [one.data for one in only] == FRAMES


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-8-sig", "gb18030", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", ["stamped.txt", "saleae1.csv", "saleae_digital.csv"])
def test_text_of_other_systems_is_read(name, encoding, end):
    text = FORMS[name].write(SESSION).decode()
    if encoding in ("gb18030", "cp1252"):
        text = text.replace("Time [s]", "时间 [s]" if encoding == "gb18030" else "Time [s]").replace(
            " > ", " \xbb "
        )
        text = text.replace("\xbb", "发" if encoding == "gb18030" else "\xbb")
    made, _ = read(text.replace("\n", end).encode(encoding), name)
    assert [one.data for one in made] == FRAMES


def test_lines_that_are_none_are_counted_and_do_not_end_a_file():
    texts = FORMS["stamped.txt"].write(SESSION).decode().splitlines()
    made, said = read(lines([*texts[:3], "port closed", "port opened again", *texts[3:]]))
    assert [one.data for one in made] == FRAMES
    assert said[-1] == "a.log: passed over 2 lines without characters, the first at line 4"


def test_a_day_and_more_names_the_remedy(mirotwin, tmp_path):
    (tmp_path / "a.log").write_bytes(lines(["1.0 > 55 55", "99999.0 > 55 55"]))
    err = mirotwin.refuses("replay", tmp_path / "a.log")
    assert "more than a day; cut the capture" in err


def test_midnight_is_passed_in_times_of_day():
    made, _ = read(lines(["[23:59:59.900] TX 55", "[00:00:00.100] TX 66"]))
    assert made[1].tick - made[0].tick == SECOND // 5


def test_the_offset_stands_in_the_stream_file(mirotwin, capture, tmp_path):
    mirotwin("export", capture("candump.log"), "--out", tmp_path / "made.stream")
    second = (tmp_path / "made.stream").read_text().splitlines()[1]
    assert second == "# from time-stamped hex lines: times are moved by -1732800000 s, to begin near 0"


def test_repeated_rows_of_a_dump_are_given_again():
    row = hexdump(0, b"\x55" * 16)
    made, _ = read(lines([row, "*", "00000040  66", "00000041"]))
    assert b"".join(one.data for one in made) == b"\x55" * 64 + b"\x66"


@pytest.mark.parametrize("form", [None, "raw", "stamped"])
def test_the_form_can_be_forced(mirotwin, capture, form):
    words = ["--from-form", form] if form else []
    code, out, err = mirotwin("decode", capture("stamped.txt"), *words)
    assert code == 0
    assert ("read as" in err) == (form is None)
    assert out.splitlines()[0].endswith(
        ("raw bytes, network 0 of 3 robots", "hex lines, network 0 of 3 robots")
    )


@pytest.mark.parametrize(
    "words",
    [
        ["replay"],
        ["replay", "--firmware", "mine.ihx"],
        pytest.param(["report", "--out", "page.html"], marks=pytest.mark.slow),
    ],
)
def test_all_commands_read_captures(mirotwin, capture, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(image_path(), tmp_path / "mine.ihx")
    code, _, err = mirotwin(words[0], capture("candump.log"), *words[1:], "-q")
    assert code == 0, err
    assert "times are moved by -1732800000 s" in err


def test_two_images_are_compared_under_the_bytes_of_a_capture(mirotwin, capture, tmp_path):
    shutil.copy(image_path(), tmp_path / "mine.ihx")
    words = ("diff", tmp_path / "mine.ihx", tmp_path / "mine.ihx", "--on", capture("saleae2.csv"), "-q")
    assert mirotwin(*words)[0] == 0


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"PK\x03\x04meta.json", "is a Logic 2 session; export its data as CSV"),
        (b"PK\x03\x04metadata", "is a damaged zip file"),
        (b"\x1f\x8b\x08", "is packed by gzip; unpack it first"),
        (b"$timescale 1 ns $end $enddefinitions $end #0", "has no channel; export a channel"),
        (b"<SALEAE>" + bytes(4) + b"\x01" + bytes(7), "holds an analog channel"),
        (b"Time [s],Channel 0\n0.0,1\n0.1,0\n", "no channel carries characters (Channel 0); name the rate"),
        (b"name,price\nx,2\n", "is text in no form that is known"),
    ],
)
def test_what_is_no_capture_of_characters_is_named_with_its_remedy(data, reason):
    with pytest.raises(BadInput) as failure:
        read(data)
    assert reason in f"{failure.value}"


@pytest.mark.parametrize("name", ["saleae1.csv", "saleae2.csv", "saleae_digital.csv"])
def test_times_before_a_trigger_are_negative_and_lose_nothing(mirotwin, capture, name):
    path = capture(name)
    times = re.compile(r"(?m)^((?:\"[^\"]*\",)*)([0-9]\.[0-9]{9})")
    path.write_text(times.sub(lambda row: f"{row[1]}{float(row[2]) - 0.3:.9f}", path.read_text()))
    code, out, err = mirotwin("decode", path)
    assert code == 0
    assert f"{path}: times are moved by 1 s, to begin near 0" in err
    assert "passed over" not in err
    assert f"frames: {len(FRAMES)} accepted, 0 stale, 0 telemetry; 0 damaged" in out


@pytest.mark.parametrize(("offset", "base"), [("07o", 8), ("07d", 10), ("08x", 16)])
def test_a_star_in_a_dump_repeats_the_line_before_to_the_next_offset(mirotwin, tmp_path, offset, base):
    row = " ".join(["55"] * 16)
    path = tmp_path / "dump.txt"
    path.write_text(
        f"{0:{offset}} {row}\n*\n{96:{offset}} {row}\n{112:{offset}} {row}\n{128:{offset}} 2a\n{129:{offset}}\n"
    )
    _, out, err = mirotwin("decode", path)
    assert f"its offsets, to base {base}, agree" in err
    assert "1 damaged run of 129 bytes" in out


def test_characters_that_are_missing_in_a_dump_are_counted(mirotwin, capture):
    path = capture("xxd.txt")
    rows = path.read_text().splitlines(keepends=True)
    path.write_text("".join(rows[:2] + rows[5:8] + rows[9:]))
    err = mirotwin("decode", path)[2]
    assert f"{path}: by the offsets 64 characters missing, first before line 3; copy the whole dump" in err


def test_a_signal_without_characters_is_named(mirotwin, tmp_path):
    path = tmp_path / "still.csv"
    path.write_text("Time [s],Channel 7\n0.0,1\n")
    code, _, err = mirotwin("decode", path)
    assert code == 2
    assert (
        "no channel carries characters (Channel 7); name the rate and the channel, --baud RATE --wire NAME"
        in err
    )
