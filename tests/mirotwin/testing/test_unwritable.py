"""Where nothing can be left: the verdict is told first, and why there are no files is one line."""

import json
import os
import shutil
from pathlib import Path
from textwrap import dedent

import pytest

from tests.mirotwin import program
from tests.mirotwin.testing.sessions import session
from tests.mirotwin.testing.test_test_command import CHECKED, GOOD, LATE

FAILS = """
def test_asserts(world):
    world.run_for(ms(5))
    answer = 41
    assert answer == 42, "the answer"

def test_passes(world):
    world.run_for(ms(5))
"""
NOWHERE = pytest.mark.skipif(
    not Path("/proc").is_dir(), reason="this system has no folder that takes nothing"
)


@NOWHERE
@pytest.mark.parametrize("workers", [(), ("-p", "xdist", "-n", 2)], ids=["one process", "two workers"])
@pytest.mark.parametrize("more", [(), ("--mirotwin-pages",)], ids=["", "pages"])
def test_pytest_shows_the_failure(tmp_path, workers, more):
    done = session(
        tmp_path, "--mirotwin-artifacts=/proc/nope", *workers, *more, tests=FAILS, child=bool(workers)
    )
    assert (done.returncode, "INTERNALERROR" in done.stdout + done.stderr) == (1, False)
    assert "1 failed, 1 passed" in done.stdout
    assert "AssertionError: the answer" in done.stdout
    assert done.stdout.count("nothing could be left in /proc/nope/test_mine.py-test_asserts-") == 1


def test_a_file_in_the_place_of_a_tests_folder_costs_its_files_only(tmp_path):
    arguments = ("--mirotwin-artifacts=left",)
    session(tmp_path, *arguments, tests=FAILS)
    (folder,) = (tmp_path / "left").iterdir()
    shutil.rmtree(folder)
    folder.write_text("of another tool")
    done = session(tmp_path, *arguments)
    assert (done.returncode, folder.read_text()) == (1, "of another tool")
    assert f"nothing could be left in {folder}: Not a directory" in done.stdout


def test_the_story_of_a_failed_assertion_has_it_and_its_place(tmp_path):
    session(tmp_path, "--mirotwin-artifacts=left", tests=FAILS)
    (folder,) = (tmp_path / "left").iterdir()
    lines = (folder / "report.txt").read_text().splitlines()
    assert "failed: test_mine.py:8: AssertionError: the answer" in lines
    assert json.loads((folder / "summary.json").read_text())["failed"] == []


def test_the_story_of_a_test_that_checks_fail_has_no_place_in_our_own_files(tmp_path):
    tests = """
        @pytest.mark.mirotwin(expect={"frames_accepted_min": 9, "moves_only_when_fresh": True})
        def test_waits(world):
            world.run_for(ms(5))
    """
    session(tmp_path, "--mirotwin-artifacts=left", tests=dedent(tests))
    story = next((tmp_path / "left").rglob("report.txt")).read_text()
    assert story.count("expectation failed: frames_accepted_min") == 1
    assert "\nexpectation not judged: moves_only_when_fresh: the run had no occasion for it\n" in story
    assert "items.py" not in story


def test_a_test_below_a_folder_that_is_not_utf8_leaves_its_files(tmp_path):
    folder = tmp_path / os.fsdecode(b"n\xff")
    folder.mkdir()
    done = session(folder, "--mirotwin-artifacts=left", tests=FAILS)
    assert (done.returncode, "INTERNALERROR" in done.stdout + done.stderr) == (1, False)
    assert [path.name for path in folder.rglob("report.txt")] == ["report.txt"]
    (tmp_path / "pytest.ini").touch()
    done = session(tmp_path, "--mirotwin-artifacts=left", f"{folder}/test_mine.py")
    assert (done.returncode, "INTERNALERROR" in done.stdout + done.stderr) == (1, False)
    assert [path.name for path in (tmp_path / "left").rglob("report.txt")] == ["report.txt"]


@pytest.mark.slow
def test_the_page_of_a_failed_assertion_says_that_no_check_failed(tmp_path):
    session(tmp_path, "--mirotwin-artifacts=left", "--mirotwin-pages", tests=FAILS)
    page = next((tmp_path / "left").rglob("report.html")).read_text()
    assert "<strong>failed</strong><span>no check, but what its report says; 5 checks</span>" in page
    assert "failed: test_mine.py:8: AssertionError: the answer" in page


@NOWHERE
@pytest.mark.parametrize(
    ("text", "code", "word"), [(LATE, 1, "FAILED"), (CHECKED, 1, "FAILED"), (GOOD, 0, "passed")]
)
def test_a_scenario_keeps_its_verdict(mirotwin, tmp_path, monkeypatch, text, code, word):
    monkeypatch.chdir(tmp_path)
    Path("a.scenario.toml").write_text(text)
    found, out, err = mirotwin("test", "a.scenario.toml", "--artifacts", "/proc/nope")
    assert (found, err, out.startswith(f"{word}  a.scenario.toml")) == (code, "", True)
    said = "    nothing could be left in /proc/nope/a: No such file or directory; choose another folder"
    assert out.splitlines().count(said) == bool(code)
    assert "left in /proc/nope/a\n" not in out.replace(said, "")
    done = session(tmp_path, "a.scenario.toml", "--mirotwin-artifacts=/proc/nope")
    assert (done.returncode, "nothing could be left" in done.stdout) == (code, bool(code))


@NOWHERE
def test_a_world_that_was_to_be_kept_and_is_not_is_an_error(mirotwin, tmp_path):
    file = tmp_path / "a.scenario.toml"
    file.write_text('scenario = "silent"\nduration_s = 0.2\n[[step]]\nsave = "a.world"\n')
    code, out, _ = mirotwin("test", file, "--artifacts", "/proc/nope")
    assert (code, out.startswith("ERROR"), "nothing could be left in /proc/nope" in out) == (2, True, True)


def test_verdicts_are_told_before_their_file_is_written(tmp_path):
    (tmp_path / "a.scenario.toml").write_text(LATE)
    for command in (("test", "a.scenario.toml"), ("conform", "--rule", "P29")):
        words = (*command, "--junit", "j.xml")
        done = program.run(*words, cwd=tmp_path, preexec_fn=program.full_disk(10))
        assert (done.returncode, "Traceback" in done.stderr) == (2, False)
        assert "FAILED  a.scenario.toml" in done.stdout or "P29   stop  passed" in done.stdout
        assert "j.xml: File too large" in done.stderr
        assert not (tmp_path / "j.xml").exists()


@pytest.mark.slow
def test_coverage_that_cannot_be_written_is_told_after_the_tests(tmp_path):
    tests = "def test_passes(world):\n    Path('cov').chmod(0o700)\n    import shutil; shutil.rmtree('cov')\n"
    (tmp_path / "cov").mkdir()
    done = session(tmp_path, "--firmware-coverage=cov/fw.info", tests="from pathlib import Path\n" + tests)
    assert (done.returncode, "INTERNALERROR" in done.stdout + done.stderr) == (4, False)
    assert "1 passed" in done.stdout
    assert "coverage of miro.ihx, cannot be written: " in done.stdout
