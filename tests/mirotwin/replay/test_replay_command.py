"""`mirotwin replay`: the same bytes give the same robot, and where they do not it says so."""

import msgspec
import pytest

from miro_protocol.frames import TeamFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.stream import write
from miro_protocol.transmission import Transmission
from mirotwin.recording import reader as recording_reader
from mirotwin.recording.recorder import Recorder, RunSource
from tests.mirotwin.conftest import hex_file

IDLE_FOR_EVER = b"\x80\xfe"


def rewritten(path, target, change):
    """A recording with something else in its periods."""
    recording = recording_reader.read(path)
    with target.open("wb") as stream, Recorder(stream, recording.source) as recorder:
        for period in recording.periods:
            recorder.write(change(period))
    return target


def test_a_recording_replays_to_the_same_response(mirotwin, finished):
    code, out, err = mirotwin("replay", finished / "run.mcap")
    assert (code, err) == (0, "")
    assert "team_ask seq=0" in out
    assert "telemetry seq=0 slot=0" in out
    assert "t [s]" in out
    assert "equals the recorded one in all 6 control periods" in out


@pytest.mark.parametrize("name", ["run.mcap", "run.part.mcap"])
def test_the_folder_of_a_run_stands_for_its_recording(mirotwin, finished, tmp_path, name):
    (tmp_path / name).write_bytes((finished / "run.mcap").read_bytes())
    code, out, err = mirotwin("replay", tmp_path)
    assert (code, err) == (0, "")
    assert "equals the recorded one in all 6 control periods" in out


def test_it_needs_no_other_file_than_the_recording(mirotwin, finished, tmp_path):
    alone = tmp_path / "alone.mcap"
    alone.write_bytes((finished / "run.mcap").read_bytes())
    assert mirotwin("replay", alone, "-q")[0] == 0


def test_the_list_of_frames_is_cut_unless_all_are_asked_for(mirotwin, tmp_path):
    path = tmp_path / "stream.txt"
    frames = [encode(TeamFrame(0, seq, ((100, 100), (0, 0), (0, 0))), 3) for seq in range(25)]
    write(path, [Transmission(index * 800_800, ">", data) for index, data in enumerate(frames)])
    out = mirotwin("replay", path)[1]
    assert "5 more of 25 frames; --all lists them" in out
    assert out.count("team seq=") == 20
    assert mirotwin("replay", path, "--all")[1].count("team seq=") == 25


def test_a_stream_drives_robots_over_an_ideal_link(mirotwin, tmp_path):
    path = tmp_path / "stream.txt"
    frames = [encode(TeamFrame(0, seq, ((500, 500), (0, 0), (-500, -500))), 3) for seq in range(10)]
    write(path, [Transmission(index * 800_800, ">", data) for index, data in enumerate(frames)])
    code, out, err = mirotwin("replay", path)
    assert (code, err) == (0, "")
    rows = [line.split() for line in out.splitlines()[-3:]]
    assert [row[:4] for row in rows] == [[str(slot), "10", "0", "0"] for slot in range(3)]
    assert int(rows[0][5]) > 500
    assert int(rows[1][5]) == 0
    assert int(rows[2][5]) < -500


def test_a_changed_recording_is_a_divergence_with_its_first_place(mirotwin, finished, tmp_path):
    def change(period):
        if period.index < 3:
            return period
        robot = period.robots[1]
        left = msgspec.structs.replace(robot.left, real_position=robot.left.real_position + 1)
        return msgspec.structs.replace(
            period, robots=(period.robots[0], msgspec.structs.replace(robot, left=left))
        )

    path = rewritten(finished / "run.mcap", tmp_path / "changed.mcap", change)
    code, _, err = mirotwin("replay", path, "-q")
    assert code == 4
    assert "the replay differs in control period 3, tick 2402400 (0.100100 s), /net0/robot2/lm629 left" in err


def test_other_firmware_is_shown_where_it_answers_otherwise(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    code, _, err = mirotwin("replay", finished / "run.mcap", "--firmware", image, "-q")
    assert code == 4
    assert "the replay differs in control period" in err
    assert "replayed nothing" in err


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "offset 0: empty file"),
        (b"\x89PNG\r\n\x1a\n\0\0", "offset 0: neither a recording nor a stream file"),
        (
            b"\xdf\xe4\x77\x05",
            "(UTF-8 text); give a run.mcap that `mirotwin run` wrote; of bytes alone make a",
        ),
        ("0 > 55\n".encode("utf-16"), "neither a recording nor a stream file (UTF-8 text)"),
        (
            render([Transmission(0, ">", b"a")]),
            "offset 0: a capture, which cannot be replayed; make a stream file of it with `mirotwin export ",
        ),
        (
            b"55 55 2d d4 7f f1\n",
            "offset 0: hex text without times, which cannot be replayed; of bytes alone make a",
        ),
        (b"55552dd47ff1\n", "offset 0: hex text without times"),
        (b"0 > 55\0\n", ":1:5: '55\\x00' is not a character"),
        (b"12 > zz\n", ":1:6: 'zz' is not a character"),
        (b"# only a comment\n", "no line from host to robot"),
        (b"\xff\xfe\n", ":1:1: byte ffh is not UTF-8"),
    ],
)
def test_a_file_of_another_kind_is_refused_with_its_place(mirotwin, tmp_path, content, expected):
    path = tmp_path / "file"
    path.write_bytes(content)
    code, out, err = mirotwin("replay", path)
    assert (code, out) == (2, "")
    assert err.startswith(f"mirotwin: error: {path}")
    assert expected in err


def test_a_recording_cut_short_in_its_end_is_compared_as_far_as_it_goes(mirotwin, finished, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes((finished / "run.mcap").read_bytes()[:-1000])
    code, out, err = mirotwin("replay", path)
    assert code == 0
    assert "equals the recorded one in all 6 control periods" in out
    assert "offset" in err
    assert "ends in the middle" in err


def test_a_recording_without_a_control_period_is_refused(mirotwin, tmp_path):
    source = RunSource(
        scenario_name="x", scenario_text="", seed=1, firmware=b"rubbish", firmware_sha256="", symbols={}
    )
    path = tmp_path / "odd.mcap"
    with path.open("wb") as stream, Recorder(stream, source):
        pass
    code, _, err = mirotwin("replay", path)
    assert code == 2
    assert "holds no control period" in err


def test_half_a_recording_is_said_to_be_cut_short_and_what_to_do(mirotwin, finished, tmp_path):
    data, half = (finished / "run.mcap").read_bytes(), tmp_path / "half.mcap"
    half.write_bytes(data[: len(data) // 2])
    code, out, err = mirotwin("replay", half)
    assert code == 0
    assert "equals the recorded one in all" in out
    assert f"{half}: offset " in err
    assert "it was cut short; copy it again, or record the run again" in err


@pytest.mark.parametrize("length", range(1, 8))
def test_a_recording_cut_short_in_its_first_bytes_is_called_truncated(mirotwin, tmp_path, length):
    (tmp_path / "run.mcap").write_bytes(b"\x89MCAP0\r\n"[:length])
    code, out, err = mirotwin("replay", tmp_path / "run.mcap")
    assert (code, out) == (2, "")
    assert "the file ends in the middle of a record; it was cut short; copy it again" in err


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"network": 7}, "tick 96000: network 7, but the scenario has 1, numbered from 0"),
        ({"tick": 96_000 + 800_800 - 1}, "starts before the transmission of tick 896799 has ended"),
    ],
)
def test_a_recording_whose_characters_no_host_can_have_sent_is_refused(
    mirotwin, finished, tmp_path, change, what
):
    def changed(period):
        if period.index:
            return period
        first, *others = period.wire
        return msgspec.structs.replace(period, wire=(msgspec.structs.replace(first, **change), *others))

    path = rewritten(finished / "run.mcap", tmp_path / "odd.mcap", changed)
    code, out, err = mirotwin("replay", path)
    assert (code, out) == (2, "")
    assert err.startswith(f"mirotwin: error: {path}: ")
    assert what in err
