"""The pytest plugin as a user has it: sessions with fixtures, options and markers, and what failed tests leave."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.mirotwin.checks.rig import needs_sdcc, planted
from tests.mirotwin.testing.sessions import run, session

from miro_robot.firmware import image_path

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
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a session with tests of all kinds: `out.txt`, `junit.xml`, `left/`."""
    folder = tmp_path_factory.mktemp("mixed")
    done = session(folder, "--mirotwin-artifacts=left", "--junitxml=junit.xml", tests=MIXED)
    (folder / "out.txt").write_text(done.stdout)
    assert done.returncode == 1, done.stdout + done.stderr
    return folder


def test_each_test_has_its_verdict(mixed: Path) -> None:
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
        "test_mine.py::test_has_no_firmware: gone.ihx: there is no such file; build the firmware first",
        "last_lef: there is no such variable; did you mean last_left",
        "motion_stap: there is no such function; did you mean motion_stop",
        "the limit of virtual time was reached, duration_s = 60",
    ],
)
def test_what_went_wrong_is_said_in_one_line(mixed: Path, line: str) -> None:
    assert line in (mixed / "out.txt").read_text()


def test_a_traceback_ends_at_the_tests_own_line(mixed: Path) -> None:
    out = (mixed / "out.txt").read_text()
    assert "\n>       world.run_until(conditions.Answer())\n" in out
    assert '\n>       robot.read("last_lef")\n' in out
    assert "site-packages" not in out
    assert "def until(" not in out


def test_junit_has_the_facts_of_each_run_and_the_line_that_repeats_it(mixed: Path) -> None:
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


def test_a_failed_test_leaves_a_folder_of_its_own_and_a_passing_one_nothing(mixed: Path) -> None:
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


def test_the_printed_line_fails_in_the_same_way(mixed: Path) -> None:
    out = (mixed / "out.txt").read_text()
    (line,) = re.findall(r"^  (pytest .*is_judged.*)$", out, re.MULTILINE)
    done = session(mixed, *shlex.split(line)[1:])
    assert done.returncode == 1
    verdict = "wanted at least 9 frames accepted, found 1"
    digest = re.search(r"seed 4(?:.*\n){2}digest (\w+)", out)
    assert digest is not None
    assert verdict in done.stdout
    assert digest[1] in done.stdout


@pytest.mark.parametrize("name", ["waits_in_vain", "is_judged"])
def test_a_case_gives_the_verdict_again_by_the_printed_line(mixed: Path, name: str) -> None:
    (folder,) = [path for path in (mixed / "left").iterdir() if name in path.name]
    line = f"mirotwin replay left/{folder.name}/case.stream"
    assert f"\n  {line}\n" in (mixed / "out.txt").read_text()
    again = run(mixed, line)
    assert again.returncode == 1
    assert "fails as recorded: " in again.stderr


def test_where_no_check_can_judge_what_was_sent_is_left(mixed: Path) -> None:
    (folder,) = [path for path in (mixed / "left").iterdir() if "misspells_a_function" in path.name]
    assert sorted(path.name for path in folder.iterdir()) == ["report.txt", "sent.stream", "summary.json"]
    assert run(mixed, f"mirotwin replay left/{folder.name}/sent.stream").returncode == 0


def test_a_folder_of_a_test_that_passes_now_is_cleared(tmp_path: Path) -> None:
    tests = "def test_one(world):\n    assert {}\n"
    session(tmp_path, "--mirotwin-artifacts=left", tests=tests.format("False"))
    (folder,) = (tmp_path / "left").iterdir()
    (folder / "notes.txt").write_text("mine")
    done = session(tmp_path, "--mirotwin-artifacts=left", tests=tests.format("True"))
    assert done.returncode == 0
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


MANY = """
@pytest.mark.mirotwin(scenario={"network.radio.bit_error_rate": 0.01})
@pytest.mark.parametrize("step", [1, 2])
def test_noise(world, link, step):
    for _ in range(3):
        link.send(velocities={0: (step, step)})
    world.run_for(ms(5))
    print("DIGEST", world.seed, step, world.digest)
    assert world.seed != 12

def test_once():
    pass
"""


def test_repeated_tests_show_their_seeds_and_workers_clobber_nothing(tmp_path: Path) -> None:
    options = ["-v", "-rA", "--mirotwin-repeat=4", "--mirotwin-seed=10", "--mirotwin-artifacts=left"]
    alone = session(tmp_path, *options, tests=MANY)
    assert "test_noise[2-seed13] PASSED" in alone.stdout
    assert "test_noise[1-seed12] FAILED" in alone.stdout
    assert "2 failed, 7 passed" in alone.stdout
    assert "pytest 'test_mine.py::test_noise[1]' --mirotwin-seed 12\n" in alone.stdout
    files = {path.relative_to(tmp_path): path.read_bytes() for path in (tmp_path / "left").rglob("*.json")}
    assert len(files) == 2
    spread = session(tmp_path, *options, "-n", "2")
    assert "2 failed, 7 passed" in spread.stdout
    assert digests(spread.stdout) == digests(alone.stdout)
    assert len(digests(alone.stdout)) == len(set(digests(alone.stdout))) == 8
    for path, content in files.items():
        assert (tmp_path / path).read_bytes() == content


def digests(out: str) -> list[str]:
    return sorted(re.findall(r"^DIGEST .*$", out, re.MULTILINE))


def test_the_ini_file_says_what_options_do_not(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text(
        "[pytest]\nmirotwin_seed = 3\nmirotwin_repeat = 2\nmirotwin_artifacts = left\nmirotwin_firmware = own.ihx\n"
    )
    for suffix in (".ihx", ".map", ".cdb"):
        (tmp_path / f"own{suffix}").write_bytes(image_path().with_suffix(suffix).read_bytes())
    tests = """
def test_one(world):
    assert world.image.path.name == "own.ihx"
    assert world.seed in (3, 4)
"""
    assert "2 passed" in session(tmp_path, tests=tests).stdout
    assert "1 passed" in session(tmp_path, "--mirotwin-repeat=1").stdout
    assert "2 failed" in session(tmp_path, "--mirotwin-seed=7").stdout
    assert len(list((tmp_path / "left").iterdir())) == 2


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--mirotwin-firmware=gone.ihx", "--mirotwin-firmware: "),
        ("--mirotwin-firmware=test_mine.py", "is not Intel HEX"),
        ("--mirotwin-seed=-1", "--mirotwin-seed: -1: give 0 or more"),
        ("--mirotwin-repeat=0", "--mirotwin-repeat: 0 is too few; give 1 or more"),
        ("--mirotwin-artifacts=test_mine.py", "test_mine.py is no folder"),
        ("-o", "mirotwin_seed: 'x' is no whole number"),
    ],
)
def test_an_option_that_cannot_be_is_a_usage_error(tmp_path: Path, option: str, said: str) -> None:
    arguments = [option, "mirotwin_seed=x"] if option == "-o" else [option]
    done = session(tmp_path, *arguments, tests="def test_one(world):\n    pass\n")
    assert done.returncode == 4
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_session_without_worlds_imports_nothing_else_of_ours(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(
        "import sys\n"
        "def pytest_unconfigure():\n"
        "    print('LOADED', sorted(n for n in sys.modules if n.split('.')[0].startswith('miro')))\n"
    )
    tests = "import sys\ndef test_one(tmp_path):\n    pass\n"
    (tmp_path / "test_mine.py").write_text(tests)
    out = session(tmp_path, "-s").stdout
    assert "LOADED ['mirotwin', 'mirotwin.pytest_plugin']" in out


def test_the_help_names_options_and_the_marker(tmp_path: Path) -> None:
    out = session(tmp_path, "--help").stdout + session(tmp_path, "--markers").stdout
    for word in (
        "--mirotwin-firmware",
        "--mirotwin-repeat",
        "mirotwin_artifacts",
        "@pytest.mark.mirotwin(scenario=",
    ):
        assert word in out
    assert "its wheels" not in session(tmp_path, "--fixtures").stderr


@needs_sdcc
def test_the_line_of_a_planted_mistake_reproduces_it_and_its_cure_passes(tmp_path: Path) -> None:
    image = planted(
        tmp_path / "bad", "failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)"
    )
    tests = """
def test_the_failsafe_stops_both_wheels(link, robot):
    link.drive({0: (500, 500)}, ms(100))
    link.send(velocities={0: (500, 500)})
    robot.break_at("motion_stop", within=ms(111))

@pytest.mark.mirotwin(expect={"failsafe_stop_ms": True})
def test_the_same_by_a_check(link, world):
    link.send(velocities={0: (500, 500)})
    world.run_for(ms(200))
"""
    options = ["--mirotwin-firmware", image.path.relative_to(tmp_path), "--mirotwin-artifacts=left"]
    failed = session(tmp_path, *options, tests=tests)
    assert failed.returncode == 1
    assert "2 failed" in failed.stdout
    assert "motion_stop was not reached within 111 ms" in failed.stdout
    (line, _) = re.findall(r"^  (pytest .*)$", failed.stdout, re.MULTILINE)
    (replay,) = re.findall(r"^  (mirotwin .*)$", failed.stdout, re.MULTILINE)
    assert replay.endswith("/case.stream --firmware bad/out/miro.ihx")
    replayed = run(tmp_path, replay)
    assert replayed.returncode == 1
    assert "fails as recorded: failsafe_stop_ms" in replayed.stderr
    cured = run(tmp_path, replay.replace("bad/out/miro.ihx", str(image_path())))
    assert cured.returncode == 0
    assert line.endswith("--mirotwin-seed 0 --mirotwin-firmware bad/out/miro.ihx")
    again = run(tmp_path, line)
    assert again.returncode == 1
    assert "motion_stop was not reached within 111 ms" in again.stdout
    assert session(tmp_path).returncode == 0


def test_coverage_counts_the_same_however_the_tests_are_spread(tmp_path: Path) -> None:
    tests = "@pytest.mark.parametrize('n', range(3))\ndef test_one(link, n):\n    link.poll(0)\n"
    counts = []
    for spread in ([], ["-n", "2"]):
        done = session(tmp_path, "--firmware-coverage=fw.info", *spread, tests=tests)
        assert done.returncode == 0, done.stdout
        counts.append((tmp_path / "fw.info").read_text())
    assert counts[0] == counts[1]
    assert "FNDA:3,_main" in counts[0]
