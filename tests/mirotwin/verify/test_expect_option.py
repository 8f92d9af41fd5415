"""`--expect` and `[expect]` in `run` and `replay`: lines on stderr, exit codes, the summary."""

import json

import pytest

from tests.mirotwin.verify.checks.rig import needs_sdcc, planted
from tests.mirotwin.verify.checks.test_planted import ALWAYS

MET = ("--expect", "frames_accepted_min=3", "--expect", "inside_pitch=true")
MISSED = ("--expect", "tracks_within_cm={limit_cm=1.9, from_s=0.0}")
FAILURE = "tracks_within_cm: net0/robot0: tick 0 (0.000 ms): wanted at most 1.9 cm from the reference, found 2.000 cm"


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_what_is_met_costs_no_line_and_no_exit_code(mirotwin, short, tmp_path):
    out = mirotwin.succeeds("run", short, "--no-figure", "--out", tmp_path / "run", *MET)
    assert "6 of 6 checks passed" in out
    found = summary(tmp_path / "run")
    assert found["set"] == ["expect.frames_accepted_min=3", "expect.inside_pitch=true"]
    assert [(one["name"], one["kind"], one["verdict"]) for one in found["expectations"]] == [
        ("no_fault", "safety", "passed"),
        ("lm629_protocol", "safety", "passed"),
        ("main_loop_alive", "safety", "passed"),
        ("stack_clear", "safety", "passed"),
        ("acts_at_all", "liveness", "not judged"),
        ("frames_accepted_min", "liveness", "passed"),
        ("inside_pitch", "safety", "passed"),
    ]


def test_a_failure_is_a_line_with_what_when_wanted_and_found_and_exit_code_1(mirotwin, short, tmp_path):
    code, out, err = mirotwin("run", short, "--no-figure", "--out", tmp_path / "run", *MISSED)
    assert (code, err) == (1, f"mirotwin: expectation failed: {FAILURE}\n")
    assert "4 of 5 checks passed, tracks_within_cm failed" in out
    told = summary(tmp_path / "run")["expectations"][-1]
    where, what = {"network": 0, "slot": 0, "tick": 0}, "at most 1.9 cm from the reference"
    assert told.pop("first") == {**where, "wanted": what, "found": "2.000 cm"}
    assert told == {"name": "tracks_within_cm", "kind": "safety", "verdict": "failed", "failures": 1}


def test_a_recording_keeps_what_was_expected_and_replay_says_it_again(mirotwin, short, tmp_path):
    mirotwin("run", short, "-q", "--no-figure", "--out", tmp_path / "run", *MISSED)
    code, out, err = mirotwin("replay", "-q", tmp_path / "run" / "run.mcap")
    assert (code, err) == (1, f"mirotwin: expectation failed: {FAILURE}\n")
    assert "equals the recorded one" in out
    met = ("--expect", "tracks_within_cm={limit_cm=2.1, from_s=0.0}")
    assert mirotwin("replay", "-q", tmp_path / "run" / "run.mcap", *met)[::2] == (0, "")


def test_what_a_replay_expects_decides_where_it_differs_too(mirotwin, finished):
    other = ("replay", "-q", finished / "run.mcap", "--set", "network.robot.0.drive.chassis.mass_kg=0.9")
    for more, wanted in (((), 4), (("--expect", "frames_accepted_min=3"), 0)):
        code, _, err = mirotwin(*other, *more)
        assert code == wanted
        assert "the replay differs in control period" in err
    assert FAILURE in mirotwin.ends(1, *other, *MISSED)


def test_a_text_stream_is_judged_too(mirotwin, finished, tmp_path):
    stream = tmp_path / "sent.stream"
    mirotwin("export", finished / "run.mcap", "--out", stream)
    code, out, err = mirotwin("replay", stream, "--expect", "frames_accepted_min=300")
    assert code == 1
    assert "4 of 5 checks passed, frames_accepted_min failed\n" in out
    assert err.count("wanted at least 300 frames accepted, found 6\n") == 3  # a robot in every slot


def test_a_check_without_an_occasion_is_named(mirotwin, short, tmp_path):
    options = ("--no-figure", "--out", tmp_path / "run", "--expect", "failsafe_stop_ms=true")
    code, out, err = mirotwin("run", short, *options)
    said = "mirotwin: expectation not judged: failsafe_stop_ms: the run had no occasion for it\n"
    assert (code, err) == (0, said)
    assert "failsafe_stop_ms not judged" in out


@pytest.mark.parametrize("command", ["run", "replay"])
def test_an_unknown_check_is_refused_before_anything_runs(command, mirotwin, short, finished, tmp_path):
    given = (short, "--out", tmp_path / "run") if command == "run" else (finished / "run.mcap",)
    err = mirotwin.refuses(command, *given, "--expect", "inside_pich=true")
    said = "there is no such check; did you mean inside_pitch? `mirotwin scenarios checks` "
    assert f"--expect inside_pich=true: {said}" in err
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@needs_sdcc
def test_a_firmware_fault_goes_before_what_else_failed(mirotwin, short, tmp_path):
    concerned = ALWAYS["stays in an interrupt"]
    image = planted("stays in an interrupt").path
    out = ("--no-figure", "--out", tmp_path / "run", "--firmware", image)
    err = mirotwin.ends(3, "run", short, "-q", *out, *MISSED)
    lines = err.splitlines()
    assert lines[0] == f"mirotwin: expectation failed: {FAILURE}"
    starved = "firmware starved its main loop: interrupts took all of 10 ms at "
    assert [line.partition(starved)[0] for line in lines[1:]] == [
        f"mirotwin: firmware fault: net0/robot{slot}: " for slot in (0, 2)
    ]
    verdicts = {one["name"]: one["verdict"] for one in summary(tmp_path / "run")["expectations"]}
    assert {name for name in verdicts if verdicts[name] == "failed"} == {*concerned, "tracks_within_cm"}
