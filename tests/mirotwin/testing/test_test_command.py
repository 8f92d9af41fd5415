"""`mirotwin test`: which files are tests, their verdicts, what a failure leaves, and saved failures run again."""

import json
import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mirotwin.fuzz.oracle import RobotOracle
from mirotwin.fuzz.target import RobotTarget
from mirotwin.report.page import document
from mirotwin.runs.test_file import collect
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.checks.rig import needs_sdcc, planted
from tests.mirotwin.verify.own_checks import source_of

ROOT = Path(__file__).parents[3]
HEAD = 'scenario = "silent"\nduration_s = 0.5\n'
TOO_SOON = "step 3 (too soon): expect answer: tick 600000 (25.000 ms):"
GOOD = (
    HEAD
    + 'step = [{ pause_ms = 5 }, { send = "poll" }, { expect = "answer", accepted = 1, within_ms = 60 }]\n'
)
LATE = GOOD.replace("accepted = 1, within_ms = 60", "within_ms = 20, note = 'too soon'")
OTHER = GOOD.replace("accepted = 1", "accepted = 2")
BAD = GOOD.replace("within_ms", "within_s")
CHECKED = (
    HEAD + "expect.failsafe_stop_ms = 100.0\nstep = [{ pause_ms = 5 }, { send = 'team', left_m_s = 0.2 }]\n"
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """`hil` with a test that passes, one that fails and one that cannot be run; the current folder is above it."""
    monkeypatch.chdir(tmp_path)
    for name, text in {"a": GOOD, "sub/b": LATE, "sub/c": BAD, "sub/d": CHECKED, "sub/e": OTHER}.items():
        path = tmp_path / "hil" / f"{name}.scenario.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "hil" / "notes.toml").write_text("")
    return tmp_path


def test_each_file_has_a_line_with_its_verdict_and_one_for_each_failure(mirotwin, folder):
    code, out, err = mirotwin("test", "hil")
    lines = out.splitlines()
    assert (code, err) == (2, "")
    assert lines[0].startswith("passed  hil/a.scenario.toml (3 of 3 steps, 500.500 ms, digest ")
    assert lines[1].startswith("FAILED  hil/sub/b.scenario.toml (2 of 3 steps, ")
    assert lines[2].startswith(f"    step failed: {TOO_SOON} wanted answer within 20 ms, found only ")
    assert lines[3:5] == [f"    mirotwin {verb} hil/sub/b.scenario.toml" for verb in ("debug", "test")]
    assert lines[5] == "ERROR  hil/sub/c.scenario.toml"
    assert lines[6].endswith("c.scenario.toml: step 3.within_s: unknown key; use within_ms, in milliseconds")
    assert lines[8].startswith("    expectation failed: failsafe_stop_ms: net0/robot0: tick ")
    assert lines[-1] == "1 cannot be run, 3 failed, 1 passed"


@pytest.mark.parametrize(
    ("names", "code"),
    [(["a"], 0), (["a", "sub/b"], 1), (["sub/d"], 1), (["sub/c", "sub/b"], 2), (["sub/c"], 2)],
)
def test_the_worst_verdict_is_the_exit_code(mirotwin, folder, names, code):
    assert mirotwin("test", *[f"hil/{name}.scenario.toml" for name in names])[0] == code


def test_a_firmware_fault_is_exit_code_3(mirotwin, folder):
    hex_file(folder / "bad.ihx", b"\xa5")
    code, out, _ = mirotwin("test", "hil/a.scenario.toml", "--firmware", "bad.ihx")
    assert code == 3
    assert out.startswith("FAULT  hil/a.scenario.toml (1 of 3 steps")
    assert "firmware fault: net0/robot0: " in out
    assert "a firmware fault has stopped the run" in out


NO_TEST = {
    ("empty",): "empty: no *.scenario.toml or *.stream there; nothing was tested",
    ("hil", "-k", "zzz"): "hil: 5 files, none with 'zzz' in its path; nothing was tested",
    ("none",): "none: there is no such file or folder; name a folder, or a *.scenario.toml or *.stream",
    ("hil/notes.toml",): "hil/notes.toml: is no *.scenario.toml or *.stream; rename it",
    ("hil", "--firmware", "none.ihx"): "none.ihx: there is no such file",
    ("hil", "--junit", "hil/a.scenario.toml"): "hil/a.scenario.toml: is the input itself; choose another",
}


@pytest.mark.parametrize("arguments", NO_TEST, ids=" ".join)
def test_nothing_to_test_is_bad_input(mirotwin, folder, arguments):
    (folder / "empty").mkdir()
    assert mirotwin.refuses("test", *arguments).startswith(NO_TEST[arguments])


def test_no_path_at_all_is_bad_input(mirotwin):
    assert mirotwin("test")[0] == 2


def test_a_word_chooses_files_and_settings_hold_for_all(mirotwin, folder):
    code, out, _ = mirotwin("test", "hil", "-k", "HIL/A", "--set", "duration_s=0.2", "--seed", 3)
    assert code == 0
    assert out.splitlines()[0].startswith("passed  hil/a.scenario.toml (3 of 3 steps, 200.200 ms")
    code, out, _ = mirotwin("test", "hil", "-k", "hil/a", "--set", "duration_s=-1")
    assert code == 2
    assert "--set duration_s=-1: -1 is out of range" in out


def test_files_are_collected_once_in_the_order_of_their_paths(folder):
    names = [f"hil/{name}.scenario.toml" for name in ("a", "sub/b", "sub/c", "sub/d", "sub/e")]
    assert collect(["hil"]) == names
    assert collect(["hil/sub/e.scenario.toml", "hil", "hil"]) == [names[-1], *names[:-1]]
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "hil" / "pipe.scenario.toml")
    hidden = folder / "hil" / ".git"
    hidden.mkdir()
    (hidden / "x.scenario.toml").write_text(GOOD)
    assert collect(["hil"]) == names


def test_json_is_one_document_with_a_case_a_file(mirotwin, folder):
    code, out, err = mirotwin("test", "hil", "--json", "--artifacts", "left")
    document = json.loads(out)
    assert (code, err, document["verdict"], document["exit_code"]) == (2, "", "error", 2)
    cases = {case["name"]: case for case in document["cases"]}
    assert [(name, case["verdict"]) for name, case in cases.items()] == [
        ("a", "passed"),
        ("b", "failed"),
        ("c", "error"),
        ("d", "failed"),
        ("e", "failed"),
    ]
    assert cases["c"]["lines"][0].endswith("unknown key; use within_ms, in milliseconds")
    assert (cases["b"]["tick"], cases["b"]["at_ms"]) == (600000, 25.0)
    assert cases["b"]["replay"] == "mirotwin replay left/hil-sub-b/case.stream"


@pytest.mark.parametrize("name", ["b", "d"])
def test_a_failure_has_the_c_line_at_which_the_debugger_stands(mirotwin, folder, name):
    _, out, _ = mirotwin("test", f"hil/sub/{name}.scenario.toml", "--json", "--artifacts", "left")
    (case,) = json.loads(out)["cases"]
    _, out, _ = mirotwin(*case["debug"].split()[1:], "-x", "where")
    stands = next(line for line in out.splitlines() if line.startswith("*#0"))
    assert f" {case['file']}:{case['line']} in " in stands
    _, out, _ = mirotwin("test", "left", "--json")
    (again,) = json.loads(out)["cases"]
    assert (again["tick"], again["file"], again["line"]) == (case["tick"], case["file"], case["line"])


def test_junit_has_each_test_with_what_gives_it_again(mirotwin, folder):
    mirotwin("test", "hil", "--junit", "out.xml", "--seed", 4, "--set", "duration_s=0.4")
    (suite,) = ElementTree.parse(folder / "out.xml").getroot()
    assert [suite.get(key) for key in ("tests", "failures", "errors")] == ["5", "3", "1"]
    cases = {case.get("name"): case for case in suite}
    assert cases["b"].get("classname") == "hil.sub"
    failure = cases["b"].find("failure")
    assert failure.get("message", "").startswith(f"step failed: {TOO_SOON}")
    properties = {one.get("name"): one.get("value") for one in cases["b"].iter("property")}
    again = "mirotwin test hil/sub/b.scenario.toml --seed 4 --set duration_s=0.4"
    assert properties["reproduce"] == again
    assert len(properties["digest"] or "") == 64
    code, out, _ = mirotwin(*again.split()[1:])
    assert code == 1
    assert f"    {failure.get('message')}" in out.splitlines()


def test_a_failure_leaves_a_case_whose_replay_gives_line_and_exit_code(mirotwin, folder):
    code, out, _ = mirotwin("test", "hil", "--artifacts", "left", "--set", "duration_s=0.4")
    assert code == 2
    assert "    left in left/hil-sub-b" in out.splitlines()
    assert {path.name for path in (folder / "left").iterdir()} == {"hil-sub-b", "hil-sub-d", "hil-sub-e"}
    for name, check in (
        ("b", "happens: net0/robot0: tick 600000 "),
        ("d", "failsafe_stop_ms: net0/robot0: "),
    ):
        err = mirotwin.ends(1, "replay", f"left/hil-sub-{name}/case.stream", "-q")
        assert err.startswith(f"mirotwin: fails as recorded: {check}")
    assert not (folder / "left/hil-sub-e/case.stream").exists()  # no check knows an answer's fields
    report = (folder / "left/hil-sub-e/report.txt").read_text().splitlines()
    err = mirotwin.ends(1, "run", "left/hil-sub-e/scenario.toml", "--out", "again", "-q", "--no-figure")
    assert err == f"mirotwin: {report[1]}\n"
    assert report[-1] == "mirotwin test hil/sub/e.scenario.toml --set duration_s=0.4"


def test_a_folder_is_cleared_once_its_test_passes(mirotwin, folder):
    path = folder / "hil/sub/b.scenario.toml"
    mirotwin("test", "hil/sub/b.scenario.toml", "--artifacts", "left")
    assert (folder / "left/hil-sub-b").is_dir()
    path.write_text(GOOD)
    assert mirotwin("test", "hil/sub/b.scenario.toml", "--artifacts", "left")[0] == 0
    assert not (folder / "left/hil-sub-b").exists()


def test_what_steps_save_needs_a_folder(mirotwin, folder):
    path = folder / "hil" / "save.scenario.toml"
    path.write_text(HEAD + 'step = [{ pause_ms = 5 }, { save = "booted.world" }]')
    code, out, _ = mirotwin("test", path.relative_to(folder))
    assert code == 2
    assert "step 2: there is no folder to save into; give --artifacts DIR" in out
    assert mirotwin("test", path.relative_to(folder), "--artifacts", "left")[0] == 0
    assert (folder / "left/hil-save/booted.world").read_bytes()[:8] == b"mirowrl2"
    assert mirotwin("run", path, "-q", "--no-figure")[0] == 0
    assert (folder / "runs/silent-0/booted.world").exists()


def test_the_command_of_a_failure_has_the_folder_that_a_save_step_needs(mirotwin, folder):
    path = "hil/save.scenario.toml"
    steps = '[{ save = "new.world" }, { wait_for = "answer", within_ms = 5 }]'
    (folder / path).write_text(f"{HEAD}step = {steps}")
    command = f"mirotwin test {path} --artifacts left"
    code, out, _ = mirotwin("test", path, "--artifacts", "left")
    assert (code, f"    {command}" in out.splitlines()) == (1, True)
    assert (folder / "left/hil-save/report.txt").read_text().splitlines()[-1] == command
    assert mirotwin(*command.split()[1:])[0] == 1


def test_run_does_steps_too_and_its_recording_replays(mirotwin, folder):
    err = mirotwin.ends(1, "run", "hil/sub/b.scenario.toml", "--out", "run", "-q", "--no-figure")
    assert err.startswith(f"mirotwin: step failed: {TOO_SOON}")
    assert '"count": 3' in (folder / "run/summary.json").read_text()
    assert mirotwin("replay", "run/run.mcap", "-q")[0] == 0
    assert mirotwin("run", "hil/a.scenario.toml", "--out", "good", "-q", "--no-figure") == (0, "", "")
    err = mirotwin.ends(2, "run", "hil/a.scenario.toml", "--record", "full")
    assert "--record full does not go with the steps of hil/a.scenario.toml" in err


def test_a_command_that_would_leave_steps_out_says_so(mirotwin, folder):
    err = mirotwin.ends(2, "camera", "look", "hil/a.scenario.toml", "--at", "0.1s")
    assert "has 3 steps, which only `mirotwin run` and `mirotwin test` do; run it, and give the run" in err


def test_the_examples_pass_from_a_user_s_folder(mirotwin, folder):
    code, out, _ = mirotwin("test", ROOT / "examples" / "hil-steps")
    assert code == 0
    assert out.splitlines()[-1] == "3 passed"


def test_pages_are_made_when_they_are_asked_for_however_large_they_are(mirotwin, folder, monkeypatch):
    monkeypatch.setattr(document, "MOST_BYTES", 1000)
    for more, pages in (((), 0), (("--pages",), 1)):
        assert mirotwin("test", "hil/sub/d.scenario.toml", "--artifacts", "left", *more)[0] == 1
        found = [path.read_bytes() for path in (folder / "left").rglob("report.html")]
        assert [b"failsafe_stop_ms" in page for page in found] == [True] * pages


def test_what_a_failed_test_leaves_of_a_whole_run_replays_by_the_line_it_prints(mirotwin, folder):
    """A frame is on the air when the run ends, in the middle of a control period of the scenario's duration."""
    Path("late.scenario.toml").write_text('scenario = "fig6"\nexpect = { settles_within_s = 0.1 }\n')
    code, out, _ = mirotwin("test", "late.scenario.toml", "--artifacts", "left")
    assert code == 1
    (line,) = [line for line in out.splitlines() if "mirotwin replay left/" in line]
    replayed, _, said = mirotwin(*line.split("mirotwin ")[1].split())
    assert (replayed, said.startswith("mirotwin: fails as recorded: ")) == (1, True)


# Cases: saved failures, run again as a project's CI does

PASSES = "# mirotwin stream 2\n2400000 > 55\n"
DAMAGED = bytes([12, 9, 1, 0, 16, 0, 32, 0])
"""Input of a session: a frame with one wrong character."""


@pytest.fixture(scope="module")
def mistaken(tmp_path_factory):
    """A firmware with a mistake, and the folder of a case of it beside a stream that expects nothing."""
    image = planted("takes frames with a bad CRC")
    target = RobotTarget(image)
    assert target.run(DAMAGED)
    folder = tmp_path_factory.mktemp("cases")
    verdict = RobotOracle(target).confirm(DAMAGED, target.failure)
    (folder / "crc.stream").write_text(verdict.case())
    (folder / "silence.stream").write_text(PASSES)
    return image, folder, str(verdict.failure)


@needs_sdcc
def test_a_case_fails_with_the_mistake_and_passes_without(mirotwin, mistaken, tmp_path):
    image, folder, verdict = mistaken
    code, out, err = mirotwin("test", folder, "--firmware", image.path, "--junit", tmp_path / "j.xml")
    lines = out.splitlines()
    assert (code, err) == (1, "")
    assert lines[0].startswith(f"FAILED  {folder}/crc.stream (")
    assert lines[1:] == [
        f"    expectation failed: {verdict}",
        f"    mirotwin replay {folder}/crc.stream --firmware {image.path}",
        "1 failed",
    ]
    assert ElementTree.parse(tmp_path / "j.xml").find(".//testcase").get("name") == "crc"
    code, out, err = mirotwin("test", folder)
    assert (code, err, out.splitlines()[-1]) == (0, "", "1 passed")


def test_a_stream_that_is_named_may_expect_nothing(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text(PASSES)
    code, out, _ = mirotwin("test", tmp_path / "a.stream")
    assert (code, out.splitlines()[-1]) == (0, "1 passed")


def test_a_case_whose_check_has_no_occasion_any_more_fails(mirotwin, tmp_path):
    head = '# mirotwin stream 2\n#: verdict = "acts_within_ms: .."\n#: expect.acts_within_ms = true\n'
    (tmp_path / "a.stream").write_text(f"{head}2400000 > 55\n")
    code, out, _ = mirotwin("test", tmp_path)
    assert code == 1
    assert "    expectation not judged: acts_within_ms: the run had no occasion for it" in out.splitlines()


def test_a_case_that_cannot_be_read_stops_no_other(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text("# mirotwin stream 2\nx\n")
    (tmp_path / "b.stream").write_text(PASSES.replace("2\n", "2\n#: expect.no_fault = true\n", 1))
    code, out, _ = mirotwin("test", tmp_path)
    assert code == 2
    assert f"{tmp_path}/a.stream:2:1: " in out
    assert out.splitlines()[-1] == "1 cannot be run, 1 passed"


def test_a_check_that_no_case_names_is_refused(mirotwin, tmp_path):
    (tmp_path / "b.stream").write_text(PASSES)
    (tmp_path / "mine.py").write_text(source_of("Mine", "mine", "True", "'wrong'"))
    err = mirotwin.ends(2, "test", tmp_path / "b.stream", "--expect", tmp_path / "mine.py:Mine")
    assert f"--expect: no case is judged by {tmp_path}/mine.py:Mine; leave it out" in err
