"""The pytest plugin: firmware coverage of other people's test sessions."""

import pytest

from tests.mirotwin.testing.sessions import session

TESTS = """
from miro_robot.bare.machine import BareMachine
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu

def test_reset():
    BareMachine(load_hex(image_path())).run(max_cycles=2000)

def test_longer():
    BareMachine(load_hex(image_path())).run(max_cycles=20000)

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
    done = session(folder, "--firmware-coverage=fw.info", *arguments, tests=TESTS, child=child)
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
    wanted = ("--firmware-coverage=fw.info", "--firmware-coverage-fail-under")
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
    done = session(
        tmp_path, "--firmware-coverage=fw.info", "--firmware-coverage-fail-under=99", *arguments, tests=TESTS
    )
    assert done.returncode == code, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--firmware-image=gone.ihx", "gone.ihx: there is no such file"),
        ("--firmware-coverage=gone/fw.info", "there is no folder gone"),
        ("--firmware-image=/dev/zero", "/dev/zero: is not a regular file"),
        ("--firmware-sources=gone", "gone: --firmware-sources: there is no such folder"),
        ("--firmware-coverage-fail-under=nan", "nan is no percentage"),
        ("--firmware-coverage-fail-under=900", "900.0 is no percentage"),
    ],
)
def test_bad_input_is_a_usage_error(tmp_path, option, said):
    done = session(tmp_path, "--firmware-coverage=fw.info", option, tests=TESTS)
    assert done.returncode == 4
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_share_without_a_tracefile_is_a_usage_error(tmp_path):
    done = session(tmp_path, "--firmware-coverage-fail-under=90", tests=TESTS)
    assert done.returncode == 4
    assert "goes with --firmware-coverage=FILE.info" in done.stderr


@pytest.mark.slow
def test_collecting_tests_writes_nothing(tmp_path):
    done = session(tmp_path, "--firmware-coverage=fw.info", "--collect-only", tests=TESTS)
    assert done.returncode == 0
    assert not (tmp_path / "fw.info").exists()
