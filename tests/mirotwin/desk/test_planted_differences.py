"""Robots that are not what their twin is: each difference is found, and in the channel where it shows first."""

import json

import pytest

from mirotwin.desk.robot_port import RobotPort
from tests.mirotwin.desk.rig import PERIOD, ROBOT, stream_text
from tests.mutants.build import build, compiler
from tests.mutants.draw import source_files
from tests.mutants.planted import PLANTED

MOVED = {"left moved", "right moved"}
FIRMWARE = {
    "a small gain": ("filter.h", "FILTER_KP       400", "FILTER_KP       60", MOVED),
    "a small acceleration": ("protocol.h", "5973UL", "600UL", MOVED),
    "stops 60 ms late": (
        "failsafe.c",
        "age == FAILSAFE_STOP_MS)",
        "age == FAILSAFE_STOP_MS + 60)",
        {"flags"},
    ),
    "goes off 100 ms late": (
        "failsafe.c",
        "age == FAILSAFE_OFF_MS)",
        "age == FAILSAFE_OFF_MS + 100)",
        {"flags"},
    ),
    "wheels exchanged": (
        "motion.c",
        "load_velocity(LEFT, last_left)",
        "load_velocity(LEFT, last_right)",
        MOVED,
    ),
    "positions exchanged": ("telemetry.c", "put_word(position(LEFT))", "put_word(position(RIGHT))", MOVED),
    "slower at most": (
        "protocol.h",
        "VELOCITY_SATURATION          16633",
        "VELOCITY_SATURATION          500",
        MOVED,
    ),
}
"""File, what stands there, what stands there instead, and the channels of which one shows it first."""
MISTAKES = {
    "takes the velocities of the robot before it": MOVED,
    "drives backward velocities forward": MOVED,
    "tells what happened again and again": {"flags"},
}


def first(mirotwin, folder, robot):
    """The first difference in a stream with silences of 133 and 534 ms beyond the usual ones."""
    head, *lines = stream_text(30).splitlines()
    moved = [head]
    for number, line in enumerate(lines):
        tick, _, rest = line.partition(" ")
        moved.append(f"{int(tick) + (0, 4, 20)[number // 10] * PERIOD} {rest}")
    (folder / "drive.stream").write_text("\n".join(moved) + "\n")
    options = ("--allow-motion", "--json", "--out", folder / "out")
    code, out, err = mirotwin("replay", folder / "drive.stream", "--port", robot, *options)
    document = json.loads(out)
    assert code == (4 if document["first"] else 0), err
    return document["first"]


def test_an_equal_robot_has_no_difference_in_these_silences(mirotwin, tmp_path):
    assert first(mirotwin, tmp_path, ROBOT) is None


@pytest.mark.skipif(not compiler(), reason="needs SDCC")
@pytest.mark.parametrize("name", FIRMWARE)
def test_other_constants_of_the_firmware_are_found(mirotwin, tmp_path, name):
    file, right, wrong, channels = FIRMWARE[name]
    text = source_files()[file]
    assert text.count(right) >= 1
    made = build({file: text.replace(right, wrong)})
    assert not made.error
    assert first(mirotwin, tmp_path, f"{ROBOT}&firmware={made.image}")["channel"] in channels


@pytest.mark.skipif(not compiler(), reason="needs SDCC")
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_of_the_firmware_are_found(mirotwin, tmp_path, name):
    planted = PLANTED[name]
    made = build({planted.file: planted.applied(source_files()[planted.file])})
    assert first(mirotwin, tmp_path, f"{ROBOT}&firmware={made.image}")["channel"] in MISTAKES[name]


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


@pytest.mark.skipif(not compiler(), reason="needs SDCC")
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
