"""`mirotwin replay` of what somebody else sent: what became of each frame, where the failsafe stopped the robots, and a
recording of it whose page judges nothing by a line that nobody followed.
"""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import TeamFrame, encode
from miro_protocol.stream import write
from miro_protocol.transmission import Transmission
from mirotwin.recording.reader import read
from mirotwin.replay.text import SHOWN, Line, _listed
from tests.mirotwin.report.page.test_run_page import Markup

FRAME_TICKS = 800_800


def team(seq, speed=4000):
    return encode(TeamFrame(0, seq, ((speed, speed), (0, 0), (-speed, -speed))), 3)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """30 places in time: a repeated frame, a damaged one, bytes of another device, and 167 ms without anything."""
    sent = {number: team(number) for number in range(30) if not 24 <= number < 29}
    sent[21] = sent[20]
    sent[22] = sent[22][:12] + bytes([sent[22][12] ^ 0x41]) + sent[22][13:]
    sent[23] = b"Hello, robot"
    path = tmp_path_factory.mktemp("capture") / "My capture.stream"
    write(path, [Transmission(96_000 + number * FRAME_TICKS, ">", data) for number, data in sent.items()])
    return path


@pytest.fixture(scope="module")
def listed(mirotwin, capture):
    """The lines that are printed."""
    return mirotwin.succeeds("replay", capture).splitlines()


def lines_with(lines, text):
    return [line for line in lines if text in line]


def test_what_was_not_fresh_is_in_the_list_however_late_it_came(listed):
    for word, count in (("stale", 1), ("damaged", 1), ("ignored", 1), ("fresh", SHOWN - 3)):
        assert len([line for line in listed if line.endswith(f"  {word}")]) == count, word
    assert lines_with(listed, "stale")[0].split()[0] == f"{96_000 + 21 * FRAME_TICKS}"
    assert "bad crc" in lines_with(listed, "damaged")[0]
    assert "no sync: 48 65 6c 6c 6f" in lines_with(listed, "ignored")[0]
    assert "5 more of 25 frames; --all lists them" in listed
    assert "from the host: 22 fresh, 1 stale, 1 damaged, 1 ignored" in listed


def test_all_frames_are_listed_if_that_is_asked_for(mirotwin, capture):
    lines = mirotwin.succeeds("replay", capture, "--all").splitlines()
    assert len([line for line in lines if line.endswith("  fresh")]) == 22
    assert not lines_with(lines, "more of")


def test_it_says_where_the_failsafe_stopped_the_robots(listed, mirotwin, capture, tmp_path, monkeypatch):
    stops = lines_with(listed, "failsafe: ")
    assert [line.split("robots ")[1].split(", after")[0] for line in stops] == [
        "0, 1, 2  failsafe: wheels told to stop, 110.0 ms after the last fresh frame",
        "0, 1, 2  failsafe: wheels told to stop, 110.0 ms after the last fresh frame",
        "0, 1, 2  failsafe: motors off, 500.0 ms after the last fresh frame",
    ]
    ticks = [int(line.split()[0]) for line in lines_with(listed, "  fresh") + stops]
    assert ticks[-3] > 96_000 + 20 * FRAME_TICKS
    monkeypatch.chdir(tmp_path)
    mirotwin("examples", "firmware")
    late = mirotwin("replay", capture, "--firmware", "late.ihx")[1]
    assert "wheels told to stop, 125.0 ms after the last fresh frame" in late


def test_a_frame_that_says_stand_still_is_no_failsafe(mirotwin, tmp_path):
    speeds = [4000] * 4 + [0] * 4
    sent = [Transmission(96_000 + n * FRAME_TICKS, ">", team(n, speed)) for n, speed in enumerate(speeds)]
    write(tmp_path / "stands.stream", sent)
    lines = mirotwin.succeeds("replay", tmp_path / "stands.stream").splitlines()
    assert [int(line.split()[0]) > sent[-1].end_tick for line in lines_with(lines, "failsafe: ")] == [
        True
    ] * 2


def test_robots_that_hear_otherwise_are_named(mirotwin, capture):
    noisy = ("--set", "network.radio.bit_error_rate=0.003", "--seed", 1, "--all")
    lines = mirotwin("replay", capture, *noisy)[1].splitlines()
    assert lines_with(lines, " at 0, ")
    assert lines_with(lines, "damaged at ")


def test_a_frame_that_ends_after_the_window_is_under_way(mirotwin, capture):
    lines = mirotwin.succeeds("replay", capture, "--to", "40ms").splitlines()
    assert [line.split()[-1] for line in lines_with(lines, "  >  ")] == ["fresh", "way"]
    assert "from the host: 1 fresh, 1 under way" in lines


@pytest.fixture(scope="module")
def recorded(mirotwin, capture, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out") / "rec"
    said = mirotwin.succeeds("replay", capture, "--out", folder, "-q")
    assert f"{folder / 'run.mcap'}: `mirotwin report {folder}` makes its page" in said
    return folder


def test_out_makes_a_recording_that_replays_bit_for_bit(mirotwin, recorded, capture):
    assert os.listdir(recorded) == ["run.mcap"]
    assert "equals the recorded one in all 60 control periods" in mirotwin.succeeds("replay", recorded, "-q")
    source = read(recorded / "run.mcap").source
    assert source.scenario_name == "my-capture"


@pytest.mark.parametrize("of", ["run", "stream file", "pcapng capture"])
def test_its_page_has_its_name_and_no_errors_against_a_line(mirotwin, recorded, capture, tmp_path, of):
    file = recorded if of == "run" else capture
    if of == "pcapng capture":
        file = tmp_path / "My capture.pcapng"
        mirotwin.succeeds("export", capture, "--out", file, "-q")
    assert mirotwin("report", file, "-o", tmp_path / "x.html", "-q")[0] == 0
    assert f'<p class="kind">{of}</p>' in (tmp_path / "x.html").read_text()
    page = Markup(tmp_path / "x.html")
    assert "my-capture" in page.text
    assert "What was sent, over an ideal link to robots that stand" in page.text
    for absent in ("Straight line", "Position error", "rms", "settling", "measured by the camera"):
        assert absent not in page.text
    lanes = page.data["lanes"]
    kinds = {
        (lanes[lane], page.data["kinds"][kind], text)
        for _, _, lane, kind, text in page.data["marks"]
        if "failsafe" in lanes[lane]
    }
    said = "motors off, 500.0 ms after the last fresh frame"
    assert kinds >= {(f"net0/robot{slot} failsafe", "off", said) for slot in range(3)}


def test_a_recording_replayed_on_other_firmware_is_recorded_with_it(
    mirotwin, recorded, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    mirotwin("examples", "firmware")
    mirotwin.ends(4, "replay", recorded, "--firmware", "late.ihx", "--out", "late", "-q")
    mirotwin.succeeds("replay", "late", "-q")
    source = read(tmp_path / "late/run.mcap").source
    assert source.firmware == (tmp_path / "late.ihx").read_bytes()


def test_a_folder_with_something_in_it_is_replaced_by_force_only(mirotwin, recorded, capture):
    before = (recorded / "run.mcap").read_bytes()
    said = mirotwin.refuses("replay", capture, "--out", recorded, "-q", "--to", "200ms")
    assert "the folder is not empty (run.mcap)" in said
    mirotwin.succeeds("replay", capture, "--out", recorded, "-q", "--to", "200ms", "--force")
    assert len((recorded / "run.mcap").read_bytes()) < len(before)
    mirotwin.succeeds("replay", capture, "--out", recorded, "-q", "--force")
    assert (recorded / "run.mcap").read_bytes() == before


def test_a_case_is_not_recorded(mirotwin, tmp_path):
    head = '# mirotwin stream 2\n#: verdict = "no_fault: x"\n#:\n#: [expect]\n#: no_fault = true\n1000 > 55\n'
    (tmp_path / "case.stream").write_text(head)
    said = mirotwin.refuses("replay", tmp_path / "case.stream", "--out", tmp_path / "x")
    assert "--out: is for a stream, a capture or a recording of a twin; leave it out" in said


@given(st.lists(st.booleans(), max_size=60))
def test_a_short_list_keeps_the_order_and_gives_room_to_what_is_special_first(special):
    frames = [Line(tick, ">", "host", "", "", one) for tick, one in enumerate(special)]
    shown = _listed(frames)
    assert len(shown) == min(SHOWN, len(frames))
    assert shown == sorted(shown)
    left_out = [line for line in frames if line not in shown]
    if any(line.special for line in left_out):
        assert all(line.special for line in shown)
