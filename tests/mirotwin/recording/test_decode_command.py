"""`mirotwin decode`: one table from any format, everything that could be read before what could not."""

import json
import os
import re
import shlex
import subprocess
from itertools import accumulate

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.stream import format_stream
from miro_protocol.transmission import Transmission
from tests import children
from tests.mirotwin import program
from tests.mirotwin.program import COMMAND, mirotwin

TEAM = encode(TeamFrame(3, 1, ((100, -100), (0, 1), (-32767, 32767))), 3)
SERVICE = encode(ServiceFrame.acceleration(2, 1, 5973), 3)
ANSWER = encode(TelemetryFrame(1, 2, 0x18, 0x80, 0x90, 5, 65531, 1, 0), 3)
BROKEN = TEAM[:12] + bytes([TEAM[12] ^ 1]) + TEAM[13:]
SENT = [(0, ">", TEAM), (800_800, "<", ANSWER), (1_601_600, ">", BROKEN), (2_402_400, ">", SERVICE)]
DOWN = TEAM + BROKEN + SERVICE
PCAPNG = render([Transmission(*sent) for sent in SENT])
STREAM = format_stream([Transmission(*sent) for sent in SENT]).encode()


def decode(data, *options):
    """Exit code, lines and errors of decoding `data` from standard input."""
    code, out, err = mirotwin("decode", "-", *options, input=data)
    return code, out.splitlines(), err


def as_json(data, *options):
    code, lines, err = decode(data, "--json", *options)
    return code, [json.loads(line) for line in lines], err


@pytest.mark.parametrize("data", [DOWN, DOWN.hex().encode(), b", ".join(b"0x%02x" % byte for byte in DOWN)])
def test_bytes_without_times_are_told_by_their_offsets(data):
    code, lines, err = decode(data)
    assert code == 0
    assert re.fullmatch(r"mirotwin: standard input: read as (raw bytes|hex text), .*\n", err)
    assert lines[0].endswith(", network 0 of 3 robots")
    columns = [line.split(maxsplit=6) for line in lines[3:-1]]
    assert [column[0] for column in columns] == ["0", "23", "46"]
    assert {(column[1], column[2]) for column in columns} == {(">", "0")}
    said = [" ".join(column[3:6]) for column in columns]
    assert said == ["team_ask 1 accepted", "damage - bad", "acceleration 2 accepted"]
    assert columns[0][6] == "0: +100/-100  1: +0/+1  2: -32767/+32767"
    assert columns[2][6] == "slot=1 acceleration=5973"
    assert "acceleration in 1/65536 count per sample^2" in lines[1]
    assert lines[-1] == "frames: 2 accepted, 0 stale, 0 telemetry; 1 damaged run of 23 bytes (1 bad crc)"


@pytest.mark.parametrize("data", [PCAPNG, STREAM])
def test_captures_with_times_and_both_directions_are_told_by_their_ticks(data):
    code, found, err = as_json(data)
    assert code == 0
    assert err in ("", "mirotwin: standard input: read as pcapng capture, its first bytes are those of one\n")
    first, *rows, last = found
    assert (first["event"], first["timed"]) == ("input", True)
    assert [(row["tick"], row["direction"]) for row in rows] == [sent[:2] for sent in SENT]
    assert [row["event"] for row in rows] == ["frame", "frame", "damage", "frame"]
    assert rows[0]["fields"]["velocities"][2] == {"left": -32767, "right": 32767}
    wheels = {"status_left": 0x80, "status_right": 0x90, "position_left": 5, "position_right": 65531}
    told = {"slot": 2, "flags": ["stopped", "motors_off"], "accepted": 1, "rejected": 0}
    assert rows[1]["fields"] == {**told, **wheels}
    assert rows[2]["reason"] == "bad crc"
    assert bytes.fromhex(rows[2]["data"]) == BROKEN
    assert rows[1]["time_s"] == 800_800 / 24e6
    assert first["units"]["position_left"] == "count"
    assert (last["accepted"], last["telemetry"], last["damaged"]) == (2, 1, 1)


def test_a_recording_says_how_many_robots_it_has_and_gives_both_directions(finished):
    out = mirotwin.succeeds("decode", finished / "run.mcap", "--json")
    rows = [json.loads(line) for line in out.splitlines()]
    assert rows[0]["format"] == "recording"
    assert [row["seq"] for row in rows if row.get("type") == "team_ask"] == list(range(6))
    assert {row["fields"]["slot"] for row in rows if row.get("type") == "telemetry"} <= {0, 2}
    assert rows[-1]["telemetry"] >= 1


def test_repeated_numbers_are_stale():
    lines = decode(TEAM + SERVICE + SERVICE)[1]
    assert [line.split()[5] for line in lines[3:-1]] == ["accepted", "accepted", "stale"]


@pytest.mark.parametrize("n", [3, 5])
def test_the_layout_is_that_in_which_frames_can_be_read_unless_it_is_said(n):
    wire = encode(TeamFrame(0, 1, ((1, 2),) * n), n)
    assert as_json(wire)[1][1]["event"] == "frame"
    code, found, err = as_json(wire, "--robots", str(8 - n), "--from-form", "raw")
    assert (code, err) == (0, "")
    assert found[1]["event"] == "damage"


def test_a_layout_that_cannot_be_told_is_said_to_be_a_guess():
    assert "no frame of 3 or 5 robots at the beginning; 3 robots assumed (--robots" in decode(b"\0" * 50)[2]
    both = TEAM + encode(TeamFrame(0, 2, ((1, 2),) * 5), 5) * 2
    found = "1 frame of 3 robots and 2 frames of 5 robots at the beginning; 5 robots assumed"
    assert found in decode(both)[2]
    assert "assumed" not in decode(both, "--robots", "3", "--direction", "down")[2]


def test_raw_telemetry_is_found_to_come_from_a_robot():
    code, found, _ = as_json(ANSWER)
    assert (code, found[1]["direction"], found[1]["type"]) == (0, "<", "telemetry")
    assert as_json(TEAM, "--direction", "up")[1][1]["event"] == "damage"


@settings(max_examples=50)
@given(st.binary(max_size=200))
def test_every_byte_is_in_exactly_one_row(data):
    code, found, _ = as_json(data, "--from-form", "raw")
    pieces = [bytes.fromhex(row["data"]) for row in found[1:-1]]
    assert (code, b"".join(pieces)) == (0, data)
    assert [row["offset"] for row in found[1:-1]] == list(accumulate(map(len, pieces), initial=0))[:-1]


def test_plain_text_is_taken_for_bytes_only_where_that_is_said():
    code, lines, err = decode(b"hello world, how are you?")
    assert (code, lines) == (2, [])
    assert (
        "standard input: is text in no form that is known; name it with --from-form, or give --from-form raw"
        in err
    )
    code, lines, _ = decode(b"hello world, how are you?", "--from-form", "raw")
    assert code == 0
    assert "25 bytes: 68 65 6c" in lines[3]


@pytest.mark.parametrize(
    ("data", "options", "rows", "message"),
    [
        (PCAPNG[:-3], (), 3, "offset 324: the file ends in the middle of a block"),
        (PCAPNG + b"\0" * 12, (), 4, "damaged block: length 0"),
        (b"\xd4\xc3\xb2\xa1" + bytes(30), (), 0, "offset 24: the file ends in the middle of a packet"),
        (STREAM + b"5000000 > 5g\n", (), 4, "standard input:6:11: '5g' is not a character"),
        (STREAM + b"5000000 > \xff\n", (), 4, "standard input:6:11: byte ffh is not UTF-8"),
        (DOWN.hex(" ").encode() + b"\nxy", ("--from-form", "hex"), 3, "standard input:2:1: 'x' is no hex digit"),
        (DOWN, ("--from-form", "pcapng"), 0, "offset 0: not a pcapng file"),
        (DOWN, ("--from-form", "recording"), 0, "offset 0: not an MCAP file"),
        (b"\x89MCAP0\r\n\1\2", (), 0, "offset 8: the file ends in the middle of a record"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named_after_all_that_could(data, options, rows, message):
    code, lines, err = decode(data, *options)
    assert code == 2
    assert message in err.splitlines()[-1]
    assert len(lines) == 3 + rows + 1
    assert lines[-1].startswith("frames: ")
    code, found, _ = as_json(data, *options)
    assert code == 2
    assert [row["event"] for row in found[-2:]] == ["error", "end"]
    assert message in found[-2]["text"]


def test_a_capture_of_very_many_networks_does_not_fill_the_memory():
    crowd = render([Transmission(at, ">", TEAM, at) for at in range(200)])
    code, lines, err = decode(crowd)
    assert code == 2
    assert lines[0] == "standard input: pcapng capture, 200 networks"
    assert "characters of more than 64 networks; take one out with `mirotwin export --network`" in err
    assert len(lines) == 3 + 64 + 1


def test_a_damaged_recording_gives_what_came_before(finished, tmp_path):
    whole = (finished / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    code, out, err = mirotwin("decode", tmp_path / "cut.mcap")
    assert code == 2
    assert "the file ends in the middle of a record; it was cut short" in err
    assert out.count("team_ask") >= 1


def test_no_such_file_and_devices_are_refused(tmp_path):
    assert mirotwin("decode", tmp_path / "none")[0] == 2
    assert mirotwin("decode", tmp_path)[0] == 2
    assert "is a device; name a file or a pipe" in mirotwin("decode", "/dev/zero")[2]
    assert mirotwin("decode", "/dev/null")[0] == 0


def test_it_works_in_a_pipe_and_shows_a_frame_before_the_input_ends():
    options = ("--json", "--from-form", "raw", "--robots", "3", "--direction", "down")
    command = [*COMMAND, "decode", "-", *options]
    with children.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdin.write(TEAM)
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["event"] == "input"
        assert json.loads(process.stdout.readline())["seq"] == 1
        process.stdin.close()
        assert json.loads(process.stdout.readline())["accepted"] == 1
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("command", "arguments"), [("decode", ()), ("decode", ("--json",)), ("export", ("--out", "-"))]
)
@pytest.mark.parametrize("cut", [0, 3])
def test_packets_of_unknown_events_are_counted_on_stderr(tmp_path, command, arguments, cut):
    odd = bytearray(render([Transmission(index * 800_800, ">", DOWN) for index in range(3)]))
    at = odd.index(DOWN, odd.index(DOWN) + 1) - 4
    odd[at] = 0x42
    path = tmp_path / "odd.pcapng"
    path.write_bytes(odd[: len(odd) - cut])
    code, _, err = mirotwin(command, path, *arguments)
    assert code == (2 if cut else 0)
    passed = "passed over 1 packet other than data sent or received: 1 of unknown event"
    assert f"{path}: {passed}" in err


@pytest.mark.parametrize("arguments", [(), ("--json",)])
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_file_whose_name_is_no_utf_8_is_decoded(tmp_path, arguments, encoding):
    name = os.fsencode(tmp_path) + b"/odd\xff.hex"
    with open(name, "wb") as file:
        file.write(DOWN.hex().encode())
    strictly = {**os.environ, "PYTHONIOENCODING": f"{encoding}:strict"}
    found = children.run(
        [*COMMAND, "decode", name, "--from-form", "hex", *arguments], env=strictly, capture_output=True
    )
    assert (found.returncode, found.stderr) == (0, b"")
    assert b"odd" in found.stdout.splitlines()[0]


def test_a_device_that_never_ends_is_refused_as_standard_input_too():
    with open("/dev/zero", "rb") as zeros:
        found = program.run("decode", "-", stdin=zeros, timeout=30)
    assert found.returncode == 2
    assert "standard input: is a device; name a file or a pipe" in found.stderr


@pytest.mark.parametrize(("closed", "name"), [("<&-", b"standard input"), (">&-", b"standard output")])
def test_a_closed_standard_stream_is_named(closed, name):
    line = shlex.join([*COMMAND, "decode", "-"])
    found = children.run(f"{line} {closed}", shell=True, capture_output=True, input=b"", check=False)
    assert found.returncode == 2
    assert re.fullmatch(rb"mirotwin: error: " + name + rb":? is closed; .*\n", found.stderr)


CASE = "# mirotwin stream 2\n#: [bare]\n#: crystal_hz = {}\n11059200 > c0\n"


def test_ticks_of_another_crystal_are_told_as_those_of_24_megahertz(tmp_path):
    case = tmp_path / "case.stream"
    case.write_text(f"{CASE.format(11059200)}22118401 > c0\n")
    code, out, err = mirotwin("decode", case, "--json")
    ticks = [(row["tick"], row["time_s"]) for row in map(json.loads, out.splitlines()) if "tick" in row]
    assert (code, ticks) == (0, [(24_000_000, 1.0), (48_000_002, 48_000_002 / 24e6)])
    units = f"mirotwin: {case}: ticks of its 11059200 Hz crystal are given in those of 24000000 Hz"
    assert units in err.splitlines()
    assert mirotwin.ends(0, "export", case, "--out", tmp_path / "case.pcapng", "-q").count("11059200 Hz") == 1
    assert "   48000002      2.0000 " in mirotwin("decode", tmp_path / "case.pcapng")[1]


@pytest.mark.parametrize("crystal", ['"fast"', "24000000", "0", "true"])
def test_a_crystal_that_says_nothing_changes_no_tick(tmp_path, crystal):
    case = tmp_path / "case.stream"
    case.write_text(CASE.format(crystal))
    _, out, err = mirotwin("decode", case, "--json")
    assert (json.loads(out.splitlines()[1])["tick"], "Hz" in err) == (11_059_200, False)
