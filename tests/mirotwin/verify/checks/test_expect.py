"""What a scenario and `--expect` may say, what is said of what they may not; run and replay with them."""

import json
import re

import pytest

from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import load, parse
from mirotwin.verify.checks.expect import ALWAYS_ON, expectations_in, expectations_of, says_anything
from tests.mirotwin.verify.checks.rig import needs_sdcc, planted
from tests.mirotwin.verify.checks.test_planted import ALWAYS

TWO = """
name = "two"
duration_s = 1.0
{all}
[[network]]
[[network.robot]]
slot = 0
reference.kind = "line"
{one}
[[network.robot]]
slot = 2
reference.kind = "arc"
"""


def names(all_, one=""):
    scenario = parse(TWO.format(all=all_, one=one), "two")
    return {
        place: [check.name for check in checks] for place, checks in expectations_of(scenario, "two").items()
    }


def test_every_run_has_the_checks_that_are_always_on():
    assert names("") == {(0, 0): list(ALWAYS_ON), (0, 2): list(ALWAYS_ON)}
    assert not says_anything(load("line").scenario)


@pytest.mark.parametrize("name", ["fig6", "fig7", "fig8", "fig9", "fig10"])
def test_the_scenarios_of_the_paper_expect_a_robot_that_accepts_frames_and_tracks(name):
    assert set(load(name).scenario.expect) == {"frames_accepted_min", "tracks_within_cm"}


def test_a_robot_may_expect_otherwise_than_all():
    all_ = "[expect]\ninside_pitch = true\ntracks_within_cm = 3\n"
    one = (
        "[network.robot.expect]\ntracks_within_cm = { limit_cm = 2.0, from_s = 0.5 }\ninside_pitch = false\n"
    )
    assert names(all_, one) == {
        (0, 0): [*ALWAYS_ON, "tracks_within_cm"],
        (0, 2): [*ALWAYS_ON, "inside_pitch", "tracks_within_cm"],
    }
    scenario = parse(TWO.format(all=all_, one=one), "two")
    first, second = (checks[-1] for checks in expectations_of(scenario, "two").values())
    assert (first.limit_cm, first.from_s, second.limit_cm, second.from_s) == (2.0, 0.5, 3.0, None)
    assert says_anything(scenario)


def test_who_asks_for_a_check_that_is_none_is_told_how_one_is_made():
    both = "; `mirotwin plugins checks` lists them, .* `mirotwin examples checks` writes one"
    with pytest.raises(ScenarioError, match=both):
        names("[expect]\nfast = 1\n")


WRONG = {
    "tracks_within_m = 0.03": "tracks_within_m: there is no such check; use tracks_within_cm, in centim",
    "setles_within_s = 1": "setles_within_s: there is no such check; did you mean settles_within_s?",
    "tracks_within_cm = true": "tracks_within_cm: limit_cm is missing; give it: tracks_within_cm = ..",
    "tracks_within_cm = '3 cm'": "tracks_within_cm: expected a number in centimetres, got a string",
    "tracks_within_cm = -1": "tracks_within_cm: -1 is out of range; must be > 0.0 in centimetres",
    "tracks_within_cm = {limit_m = 1}": "tracks_within_cm.limit_m: unknown key; use limit_cm, in",
    "tracks_within_cm = {limit_cm = 1, from_s = -1}": "tracks_within_cm.from_s: -1 is out of range",
    "settles_within_s = 1.01": "settles_within_s: 1.01 s is not before the end of the run, 1.001 s",
    "inside_pitch = 1": "inside_pitch: expected true or false, got 1; write inside_pitch = true",
    "no_fault = false": "no_fault: this check is always on; remove the key",
    "failsafe_stop_ms = 5": "failsafe_stop_ms: 5 is out of range; must be > 10.0 in milliseconds",
    "failsafe_stop_ms = [110]": "failsafe_stop_ms: expected a number in milliseconds, got an array",
    "frames_accepted_min = 1.5": "frames_accepted_min: expected a whole number, got a number (1.5)",
    "never_happens.until_tick = 24000\nnever_happens.condition = { event = 'edge', pin = 'rxd' }": (
        "never_happens.condition: no check follows edge at robots; use answer, heard"
    ),
}


@pytest.mark.parametrize("lines", WRONG)
def test_what_cannot_be_expected_is_said_with_its_path(lines):
    with pytest.raises(ScenarioError, match=re.escape(f"two: expect.{WRONG[lines]}")):
        names(f"[expect]\n{lines}\n")


@pytest.mark.parametrize("value", ["true", "'v<0.05'", "3"])
def test_a_check_that_takes_a_table_is_answered_with_one_that_can_be_used(value):
    table = '{ condition = { event = "fault" }, until_tick = 24000000 }'
    said = f"two: expect.never_happens: never_happens takes a table; write never_happens = {table}; event: answer, "
    with pytest.raises(ScenarioError, match=re.escape(said)):
        names(f"[expect]\nnever_happens = {value}")
    assert names(f"[expect]\nnever_happens = {table}")[0, 0] == [*ALWAYS_ON, "never_happens"]


def test_the_path_of_one_robots_expectation_is_its_own():
    with pytest.raises(
        ScenarioError, match=r"two: network\[0\]\.robot\[0\]\.expect\.inside_pitsch: there is"
    ):
        names("", "[network.robot.expect]\ninside_pitsch = true\n")


def test_a_setting_is_named_as_it_was_given():
    with pytest.raises(ScenarioError, match=r"fig6: --expect inside_pitch=3: expected true or false, got 3"):
        expectations_in(load("fig6", ["expect.inside_pitch=3"]))
    with pytest.raises(
        ScenarioError, match=r"fig6: --set network.robot.expect.inside_pitch=3: expected true or"
    ):
        expectations_in(load("fig6", ["network.robot.expect.inside_pitch=3"]))


# In run and replay: lines on stderr, exit codes, the summary

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


def test_the_digest_is_that_of_a_run_that_expects_nothing(mirotwin, short, finished, tmp_path):
    mirotwin("run", short, "-q", "--seed", 5, "--no-figure", "--out", tmp_path / "run", *MET, *MISSED)
    assert summary(tmp_path / "run")["digest"] == summary(finished)["digest"]


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
    assert (code, err) == (1, said)
    assert "failsafe_stop_ms not judged" in out


@pytest.mark.parametrize("command", ["run", "replay"])
def test_an_unknown_check_is_refused_before_anything_runs(command, mirotwin, short, finished, tmp_path):
    given = (short, "--out", tmp_path / "run") if command == "run" else (finished / "run.mcap",)
    err = mirotwin.refuses(command, *given, "--expect", "inside_pich=true")
    said = "there is no such check; did you mean inside_pitch? `mirotwin plugins checks` "
    assert f"--expect inside_pich=true: {said}" in err
    assert not (tmp_path / "run").exists()


@needs_sdcc
def test_a_stream_tells_a_late_failsafe_from_the_right_one(mirotwin, finished, tmp_path):
    mirotwin("export", finished / "run.mcap", "--out", tmp_path / "sent.stream")
    stream = ("replay", "-q", tmp_path / "sent.stream", "--expect", "failsafe_stop_ms=110")
    wanted = "wanted both wheels told to stop 110 +- 0.5 ms after the last fresh frame, found left at 124.9"
    assert wanted in mirotwin.ends(1, *stream, "--firmware", planted("stops 15 ms late").path)
    mirotwin.succeeds(*stream)


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
