"""The pytest plugin as a user has it: sessions with fixtures, options and markers, and what failed tests leave."""

import json
import re
import shlex
from xml.etree import ElementTree

import pytest

from tests.mirotwin.testing.sessions import run, session

MIXED = """
def test_passes(link, robot):
    link.send(velocities={0: (100, -100)})
    link.poll(0)
    assert link.expect(Telemetry, within=ms(40)).accepted == 2
    assert robot.read("last_left") == 100

def test_waits_in_vain(link):
    link.poll(1)
    link.expect(Telemetry, within=ms(40))

@pytest.mark.mirotwin(expect={"frames_accepted_min": 9}, seed=4)
@pytest.mark.parametrize("n", [1])
def test_is_judged(link, n):
    link.poll(1)

def test_asserts(world):
    assert world.seed == -1

@pytest.mark.mirotwin(scnario="fig6")
def test_has_a_marker_with_a_mistake(world):
    pass

@pytest.mark.mirotwin(firmware="gone.ihx")
def test_has_no_firmware(world):
    pass

def test_misspells_a_variable(robot):
    robot.read("last_lef")

def test_misspells_a_function(robot):
    robot.break_at("motion_stap")

def test_has_no_end(world):
    world.run_until(conditions.Answer())

def test_needs_no_world():
    pass
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """The folder of a session with tests of all kinds: `out.txt`, `junit.xml`, `left/`."""
    folder = tmp_path_factory.mktemp("mixed")
    done = session(folder, "--mirotwin-artifacts=left", "--junitxml=junit.xml", tests=MIXED, child=True)
    (folder / "out.txt").write_text(done.stdout)
    assert done.returncode == 1, done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_each_test_has_its_verdict(mixed):
    out = (mixed / "out.txt").read_text()
    assert "6 failed, 2 passed, 2 errors" in out
    assert "INTERNALERROR" not in out
    assert "Traceback" not in out


@pytest.mark.parametrize(
    "line",
    [
        "E       mirotwin.testing.waiting.WaitFailed: no answer within 40 ms, from tick",
        "check failed: frames_accepted_min: net0/robot0: tick 1601600 (66.733 ms): wanted at least 9 frames accepted,",
        "test_mine.py::test_has_a_marker_with_a_mistake: @pytest.mark.mirotwin: there is no key 'scnario'; did you",
        "test_mine.py::test_has_no_firmware: gone.ihx: there is no such file; build it, or give the path",
        "last_lef: there is no such variable; did you mean last_left",
        "motion_stap: there is no such function; did you mean motion_stop",
        "the limit of virtual time was reached, duration_s = 60",
    ],
)
def test_what_went_wrong_is_said_in_one_line(mixed, line):
    assert line in (mixed / "out.txt").read_text()


def test_a_traceback_ends_at_the_tests_own_line(mixed):
    out = (mixed / "out.txt").read_text()
    assert "\n>       world.run_until(conditions.Answer())\n" in out
    assert '\n>       robot.read("last_lef")\n' in out
    assert "site-packages" not in out
    assert "def until(" not in out


def test_junit_has_the_facts_of_each_run_and_the_line_that_repeats_it(mixed):
    cases = {
        case.get("name"): case for case in ElementTree.parse(mixed / "junit.xml").getroot().iter("testcase")
    }
    named = {
        name: {one.get("name"): one.get("value") for one in case.iter("property")}
        for name, case in cases.items()
    }
    facts = named["test_passes"]
    assert facts["mirotwin_seed"] == "0"
    assert re.fullmatch("[0-9a-f]{64}", str(facts["mirotwin_digest"]))
    assert re.fullmatch("[0-9a-f]{64}", str(facts["mirotwin_firmware"]))
    assert named["test_is_judged[1]"]["mirotwin_reproduce"] == (
        "pytest 'test_mine.py::test_is_judged[1]' --mirotwin-seed 4"
    )
    assert named["test_needs_no_world"] == {}


def test_a_failed_test_leaves_a_folder_of_its_own_and_a_passing_one_nothing(mixed):
    folders = sorted(path.name for path in (mixed / "left").iterdir())
    assert len(folders) == 6
    assert not [name for name in folders if "passes" in name or "needs_no" in name]
    (judged,) = [path for path in (mixed / "left").iterdir() if "is_judged" in path.name]
    summary = json.loads((judged / "summary.json").read_text())
    assert summary["mirotwin_seed"] == 4
    assert summary["checks_failed"][0].startswith("frames_accepted_min: net0/robot0")
    report = (judged / "report.txt").read_text()
    assert "sent 23 characters" in report
    assert report.strip() in (mixed / "out.txt").read_text()


@pytest.mark.slow
def test_the_printed_line_fails_in_the_same_way(mixed):
    out = (mixed / "out.txt").read_text()
    (line,) = re.findall(r"^  (pytest .*is_judged.*)$", out, re.MULTILINE)
    done = session(mixed, *shlex.split(line)[1:])
    assert done.returncode == 1
    verdict = "wanted at least 9 frames accepted, found 1"
    digest = re.search(r"seed 4(?:.*\n){2}digest (\w+)", out)
    assert verdict in done.stdout
    assert digest[1] in done.stdout


@pytest.mark.parametrize("name", ["waits_in_vain", "is_judged"])
def test_a_case_gives_the_verdict_again_by_the_printed_line(mixed, name):
    (folder,) = [path for path in (mixed / "left").iterdir() if name in path.name]
    line = f"mirotwin replay left/{folder.name}/case.stream"
    assert f"\n  {line}\n" in (mixed / "out.txt").read_text()
    again = run(mixed, line)
    assert again.returncode == 1
    assert "fails as recorded: " in again.stderr


def test_where_no_check_can_judge_what_was_sent_is_left(mixed):
    (folder,) = [path for path in (mixed / "left").iterdir() if "misspells_a_function" in path.name]
    assert sorted(path.name for path in folder.iterdir()) == ["report.txt", "sent.stream", "summary.json"]
    assert run(mixed, f"mirotwin replay left/{folder.name}/sent.stream").returncode == 0


@pytest.mark.slow
def test_a_folder_of_a_test_that_passes_now_is_cleared(tmp_path):
    tests = "def test_one(world):\n    assert {}\n"
    session(tmp_path, "--mirotwin-artifacts=left", tests=tests.format("False"))
    (folder,) = (tmp_path / "left").iterdir()
    (folder / "notes.txt").write_text("mine")
    done = session(tmp_path, "--mirotwin-artifacts=left", tests=tests.format("True"))
    assert done.returncode == 0
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


@pytest.mark.slow
def test_the_last_events_are_frames_and_what_is_none_is_characters(tmp_path):
    tests = """
def test_talks(link):
    link.poll(slot=0)
    link.expect(Telemetry, within=ms(80))
    link.send(bytes([0x55, 0x44]))
    link.expect(Telemetry, within=ms(80))
"""
    out = session(tmp_path, tests=tests).stdout
    assert "net0/robot0: received team_ask seq=0 0: +0/+0 1: +0/+0 2: +0/+0 (tick " in out
    assert "net0/robot0: transmitted telemetry seq=0 slot=0 flags=10h accepted=1 rejected=0 (tick " in out
    assert "net0/robot0: received 55 44 (from tick " in out
    assert "55 55" not in out
