"""`mirotwin replay --port`: a stream goes to a robot, and its answers stand beside its twin's.

The robot is another world behind `miro://`, whose clock is virtual: each test gives the same every time.
"""

import errno
import json
import os
import re

import pytest
import serial

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from mirotwin.desk.robot_port import PortError, RobotPort
from mirotwin.recording import reader
from mirotwin.recording.difference import Difference
from mirotwin.report.page.port_page import _marks
from mirotwin.runs.at_port import twin_source
from tests.mirotwin.desk.rig import PERIOD, ROBOT, stream_text
from tests.mirotwin.verify.checks.rig import planted
from tests.mutants.build import build
from tests.mutants.draw import source_files
from tests.mutants.sdcc import needs_sdcc
from tests.vectors.paths import CASES

TO_ROBOT = ("--port", ROBOT, "--allow-motion", "-q")
ALIKE = "the robot answers as its twin does"


@pytest.fixture
def desk(mirotwin, drive):
    """The folder of a recording that was made at the port of an equal robot."""
    assert mirotwin("replay", drive, *TO_ROBOT, "--out", "desk")[0] == 0
    return drive.parent / "desk"


def test_an_equal_robot_answers_as_its_twin_does(mirotwin, drive):
    code, out, err = mirotwin("replay", drive, *TO_ROBOT)
    assert (code, f"{ALIKE}, 17 times" in out) == (0, True), out + err
    assert "40 transmissions sent, 99 % less than 0.00 ms late" in err
    assert "robot 0 of 3 answers" in err


def test_nothing_is_sent_that_moves_unless_it_is_allowed(mirotwin, drive):
    assert "tick 1000000: robot 0 told" in mirotwin.refuses("replay", drive, "--port", ROBOT)
    assert not (drive.parent / "runs").exists()


@pytest.mark.parametrize("port", ["/dev/nothing", "socket://127.0.0.1:1"])
def test_a_port_that_cannot_be_opened_leaves_nothing_in_the_way_of_the_next_try(mirotwin, drive, port):
    for _ in range(2):
        err = mirotwin.refuses("replay", drive, "--port", port, "--allow-motion")
        assert "there is no such port" in err or "does anybody serve it?" in err


def test_a_port_that_may_not_be_read_is_told_with_the_group_to_join(mirotwin, drive, monkeypatch):
    def refuse(*given, **named):
        raise serial.SerialException(errno.EACCES, "could not open port")

    monkeypatch.setattr(os, "access", lambda path, mode: path != "/dev/tty")
    monkeypatch.setattr(serial, "serial_for_url", refuse)
    err = mirotwin.refuses("replay", drive, "--port", "/dev/tty", "--allow-motion")
    assert "/dev/tty: no permission to open it; join the group that owns it (dialout)" in err


def test_too_fast_a_wheel_is_refused_before_anything_is_sent(mirotwin, drive):
    err = mirotwin.refuses("replay", drive, *TO_ROBOT, "--max-speed", "0.15")
    assert "at most 0.15 m/s are allowed; raise --max-speed" in err
    assert not (drive.parent / "runs").exists()


def test_a_recording_made_at_a_port_is_one_like_any_other(mirotwin, desk):
    recording = reader.read("desk/run.mcap")
    assert recording.source.origin == "port"
    assert sum(len(period.wire) for period in recording.periods) > 60
    for command in (("decode", "desk/run.mcap"), ("export", "desk/run.mcap", "--out", "desk.pcapng")):
        mirotwin.ends(0, *command)
    assert f"{ALIKE}, 17 times" in mirotwin("replay", desk, "-q")[1]


@pytest.mark.parametrize("part", [5, 6, 7])
def test_an_answer_that_a_lost_port_did_not_wait_for_is_not_missing(mirotwin, drive, monkeypatch, part):
    read = RobotPort._read

    def vanishing(port, wait_ticks):
        if port._now > (50 + part / 4) * PERIOD:
            raise PortError(port.url, "", "the port is lost")
        return read(port, min(wait_ticks, 24_000))

    monkeypatch.setattr(RobotPort, "_read", vanishing)
    assert "the port is lost" in mirotwin.ends(2, "replay", drive, *TO_ROBOT, "--out", "desk")
    code, out, err = mirotwin("replay", "desk/run.part.mcap", "-q")
    assert (code, ALIKE in out) == (0, True), out + err


def test_a_run_is_sent_again_as_a_stream_is(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mirotwin("run", "fig6", "--set", "duration_s=1.5", "--out", "run", "-q")
    code, out, err = mirotwin("replay", "run", *TO_ROBOT)
    assert (code, ALIKE in out) == (0, True), out + err


def test_a_robot_in_a_slot_that_is_empty_in_the_twin_does_not_answer_as_it(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mirotwin("run", "fig6", "--set", "duration_s=1.5", "--out", "run", "-q")
    other = ("--port", f"{ROBOT}&set=network.robot.slot=1", "--allow-motion", "-q")
    err = mirotwin.ends(4, "replay", "run", *other)
    assert "robot 0 of the twin is not at the port: not compared" in err
    assert re.search("/net0/robot1/answer: robot to question [0-9]+, twin nothing", err)


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--compare", "wheels"), "is not for what was recorded at a port; use --compare answers"),
        (("--from", "1s"), "is not for what was recorded at a port; leave it out"),
        (("--compare", "answers", "--to", "2s"), "is not for what was recorded at a port; leave it out"),
        (("--expect", "frames_accepted_min=99"), "is not for a robot at a port, of which only answers are known"),
    ],
)  # fmt: skip
def test_what_no_port_shows_cannot_be_compared_and_nothing_is_sent(mirotwin, drive, option, said):
    assert f"{option[-2]}: {said}" in mirotwin.refuses("replay", drive, *TO_ROBOT, *option)
    assert not (drive.parent / "runs").exists()
    mirotwin("replay", drive, *TO_ROBOT, "--out", "desk")
    assert f"{option[-2]}: {said}" in mirotwin.ends(2, "replay", "desk", *option)


def test_a_recording_made_at_a_port_is_compared_and_not_recorded_again(mirotwin, drive):
    mirotwin("replay", drive, *TO_ROBOT, "--out", "desk")
    said = mirotwin.ends(2, "replay", "desk", "--out", "again", "-q")
    assert "--out: is for a stream, a capture or a recording of a twin; leave it out" in said


def test_answers_are_compared_at_ports_only(mirotwin, finished):
    assert "is for robots at a port" in mirotwin.refuses("replay", finished, "--compare", "answers")


def test_a_case_of_a_bare_processor_is_refused(mirotwin, tmp_path):
    case = tmp_path / "bare.stream"
    case.write_text("# mirotwin stream 2\n#: [bare]\n#: bit_ticks = 1152\n1000 > 61\n")
    err = mirotwin.refuses("replay", case, "--port", ROBOT, "--firmware", CASES / "jumps-out.ihx")
    assert err == f"{case}: --port: is for robots, and this is for a board; leave it out"


MOVED = {"left moved", "right moved"}
FIRMWARE = {
    "a small gain": ("filter.h", "FILTER_KP       400", "FILTER_KP       60", MOVED),
    "a small acceleration": ("protocol.h", "5973UL", "600UL", MOVED),
    "stops 60 ms late": ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 60)", {"flags"}),
    "goes off 100 ms late": ("failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 100)", {"flags"}),
    "wheels exchanged": ("motion.c", "load_velocity(LEFT, last_left)", "load_velocity(LEFT, last_right)", MOVED),
    "positions exchanged": ("telemetry.c", "put_word(position(LEFT))", "put_word(position(RIGHT))", MOVED),
    "slower at most": ("protocol.h", "VELOCITY_SATURATION          16633", "VELOCITY_SATURATION          500", MOVED),
}  # fmt: skip
"""File, what stands there, what stands there instead, and the channels of which one shows it first."""
MISTAKES = {
    "takes the velocities of the robot before it": MOVED,
    "drives backward velocities forward": MOVED,
    "tells what happened again and again": {"flags"},
}


def silences(number):
    """133 and 534 ms beyond the usual ones, before questions to a robot that is not there."""
    return (0, 4, 20)[number // 10]


def asked_after_silences(number):
    """So long that motors go off, before each question to robot 0."""
    return (number + 2) // 3 * 16


def first(mirotwin, folder, robot, later=silences):
    """The first difference in a stream whose frames come so many control periods later."""
    head, *lines = stream_text(30).splitlines()
    moved = [head]
    for number, line in enumerate(lines):
        tick, _, rest = line.partition(" ")
        moved.append(f"{int(tick) + later(number) * PERIOD} {rest}")
    (folder / "drive.stream").write_text("\n".join(moved) + "\n")
    options = ("--allow-motion", "--json", "--out", folder / "out")
    code, out, err = mirotwin("replay", folder / "drive.stream", "--port", robot, *options)
    document = json.loads(out)
    assert code == (4 if document["first"] else 0), err
    return document["first"]


@pytest.mark.parametrize("later", [silences, asked_after_silences])
def test_an_equal_robot_has_no_difference_in_silences(mirotwin, tmp_path, later):
    assert first(mirotwin, tmp_path, ROBOT, later) is None


@needs_sdcc
@pytest.mark.parametrize("name", FIRMWARE)
def test_other_constants_of_the_firmware_are_found(mirotwin, tmp_path, name):
    file, right, wrong, channels = FIRMWARE[name]
    text = source_files()[file]
    assert text.count(right) >= 1
    made = build({file: text.replace(right, wrong)})
    assert not made.error
    assert first(mirotwin, tmp_path, f"{ROBOT}&firmware={made.image}")["channel"] in channels


@needs_sdcc
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_of_the_firmware_are_found(mirotwin, tmp_path, name):
    assert first(mirotwin, tmp_path, f"{ROBOT}&firmware={planted(name).path}")["channel"] in MISTAKES[name]


def test_an_answer_that_gets_lost_is_missing_where_it_was(mirotwin, tmp_path, monkeypatch):
    taken = RobotPort._take

    def deaf(port, data):
        taken(port, b"" if 40 * PERIOD < port._now < 44 * PERIOD else data)

    monkeypatch.setattr(RobotPort, "_take", deaf)
    found = first(mirotwin, tmp_path, ROBOT)
    assert (found["channel"], found["robot"]) == ("answer", None)
    assert 40 <= found["period"] <= 44


@pytest.mark.parametrize("key", ["robot.drive.chassis.wheel_radius_m=0.0204", "radio.baud_offset_ppm=10000"])
def test_what_no_answer_depends_on_is_not_seen(mirotwin, tmp_path, key):
    assert first(mirotwin, tmp_path, f"{ROBOT}&set=network.{key}") is None


@needs_sdcc
@pytest.mark.parametrize(("reload", "percent"), [("B3", 1.3), ("B1", -1.3), ("B6", 5.4)])
def test_a_serial_port_of_another_rate_is_told_where_it_matters(mirotwin, drive, reload, percent):
    text = source_files()["protocol.h"]
    right = "TIMER2_RELOAD_LOW            0xB2"
    made = build({"protocol.h": text.replace(right, right.replace("B2", reload))})
    robot = f"{ROBOT}&firmware={made.image}"
    code, _, err = mirotwin("replay", drive, "--port", robot, "--allow-motion", "-q")
    assert code == (0 if abs(percent) < 2 else 2), err
    if code:
        assert "characters come that are no answer" in err
        assert "is its rate 9600 baud?" in err


@pytest.fixture
def page(mirotwin, drive):
    def made(robot):
        mirotwin("replay", drive, "--port", robot, "--allow-motion", "-q", "--out", "desk")
        mirotwin.ends(0, "report", "desk", "-o", "desk.html", "-q")
        return (drive.parent / "desk.html").read_text()

    return made


def test_an_equal_robot_and_its_twin_are_on_one_page(page):
    text = page(ROBOT)
    assert "The robot answers as its twin does." in text
    assert "Robot 0 and its twin" in text
    for name in ("left-moved", "right-moved", "flags", "accepted", "rejected"):
        assert f'id="plot-0-{name}"' in text


def test_where_they_part_stands_in_the_table(page):
    text = page(f"{ROBOT}&set=network.radio.lost_frames=0.2")
    assert ">differs<" in text
    assert re.search(r"<td>/net0/robot0/(answer|accepted|left moved)</td>", text)


def test_a_difference_is_marked_in_the_plot_of_its_channel_and_in_no_other():
    left = Difference(24_000_000, 29, 0, 0, "left moved", 408, -414)
    lost = Difference(48_000_000, 59, 0, 0, "answer", None, "to question 5")
    found = [left, left, lost]
    assert _marks(found, 0, "left moved") == [1.0, 2.0]
    assert _marks(found, 0, "flags") == [2.0]
    assert _marks(found, 1, "left moved") == []


def test_the_twin_has_the_image_that_was_loaded_also_where_its_file_has_changed_since(tmp_path):
    file = tmp_path / "mine.ihx"
    content = image_path().read_bytes()
    file.write_bytes(content)
    image = load_hex(file)
    file.write_bytes(b":00000001FF\n")
    assert twin_source(load("silent").scenario, 0, image).firmware == content
