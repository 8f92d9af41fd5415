"""The pytest plugin as a user has it: sessions with fixtures, options, scenario files and firmware coverage."""

import json
import re
import shlex
import shutil
from xml.etree import ElementTree

import pytest

from miro_robot.firmware import image_path
from mirotwin.testing import starter
from mirotwin.verify.cases.artifacts import image_beside
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
    assert "During handling of the above exception" not in out


@pytest.mark.parametrize(
    "line",
    [
        "E       mirotwin.testing.waiting.WaitFailed: no answer within 40 ms, from tick",
        "expectation failed: frames_accepted_min: net0/robot0: tick 1601600 (66.733 ms): wanted at least 9",
        "test_mine.py::test_has_a_marker_with_a_mistake: @pytest.mark.mirotwin: there is no key 'scnario'; did you",
        "test_mine.py::test_has_no_firmware: gone.ihx: there is no such file; build it, or give the path",
        "last_lef: there is no such variable; did you mean last_left",
        "no symbol motion_stap in the code; did you mean motion_stop",
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
    named = {
        case.get("name"): {one.get("name"): one.get("value") for one in case.iter("property")}
        for case in ElementTree.parse(mixed / "junit.xml").iter("testcase")
    }
    facts = named["test_passes"]
    assert facts["mirotwin_seed"] == "0"
    assert re.fullmatch("[0-9a-f]{64}", str(facts["mirotwin_digest"]))
    assert re.fullmatch("[0-9a-f]{64}", str(facts["mirotwin_firmware_sha256"]))
    assert named["test_is_judged[1]"]["mirotwin_reproduce"] == (
        "pytest 'test_mine.py::test_is_judged[1]' --mirotwin-seed 4"
    )
    assert named["test_needs_no_world"] == {}
    asserts = named["test_asserts"]
    assert (asserts["mirotwin_file"], "mirotwin_at_ms" in asserts) == ("test_mine.py", False)
    assert (mixed / "test_mine.py").read_text().splitlines()[int(asserts["mirotwin_line"]) - 1].split()[
        0
    ] == "assert"


@pytest.mark.parametrize("name", ["test_waits_in_vain", "test_is_judged[1]"])
def test_junit_has_the_c_line_at_which_the_debugger_stands(mixed, name):
    (case,) = [
        one for one in ElementTree.parse(mixed / "junit.xml").iter("testcase") if one.get("name") == name
    ]
    facts = {one.get("name"): one.get("value") for one in case.iter("property")}
    done = run(mixed, f"{facts['mirotwin_debug']} -x where")
    (stands,) = re.findall(r"^\*#0 .*", done.stdout, re.MULTILINE)
    assert f" {facts['mirotwin_file']}:{facts['mirotwin_line']} in " in stands


def test_a_failed_test_leaves_a_folder_of_its_own_and_a_passing_one_nothing(mixed):
    folders = sorted(path.name for path in (mixed / "left").iterdir())
    assert len(folders) == 6
    assert not [name for name in folders if "passes" in name or "needs_no" in name]
    (judged,) = [path for path in (mixed / "left").iterdir() if "is_judged" in path.name]
    summary = json.loads((judged / "summary.json").read_text())
    assert (summary["seed"], summary["file"]) == (4, "main.c")
    assert summary["failed"][0].startswith("expectation failed: frames_accepted_min: net0/robot0")
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


# Options: seeds, repetition, firmware, ini files

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


@pytest.mark.slow
def test_repeated_tests_show_their_seeds_and_workers_clobber_nothing(tmp_path):
    options = ["-v", "-rA", "--mirotwin-repeat=4", "--mirotwin-seed=10", "--mirotwin-artifacts=left"]
    alone = session(tmp_path, *options, tests=MANY)
    assert "test_noise[2-seed13] PASSED" in alone.stdout
    assert "test_noise[1-seed12] FAILED" in alone.stdout
    assert "2 failed, 7 passed" in alone.stdout
    assert "pytest 'test_mine.py::test_noise[1]' --mirotwin-seed 12\n" in alone.stdout
    files = {path.relative_to(tmp_path): path.read_bytes() for path in (tmp_path / "left").rglob("*.json")}
    assert len(files) == 2
    spread = session(tmp_path, *options, "-n", "2", child=True)
    assert "2 failed, 7 passed" in spread.stdout
    assert digests(spread.stdout) == digests(alone.stdout)
    assert len(digests(alone.stdout)) == len(set(digests(alone.stdout))) == 8
    for path, content in files.items():
        assert (tmp_path / path).read_bytes() == content


def digests(out):
    return sorted(re.findall(r"^DIGEST .*$", out, re.MULTILINE))


@pytest.mark.slow
def test_the_ini_file_says_what_options_do_not(tmp_path):
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


COVERAGE = "--firmware-coverage=fw.info"
USAGE_ERRORS = {
    ("--mirotwin-firmware=gone.ihx",): "--mirotwin-firmware: ",
    ("--mirotwin-firmware=test_mine.py",): "is not Intel HEX",
    ("--mirotwin-seed=-1",): "--mirotwin-seed: -1: give 0 or more",
    ("--mirotwin-repeat=0",): "--mirotwin-repeat: 0 is too few; give 1 or more",
    ("--mirotwin-artifacts=test_mine.py",): "test_mine.py is no folder",
    ("-o", "mirotwin_seed=x"): "mirotwin_seed: 'x' is no whole number",
    (COVERAGE, "--firmware-image=gone.ihx"): "gone.ihx: there is no such file",
    ("--firmware-coverage=gone/fw.info",): "there is no folder gone",
    (COVERAGE, "--firmware-image=/dev/zero"): "/dev/zero: is not a regular file",
    (COVERAGE, "--firmware-sources=gone"): "gone: --firmware-sources: there is no such folder",
    (COVERAGE, "--firmware-coverage-fail-under=nan"): "nan is no percentage",
    (COVERAGE, "--firmware-coverage-fail-under=900"): "900.0 is no percentage",
    ("--firmware-coverage-fail-under=90",): "goes with --firmware-coverage=FILE.info",
}


@pytest.mark.parametrize("options", USAGE_ERRORS, ids=" ".join)
def test_an_option_that_cannot_be_is_a_usage_error(tmp_path, options):
    done = session(tmp_path, *options, tests="def test_one(world):\n    pass\n")
    assert done.returncode == 4
    assert USAGE_ERRORS[options] in done.stderr
    assert "Traceback" not in done.stderr


def test_a_session_without_worlds_imports_nothing_else_of_ours(tmp_path):
    (tmp_path / "conftest.py").write_text(
        "import sys\n"
        "def pytest_unconfigure():\n"
        "    print('LOADED', sorted(n for n in sys.modules if n.split('.')[0].startswith('miro')))\n"
    )
    (tmp_path / "test_mine.py").write_text("def test_one(tmp_path):\n    pass\n")
    out = session(tmp_path, "-s", child=True).stdout
    names_of_checks = ["conform", "verify", "verify.checks"]
    plugin = ["testing", "testing.pytest_plugin", "testing.session_options"]
    loaded = ["mirotwin", *(f"mirotwin.{name}" for name in sorted([*names_of_checks, *plugin]))]
    assert f"LOADED {loaded}" in out


@pytest.mark.slow
def test_the_help_names_options_and_the_marker(tmp_path):
    out = session(tmp_path, "--help").stdout + session(tmp_path, "--markers").stdout
    for word in ("--mirotwin-firmware", "--mirotwin-repeat", "mirotwin_artifacts"):
        assert word in out
    assert "@pytest.mark.mirotwin(scenario=" in out
    assert "its wheels" not in session(tmp_path, "--fixtures").stderr


@pytest.mark.slow
def test_a_scenario_with_steps_is_no_world_for_a_test_in_python(tmp_path):
    (tmp_path / "a.scenario.toml").write_text('scenario = "silent"\n\n[[step]]\npause_ms = 5\n')
    tests = """
@pytest.mark.mirotwin(scenario="a.scenario.toml")
def test_it(world):
    pass
"""
    out = session(tmp_path, "test_mine.py", tests=tests).stdout
    assert "1 error" in out
    assert "has 1 step, which a test in Python does not do" in out


@pytest.mark.slow
def test_a_folder_of_artifacts_replays_where_the_image_is_gone(tmp_path):
    (tmp_path / "session").mkdir()
    for suffix in (".ihx", ".map", ".cdb", ".rst"):
        shutil.copy(image_path().with_suffix(suffix), tmp_path / "session" / f"mine{suffix}")
    tests = """
@pytest.mark.mirotwin(expect={"frames_accepted_min": 9})
def test_counts(link):
    link.drive({0: (500, 500)}, ms(100))
"""
    options = ["--mirotwin-firmware", "mine.ihx", "--mirotwin-artifacts=left"]
    failed = session(tmp_path / "session", *options, tests=tests)
    line, _ = re.findall(r"^  (mirotwin .*)$", failed.stdout, re.MULTILINE)
    shutil.move(tmp_path / "session" / "left", tmp_path / "elsewhere" / "left")
    shutil.rmtree(tmp_path / "session")
    (folder,) = (tmp_path / "elsewhere" / "left").iterdir()
    beside = ["firmware.cdb", "firmware.ihx", "firmware.map", "firmware.rst"]
    assert sorted(path.name for path in folder.iterdir()) == [
        *("case.stream", *beside, "report.txt", "summary.json")
    ]
    for command in (line, f"mirotwin replay {folder / 'case.stream'}"):
        done = run(tmp_path / "elsewhere", command)
        assert done.returncode == 1, done.stderr
        assert "fails as recorded: frames_accepted_min" in done.stderr


@pytest.mark.slow
def test_the_printed_lines_name_the_firmware_and_another_one_cures_the_case(tmp_path):
    shutil.copy(starter.folder() / "firmware" / "late.ihx", tmp_path)
    tests = """
@pytest.mark.mirotwin(expect={"failsafe_stop_ms": True})
def test_stops(link, world):
    link.send(velocities={0: (500, 500)})
    world.run_for(ms(200))
"""
    options = ["--mirotwin-firmware=late.ihx", "--mirotwin-artifacts=left"]
    failed = session(tmp_path, *options, tests=tests)
    (line,) = re.findall(r"^  (pytest .*)$", failed.stdout, re.MULTILINE)
    assert line.endswith("--mirotwin-seed 0 --mirotwin-firmware late.ihx")
    assert "1 failed" in run(tmp_path, line).stdout
    replay, debug = re.findall(r"^  (mirotwin .*)$", failed.stdout, re.MULTILINE)
    assert debug == replay.replace("mirotwin replay", "mirotwin debug")
    assert "fails as recorded: failsafe_stop_ms" in run(tmp_path, replay).stderr
    case, _, _ = replay.partition(" --firmware ")
    assert run(tmp_path, f"{case} --firmware {image_path()}").returncode == 0


def test_an_image_beside_a_case_that_is_another_one_is_not_taken(tmp_path):
    (tmp_path / "case.stream").write_text("")
    (tmp_path / "firmware.ihx").write_text(":00000001FF\n")
    assert image_beside(tmp_path / "case.stream", "00" * 32) is None
    assert image_beside(tmp_path / "case.stream", None) is None


# Scenario files are tests

SILENT = 'scenario = "silent"\nduration_s = 0.3\n'
GOOD = SILENT + 'step = [{ pause_ms = 5 }, { send = "poll" }, { expect = "answer", within_ms = 60 }]\n'


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory):
    folder = tmp_path_factory.mktemp("session")
    (folder / "pytest.ini").write_text("[pytest]\n")
    (folder / "good.scenario.toml").write_text(GOOD)
    (folder / "late.scenario.toml").write_text(GOOD.replace("60", "20"))
    (folder / "wrong.scenario.toml").write_text(GOOD.replace("within_ms", "within_s"))
    return folder


@pytest.mark.slow
def test_each_file_is_a_test_and_a_failure_is_its_line_without_a_traceback(scenarios):
    done = session(scenarios, "-p", "no:xdist", "--junitxml=out.xml")
    assert done.returncode == 1, done.stdout
    assert "2 failed, 1 passed" in done.stdout
    assert (
        "\nstep failed: step 3: expect answer: tick 600000 (25.000 ms): wanted answer within 20 ms, "
        in done.stdout
    )
    assert (
        "\nwrong.scenario.toml: step 3.within_s: unknown key; use within_ms, in milliseconds\n" in done.stdout
    )
    assert "\nagain: mirotwin test late.scenario.toml\n" in done.stdout
    assert "Traceback" not in done.stdout
    assert ".py:" not in done.stdout
    (suite,) = ElementTree.parse(scenarios / "out.xml").getroot()
    names = {one.get("name") for one in suite.iter("property")}
    facts = {"seed", "digest", "firmware_sha256", "reproduce", "tick", "at_ms", "file", "line"}
    assert names == {f"mirotwin_{name}" for name in facts}


@pytest.mark.slow
def test_tests_are_chosen_spread_over_processes_and_begun_again_with_the_last_failed(scenarios):
    assert "1 passed" in session(scenarios, "-k", "good", "-n", "1", child=True).stdout
    assert session(scenarios, "-p", "no:xdist").returncode == 1
    assert "2 failed" in session(scenarios, "--lf", "-p", "no:xdist").stdout
    assert "good.scenario.toml::good" in session(scenarios, "-q", "--collect-only", "-p", "no:xdist").stdout


# Firmware coverage of other people's test sessions

TESTS = """
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.world import World

def test_reset():
    World(BoardScenario(), 0, load_hex(image_path())).run_to(12 * 2000)

def test_longer():
    World(BoardScenario(), 0, load_hex(image_path())).run_to(12 * 20000)

def test_other_firmware_does_not_count():
    cpu = Cpu(Bus())
    cpu.load(bytes(64))
    cpu.run(10)
    assert cpu.inspector is None
"""


COUNTS = """
from mirotwin.firmware import coverage_files as firmware_coverage

collect = firmware_coverage.collect

def counted(*arguments):
    with open("collected", "a") as file:
        file.write("once\\n")
    return collect(*arguments)

firmware_coverage.collect = counted
"""


def counted(folder, *arguments, child=False):
    done = session(folder, COVERAGE, *arguments, tests=TESTS, child=child)
    assert done.returncode == 0, done.stdout
    assert "coverage of miro.ihx, written to fw.info" in done.stdout
    return (folder / "fw.info").read_text()


@pytest.mark.slow
def test_a_session_counts_what_all_its_tests_ran_also_in_several_processes_and_writes_once(tmp_path):
    alone = counted(tmp_path)
    assert "FNDA:2,_main" in alone
    assert alone != counted(tmp_path, "-k", "reset")
    (tmp_path / "conftest.py").write_text(COUNTS)
    assert alone == counted(tmp_path, "-n", "2", child=True)
    assert (tmp_path / "collected").read_text() == "once\n"


@pytest.mark.slow
def test_a_session_fails_under_the_share_that_was_asked_for(tmp_path):
    wanted = (COVERAGE, "--firmware-coverage-fail-under")
    assert session(tmp_path, *wanted, "5", tests=TESTS).returncode == 0
    failed = session(tmp_path, *wanted, "99")
    assert failed.returncode == 1
    assert "3 passed" in failed.stdout
    assert "fewer lines ran than the 99.0 %" in failed.stdout


BREAKS = """
import os

def pytest_runtest_setup(item):
    if os.environ.get("BREAK") == "off":
        raise KeyboardInterrupt

def pytest_runtestloop(session):
    if os.environ.get("BREAK") == "down":
        raise RuntimeError("a plugin's own")
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "how", "code"),
    [(["gone.py"], "", 4), (["-k", "gone"], "", 5), ([], "off", 2), ([], "down", 3)],
)
def test_too_few_lines_do_not_hide_what_else_went_wrong(tmp_path, monkeypatch, arguments, how, code):
    """pytest: 2 interrupted, 3 an internal error, 4 a usage error, 5 no tests."""
    (tmp_path / "conftest.py").write_text(BREAKS)
    monkeypatch.setenv("BREAK", how)
    done = session(tmp_path, COVERAGE, "--firmware-coverage-fail-under=99", *arguments, tests=TESTS)
    assert done.returncode == code, done.stdout + done.stderr


@pytest.mark.slow
def test_collecting_tests_writes_nothing(tmp_path):
    done = session(tmp_path, COVERAGE, "--collect-only", tests=TESTS)
    assert done.returncode == 0
    assert not (tmp_path / "fw.info").exists()
