"""The options of the pytest plugin: seeds, repetition, firmware, ini files, coverage beside them."""

import re
import shutil

import pytest

from miro_robot.firmware import image_path
from mirotwin.verify.cases.artifacts import image_beside
from tests.mirotwin.testing.sessions import run, session
from tests.mirotwin.verify.checks.rig import built_in, needs_sdcc

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
def test_an_option_that_cannot_be_is_a_usage_error(tmp_path, option, said):
    arguments = [option, "mirotwin_seed=x"] if option == "-o" else [option]
    done = session(tmp_path, *arguments, tests="def test_one(world):\n    pass\n")
    assert done.returncode == 4
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_session_without_worlds_imports_nothing_else_of_ours(tmp_path):
    (tmp_path / "conftest.py").write_text(
        "import sys\n"
        "def pytest_unconfigure():\n"
        "    print('LOADED', sorted(n for n in sys.modules if n.split('.')[0].startswith('miro')))\n"
    )
    tests = "import sys\ndef test_one(tmp_path):\n    pass\n"
    (tmp_path / "test_mine.py").write_text(tests)
    out = session(tmp_path, "-s", child=True).stdout
    assert "LOADED ['mirotwin', 'mirotwin.testing', 'mirotwin.testing.pytest_plugin']" in out


@pytest.mark.slow
def test_the_help_names_options_and_the_marker(tmp_path):
    out = session(tmp_path, "--help").stdout + session(tmp_path, "--markers").stdout
    for word in (
        "--mirotwin-firmware",
        "--mirotwin-repeat",
        "mirotwin_artifacts",
        "@pytest.mark.mirotwin(scenario=",
    ):
        assert word in out
    assert "its wheels" not in session(tmp_path, "--fixtures").stderr


@pytest.mark.slow
@needs_sdcc
def test_the_line_of_a_planted_mistake_reproduces_it_and_its_cure_passes(tmp_path):
    image = built_in(
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
    replay, debug = re.findall(r"^  (mirotwin .*)$", failed.stdout, re.MULTILINE)
    assert debug == replay.replace("mirotwin replay", "mirotwin debug")
    left = re.search("left/[^/]+/firmware.ihx", replay)
    assert replay.endswith(f"/case.stream --firmware {left[0]}")
    replayed = run(tmp_path, replay)
    assert replayed.returncode == 1
    assert "fails as recorded: failsafe_stop_ms" in replayed.stderr
    cured = run(tmp_path, replay.replace(left[0], str(image_path())))
    assert cured.returncode == 0
    assert line.endswith("--mirotwin-seed 0 --mirotwin-firmware bad/out/miro.ihx")
    again = run(tmp_path, line)
    assert again.returncode == 1
    assert "motion_stop was not reached within 111 ms" in again.stdout
    assert session(tmp_path).returncode == 0


@pytest.mark.slow
def test_a_scenario_with_steps_is_no_world_for_a_test_in_python(tmp_path):
    (tmp_path / "a.scenario.toml").write_text('scenario = "silent"\n\n[[step]]\npause_ms = 5\n')
    tests = """
import pytest

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
    for suffix in (".ihx", ".map", ".cdb"):
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
    assert sorted(path.name for path in folder.iterdir()) == [
        "case.stream",
        "firmware.cdb",
        "firmware.ihx",
        "firmware.map",
        "report.txt",
        "summary.json",
    ]
    for command in (line, f"mirotwin replay {folder / 'case.stream'}"):
        done = run(tmp_path / "elsewhere", command)
        assert done.returncode == 1, done.stderr
        assert "fails as recorded: frames_accepted_min" in done.stderr


def test_an_image_beside_a_case_that_is_another_one_is_not_taken(tmp_path):
    (tmp_path / "case.stream").write_text("")
    (tmp_path / "firmware.ihx").write_text(":00000001FF\n")
    assert image_beside(tmp_path / "case.stream", "00" * 32) is None
    assert image_beside(tmp_path / "case.stream", None) is None
