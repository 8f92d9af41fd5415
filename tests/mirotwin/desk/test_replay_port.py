"""`mirotwin replay --port`: a stream goes to a robot, and its answers stand beside its twin's.

The robot is another world behind `miro://`, whose clock is virtual: each test gives the same every time.
"""

import pytest

from mirotwin.desk.robot_port import PortError, RobotPort
from mirotwin.recording import reader
from tests.mirotwin.desk.rig import PERIOD, ROBOT


def test_an_equal_robot_answers_as_its_twin_does(mirotwin, drive):
    code, out, err = mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q")
    assert (code, "the robot answers as its twin does, 17 times" in out) == (0, True), out + err
    assert "40 transmissions sent, 99 % less than 0.00 ms late" in err
    assert "robot 0 of 3 answers" in err


def test_nothing_is_sent_that_moves_unless_it_is_allowed(mirotwin, drive):
    code, _, err = mirotwin("replay", drive, "--port", ROBOT)
    assert code == 2
    assert "tick 1000000: robot 0 told" in err
    assert err.count("\n") == 1
    assert not (drive.parent / "runs").exists()


@pytest.mark.parametrize("port", ["/dev/nothing", "socket://127.0.0.1:1"])
def test_a_port_that_cannot_be_opened_leaves_nothing_in_the_way_of_the_next_try(mirotwin, drive, port):
    for _ in range(2):
        code, _, err = mirotwin("replay", drive, "--port", port, "--allow-motion")
        assert (code, err.count("\n")) == (2, 1)
        assert "there is no such port" in err or "does anybody serve it?" in err


def test_too_fast_a_wheel_is_refused_before_anything_is_sent(mirotwin, drive):
    code, _, err = mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "--max-speed", "0.15")
    assert code == 2
    assert "at most 0.15 m/s are allowed; raise --max-speed" in err
    assert not (drive.parent / "runs").exists()


def test_a_recording_made_at_a_port_is_one_like_any_other(mirotwin, drive):
    mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q", "--out", "desk")
    recording = reader.read("desk/run.mcap")
    assert recording.source.origin == "port"
    assert sum(len(period.wire) for period in recording.periods) > 60
    for command in (("decode", "desk/run.mcap"), ("export", "desk/run.mcap", "--out", "desk.pcapng")):
        code, _, err = mirotwin(*command)
        assert code == 0, err
    code, out, _ = mirotwin("replay", "desk", "-q")
    assert (code, "the robot answers as its twin does, 17 times" in out) == (0, True)


@pytest.mark.parametrize("part", [5, 6, 7])
def test_an_answer_that_a_lost_port_did_not_wait_for_is_not_missing(mirotwin, drive, monkeypatch, part):
    read = RobotPort._read

    def vanishing(port, wait_ticks):
        if port._now > (50 + part / 4) * PERIOD:
            raise PortError(port.url, "", "the port is lost")
        return read(port, min(wait_ticks, 24_000))

    monkeypatch.setattr(RobotPort, "_read", vanishing)
    code, _, err = mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q", "--out", "desk")
    assert (code, "the port is lost" in err) == (2, True)
    code, out, err = mirotwin("replay", "desk/run.part.mcap", "-q")
    assert (code, "the robot answers as its twin does" in out) == (0, True), out + err


def test_a_run_is_sent_again_as_a_stream_is(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mirotwin("run", "fig6", "--set", "duration_s=1.5", "--out", "run", "-q")
    code, out, err = mirotwin("replay", "run", "--port", ROBOT, "--allow-motion", "-q")
    assert (code, "the robot answers as its twin does" in out) == (0, True), out + err


@pytest.mark.parametrize(
    ("option", "remedy"),
    [
        (("--compare", "wheels"), "use --compare answers"),
        (("--from", "1s"), "leave it out"),
        (("--compare", "answers", "--to", "2s"), "leave it out"),
    ],
)
def test_what_no_port_shows_cannot_be_compared_and_nothing_is_sent(mirotwin, drive, option, remedy):
    expected = f"{option[-2]}: is not for what was recorded at a port; {remedy}\n"
    code, _, err = mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q", *option)
    assert (code, err.count("\n"), expected in err) == (2, 1, True)
    assert not (drive.parent / "runs").exists()
    mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q", "--out", "desk")
    code, _, err = mirotwin("replay", "desk", *option)
    assert (code, expected in err) == (2, True)


def test_answers_are_compared_at_ports_only(mirotwin, finished):
    code, _, err = mirotwin("replay", finished, "--compare", "answers")
    assert (code, "is for robots at a port" in err) == (2, True)


def test_what_is_expected_of_a_robot_is_refused_before_anything_is_sent(mirotwin, drive):
    expected = ("--expect", "frames_accepted_min=99")
    code, _, err = mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", *expected)
    assert (code, err.count("\n")) == (2, 1)
    assert "--expect: is not for a robot at a port, of which only answers are known" in err
    assert not (drive.parent / "runs").exists()
    mirotwin("replay", drive, "--port", ROBOT, "--allow-motion", "-q", "--out", "desk")
    code, _, err = mirotwin("replay", "desk", *expected)
    assert (code, "--expect: is not for a robot at a port" in err) == (2, True)


def test_a_case_of_a_bare_processor_is_refused(mirotwin, tmp_path):
    case = tmp_path / "bare.stream"
    case.write_text("# mirotwin stream 2\n#: [bare]\n#: bit_ticks = 1152\n1000 > 61\n")
    code, _, err = mirotwin("replay", case, "--port", ROBOT)
    assert (code, err) == (
        2,
        f"mirotwin: error: {case}: --port: is not for a case of a bare processor; leave it out\n",
    )
