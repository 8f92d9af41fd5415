"""`mirotwin test`: which files are tests, their verdicts, and what a failure leaves."""

import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mirotwin.verify.steps.running import collect

ROOT = Path(__file__).parents[3]
HEAD = 'scenario = "silent"\nduration_s = 0.5\n'
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
    wanted = "wanted answer within 20 ms, found none of it, but "
    assert lines[2].startswith(
        f"    step failed: step 3 (too soon): expect answer: tick 600000 (25.000 ms): {wanted}"
    )
    assert lines[3] == "    mirotwin test hil/sub/b.scenario.toml"
    assert lines[4] == "ERROR  hil/sub/c.scenario.toml"
    assert lines[5].endswith("c.scenario.toml: step 3.within_s: unknown key; use within_ms, in milliseconds")
    assert lines[7].startswith("    expectation failed: failsafe_stop_ms: net0/robot0: tick ")
    assert lines[-1] == "1 cannot be run, 3 failed, 1 passed"


@pytest.mark.parametrize(
    ("names", "code"),
    [(["a"], 0), (["a", "sub/b"], 1), (["sub/d"], 1), (["sub/c", "sub/b"], 2), (["sub/c"], 2)],
)
def test_the_worst_verdict_is_the_exit_code(mirotwin, folder, names, code):
    assert mirotwin("test", *[f"hil/{name}.scenario.toml" for name in names])[0] == code


def test_a_firmware_fault_is_exit_code_3(mirotwin, folder):
    (folder / "bad.ihx").write_text(":01000000A55A\n:00000001FF\n")
    code, out, _ = mirotwin("test", "hil/a.scenario.toml", "--firmware", "bad.ihx")
    assert code == 3
    assert out.splitlines()[0].startswith("FAULT  hil/a.scenario.toml (0 of 3 steps") or "1 of 3" in out
    assert "firmware fault: net0/robot0: " in out
    assert "a firmware fault has stopped the run" in out


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["empty"], "empty: no *.scenario.toml or *.stream there; nothing was tested"),
        (["hil", "-k", "zzz"], "hil: 5 files, none with 'zzz' in its path; nothing was tested"),
        (["none"], "none: there is no such file or folder; name a folder, or a *.scenario.toml or *.stream"),
        (["hil/notes.toml"], "hil/notes.toml: is no *.scenario.toml or *.stream; rename it"),
        (["hil", "--firmware", "none.ihx"], "none.ihx: there is no such file"),
        (
            ["hil", "--junit", "hil/a.scenario.toml"],
            "hil/a.scenario.toml: is the input itself; choose another",
        ),
    ],
)
def test_nothing_to_test_is_bad_input(mirotwin, folder, arguments, what):
    (folder / "empty").mkdir()
    code, out, err = mirotwin("test", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"mirotwin: error: {what}")


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


def test_junit_has_each_test_with_what_gives_it_again(mirotwin, folder):
    mirotwin("test", "hil", "--junit", "out.xml", "--seed", 4, "--set", "duration_s=0.4")
    (suite,) = ElementTree.parse(folder / "out.xml").getroot()
    assert {key: suite.get(key) for key in ("tests", "failures", "errors")} == {
        "tests": "5",
        "failures": "3",
        "errors": "1",
    }
    cases = {case.get("name"): case for case in suite}
    assert cases["b"].get("classname") == "hil.sub"
    failure = cases["b"].find("failure")
    assert failure.get("message", "").startswith("step failed: step 3 (too soon): expect answer: ")
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
    assert sorted(path.name for path in (folder / "left").iterdir()) == [
        "hil-sub-b",
        "hil-sub-d",
        "hil-sub-e",
    ]
    for name, line in {
        "b": "fails as recorded: happens: net0/robot0: tick 600000 ",
        "d": "fails as recorded: failsafe_stop_ms: net0/robot0: tick ",
    }.items():
        assert mirotwin("replay", f"left/hil-sub-{name}/case.stream", "-q")[0] == 1
        _, _, err = mirotwin("replay", f"left/hil-sub-{name}/case.stream", "-q")
        assert err.startswith(f"mirotwin: {line}")
    assert not (folder / "left/hil-sub-e/case.stream").exists()  # no check knows an answer's fields
    report = (folder / "left/hil-sub-e/report.txt").read_text().splitlines()
    code, _, err = mirotwin("run", "left/hil-sub-e/scenario.toml", "--out", "again", "-q", "--no-figure")
    assert code == 1
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


def test_run_does_steps_too_and_its_recording_replays(mirotwin, folder):
    code, _, err = mirotwin("run", "hil/sub/b.scenario.toml", "--out", "run", "-q", "--no-figure")
    assert code == 1
    assert err.startswith(
        "mirotwin: step failed: step 3 (too soon): expect answer: tick 600000 (25.000 ms): "
    )
    assert '"count": 3' in (folder / "run/summary.json").read_text()
    assert mirotwin("replay", "run/run.mcap", "-q")[0] == 0
    assert mirotwin("run", "hil/a.scenario.toml", "--out", "good", "-q", "--no-figure") == (0, "", "")
    code, _, err = mirotwin("run", "hil/a.scenario.toml", "--record", "full")
    assert code == 2
    assert "--record full does not go with the steps of hil/a.scenario.toml" in err


@pytest.mark.parametrize("command", [["fw", "trace"], ["camera", "look"]])
def test_commands_that_would_leave_steps_out_say_so(mirotwin, folder, command):
    time = ["--at", "0.1s"] if command == ["camera", "look"] else ["--to", "1ms"]
    code, _, err = mirotwin(*command, "hil/a.scenario.toml", *time)
    assert code == 2
    assert (
        "has 3 steps, which only `mirotwin run` and `mirotwin test` do; run it, and give the run.mcap" in err
    )


def test_the_examples_pass_from_a_user_s_folder(mirotwin, folder):
    code, out, _ = mirotwin("test", ROOT / "examples" / "hil-steps")
    assert code == 0
    assert out.splitlines()[-1] == "3 passed"


def test_pages_are_made_when_they_are_asked_for(mirotwin, folder):
    for more, pages in (((), 0), (("--pages",), 1)):
        assert mirotwin("test", "hil/sub/d.scenario.toml", "--artifacts", "left", *more)[0] == 1
        found = [
            path
            for path in (folder / "left").rglob("report.html")
            if b"failsafe_stop_ms" in path.read_bytes()
        ]
        assert len(found) == pages


def test_what_a_failed_test_leaves_of_a_whole_run_replays_by_the_line_it_prints(mirotwin, folder):
    """A frame is on the air when the run ends, in the middle of a control period of the scenario's duration."""
    Path("late.scenario.toml").write_text('scenario = "fig6"\nexpect = { settles_within_s = 0.1 }\n')
    code, out, _ = mirotwin("test", "late.scenario.toml", "--artifacts", "left")
    assert code == 1
    (line,) = [line for line in out.splitlines() if "mirotwin replay left/" in line]
    replayed, _, said = mirotwin(*line.split("mirotwin ")[1].split())
    assert (replayed, said.startswith("mirotwin: fails as recorded: ")) == (1, True)
