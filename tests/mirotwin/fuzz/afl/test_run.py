"""Campaigns of the real afl-fuzz with a target of a few branches."""

import os
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.table import FrameType
from mirotwin.fuzz.afl.run import AflRun
from mirotwin.fuzz.engine import EngineInput, read_executions, write_seeds
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.spec import TargetSpec
from tests import children
from tests.mirotwin.fuzz.afl.double import ROOT, WORD, Double, spec

pytestmark = pytest.mark.skipif(
    shutil.which("afl-fuzz") is None and not os.environ.get("CI"), reason="needs AFL++"
)
PATIENCE_S = 60.0


@pytest.fixture(autouse=True)
def _modules_for_the_target(monkeypatch):
    """The target process imports the double from the tests' folder."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))


def campaign(folder, inputs=(b"hello",), **named):
    """A campaign in `folder`; what is named for the double goes to it."""
    write_seeds(folder / "seeds", inputs)
    own = {key: named.pop(key) for key in ("kind", "raises", "sleeps", "always") if key in named}
    return AflRun(
        EngineInput(spec(**own).text(), folder / "seeds", folder / "out", seed=1, **named), Double()
    )


def until(true, what):
    """Waits for it, and returns what it is."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        if found := true():
            return found
        time.sleep(0.05)
    raise AssertionError(f"waited {PATIENCE_S:.0f} s for {what}")


@pytest.fixture
def found(tmp_path):
    """A campaign that has found the word, and the input with it."""
    with campaign(tmp_path) as run:
        yield run, until(run.new_crashes, "a crash")[0]


def test_afl_finds_the_word_by_its_branches(found):
    run, crash = found
    assert crash.read_bytes().startswith(WORD)
    assert "sig:34" in crash.name, "a crash of kind 2"
    assert crash not in run.new_crashes(), "each is given once"
    queue = run.new_queue()
    assert queue[0].name.endswith("orig:seed-0000"), "the seed comes first"
    until(lambda: run.progress().executions > 1000, "some executions")
    assert run.progress().edges == 4, "of inputs without a crash: one, and three letters of the word"


def test_a_campaign_that_is_stopped_has_no_process_left(tmp_path):
    with campaign(tmp_path) as run:
        until(run.new_crashes, "a crash")
    assert processes_of(tmp_path) == []
    run.stop()  # does nothing


def test_two_jobs_share_what_they_find(tmp_path):
    with campaign(tmp_path, jobs=2) as run:
        until(
            lambda: all((tmp_path / "out" / name / "queue").is_dir() for name in ("main", "job1")), "queues"
        )
        until(run.new_crashes, "a crash")
        until(lambda: all(read_executions(job.counts) for job in run.jobs), "both to work")


def test_a_target_that_hangs_can_be_stopped(tmp_path):
    with campaign(tmp_path, [b"!"], sleeps=True) as run:
        until(lambda: (tmp_path / "out" / "default.counts").exists(), "the target")
        time.sleep(1.0)  # until it has the first input: AFL++ says nothing of it
        assert run.jobs[0].running
    assert processes_of(tmp_path) == []


def test_a_campaign_ends_with_its_process_however_that_ends(tmp_path):
    program = f"""
import sys, time
from pathlib import Path
from tests.mirotwin.fuzz.afl.test_run import campaign
run = campaign(Path(sys.argv[1]))
run.start()
while not run.new_queue(): time.sleep(0.05)
print("runs", flush=True)
time.sleep({PATIENCE_S})
"""
    owner = children.start(
        [sys.executable, "-c", program, tmp_path], stdout=children.subprocess.PIPE, cwd=ROOT, text=True
    )
    assert owner.stdout.readline() == "runs\n"
    assert len(processes_of(tmp_path)) == 3, "the owner, afl-fuzz and the target"
    owner.send_signal(signal.SIGKILL)
    owner.wait()
    owner.stdout.close()
    until(lambda: processes_of(tmp_path) == [], "the others to end")


def test_a_robot_is_fuzzed_from_one_frame(tmp_path):
    specification = TargetSpec(input="bytes")
    frame = encode(TeamFrame(FrameType.TEAM, 1, ((200, 200),) * 3), 3)
    write_seeds(tmp_path / "seeds", [frame])
    given = EngineInput(specification.text(), tmp_path / "seeds", tmp_path / "out")
    with AflRun(given, make_target(specification)) as run:
        first = until(lambda: run.progress().edges, "the frame's edges")
        until(lambda: (run.progress().edges or 0) > first, "an edge more")
        assert run.new_crashes() == []
    assert first > 30, "the decoder's"


# ---- what cannot be done -----------------------------------------------------------------------------------


def error_of(run):
    """What a campaign that ends at once is told to have ended of."""
    with run, pytest.raises(BadInput) as error:
        until(lambda: not run.progress(), "the end")
    return f"{error.value}"


def test_seeds_that_all_fail_are_told(tmp_path):
    said = error_of(campaign(tmp_path, always=True))
    assert "default.log: afl-fuzz ended: We need at least one valid input seed that does not crash!; " in said
    assert "each seed fails by itself" in said


def test_a_target_that_raises_is_quoted(tmp_path):
    said = error_of(campaign(tmp_path, [b"!"], raises=True))
    assert "default.target:" in said
    assert "RuntimeError: the double raises" in said


def test_a_target_that_cannot_be_made_is_quoted(tmp_path):
    write_seeds(tmp_path / "seeds", [b"a"])
    said = error_of(AflRun(EngineInput('{"board":"x"}', tmp_path / "seeds", tmp_path / "out"), Double()))
    assert "target: Invalid enum value 'x' - at `$.board`" in said


def test_a_folder_that_another_campaign_uses_is_told(tmp_path):
    with campaign(tmp_path) as first:
        until(first.new_queue, "the first")
        said = error_of(campaign(tmp_path))
        assert "is in use; another campaign runs in this folder" in said
        assert first.jobs[0].running


def test_a_folder_with_a_file_in_the_place_of_a_job_is_told(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "default").write_text("")
    assert "choose another folder" in error_of(campaign(tmp_path))


# ---- other programs of AFL++ -------------------------------------------------------------------------------

NEEDED = {"AFL_MAP_SIZE": "8192", "AFL_SKIP_BIN_CHECK": "1", "AFL_QUIET": "1"}


def showmap(*options, data=b""):
    """The exit code of afl-showmap."""
    target = [sys.executable, "-m", "mirotwin.fuzz.afl.serve", spec().text()]
    command = ["afl-showmap", "-t", "60000", *options, "--", *target]
    environment = {**os.environ, **NEEDED}
    done = children.run(command, input=data, env=environment, cwd=ROOT, capture_output=True)
    return done.returncode


def test_afl_showmap_shows_the_edges_of_one_input(tmp_path):
    assert showmap("-o", str(tmp_path / "map"), data=b"DUx") == 0
    assert (tmp_path / "map").read_text() == "000001:1\n000002:1\n000003:1\n"


def test_afl_tmin_keeps_what_fails(tmp_path):
    (tmp_path / "in").write_bytes(WORD + b"and more of it")
    target = [sys.executable, "-m", "mirotwin.fuzz.afl.serve", spec().text()]
    command = ["afl-tmin", "-i", tmp_path / "in", "-o", tmp_path / "out", "-t", "60000", "--", *target]
    children.run(command, env={**os.environ, **NEEDED}, cwd=ROOT, capture_output=True, check=True)
    assert (tmp_path / "out").read_bytes() == WORD


def processes_of(folder):
    """Processes that have the folder on their command line."""
    found = []
    for line in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            content = line.read_bytes()
        except OSError:
            continue
        if os.fsencode(folder) in content and int(line.parent.name) != os.getpid():
            found.append(int(line.parent.name))
    return found
