"""`mirotwin fuzz` as a user meets it: what it says, what it leaves, and how it refuses what it cannot use."""

import json
import re
import signal
import sys
from xml.etree import ElementTree

import pytest

from miro_protocol.actions import Fault
from mirotwin.fuzz.files import CampaignFolder, unused
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import robot_target
from tests import children
from tests.mirotwin.conform.mistakes import MISTAKES
from tests.mirotwin.verify.checks.rig import built, needs_sdcc, own_image, planted

pytestmark = pytest.mark.slow

PROGRAM = """
import mirotwin.fuzz.fuzz_command as fuzz
fuzz.LINE_S = 1.0
from tests.mirotwin.fuzz.conftest import RandomEngine
fuzz.engine_for = lambda spec, inputs, folder, target, jobs, seed: (
    RandomEngine(target, inputs, folder.folder("engine"), seed), [])
from mirotwin.entry import main
main()
"""
"""The command in a process of its own, with the engine of the tests and a line of progress each second."""


@needs_sdcc
def test_a_planted_mistake_is_found_and_the_printed_line_gives_it_again(mirotwin, engines, tmp_path):
    image = planted("takes frames with a bad CRC").path
    options = ("--time", "10min", "--until-crash", "--minimise", "0.3s")
    code, out, err = mirotwin("fuzz", image, *options, "--out", tmp_path / "out")
    assert code == 1
    assert engines[0].stopped
    assert "mirotwin: found: " in err
    lines = out.splitlines()
    (replay,) = [line.split() for line in lines if line.strip().startswith("mirotwin replay")][:1]
    assert replay[3:] == ["--firmware", str(image)]
    again, _, said = mirotwin(*replay[1:])
    assert (again, said.startswith("mirotwin: fails as recorded: ")) == (1, True)
    assert lines[-1] == f"written to {tmp_path / 'out'}"
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["complete"]
    assert any(crash["confirmed"] for crash in summary["crashes"])
    assert (tmp_path / "out" / "coverage.info").read_text().startswith("TN:\nSF:")
    assert list((tmp_path / "out" / "corpus").iterdir())


@needs_sdcc
def test_json_and_junit_have_a_case_for_the_campaign_and_one_for_each_crash(mirotwin, engines, tmp_path):
    image = planted("takes frames with a bad CRC").path
    options = ("--minimise", "0.3s", "--out", tmp_path / "out", "--json", "--junit", tmp_path / "j.xml", "-q")
    code, out, _ = mirotwin("fuzz", image, "--time", "3s", *options)
    document = json.loads(out)
    assert (code, document["verdict"], document["exit_code"]) == (1, "failed", 1)
    campaign, crash = document["cases"][:2]
    assert (campaign["name"], campaign["verdict"]) == ("campaign", "passed")
    assert (crash["verdict"], crash["counts"]) == ("failed", True)
    again, _, said = mirotwin(*crash["replay"].split()[1:])
    assert (again, said.partition(" (")[0]) == (
        1,
        f"mirotwin: fails as recorded: {crash['lines'][0]}".partition(" (")[0],
    )
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert document["summary"] == written
    names = [case.get("name") for case in ElementTree.parse(tmp_path / "j.xml").iter("testcase")]
    assert names == [case["name"] for case in document["cases"]]


@pytest.mark.parametrize("kind", ["frames", "session"])
def test_shipped_firmware_passes_and_coverage_is_told(mirotwin, engines, tmp_path, kind):
    out = mirotwin.succeeds("fuzz", "--time", "0.3s", "--input", kind, "--out", tmp_path / "out")
    assert out.startswith("miro.ihx: ")
    assert "never reached: " in out
    assert "no crashes" in out.splitlines()


def test_an_input_that_reaches_a_function_is_left_as_a_stream(mirotwin, engines, tmp_path):
    code, out, _ = mirotwin("fuzz", "--time", "1s", "--covering", "motion_stop", "--out", tmp_path / "out")
    assert code == 0
    path = tmp_path / "out" / "covering" / "motion_stop.stream"
    assert f"--covering motion_stop: reached by {path}" in out
    assert mirotwin("replay", path, "-q")[0] == 0


def test_a_function_that_no_input_reaches_is_said(mirotwin, engines, tmp_path):
    err = mirotwin.ends(1, "fuzz", "--time", "0.3s", "--covering", "give_up", "--out", tmp_path / "out")
    assert "--covering give_up: not reached by " in err


def test_inputs_break_hardware_and_cases_hold_the_faults(mirotwin, engines, tmp_path):
    limit = "wheels_within_m_s={limit_m_s=0.01, overshoot_m_s=0.0}"
    options = ("--time", "1s", "--seed", "1", "--expect", limit, "--minimise", "0.3s", "--json", "-q")
    code, out, _ = mirotwin("fuzz", "--faults", *options, "--out", tmp_path / "out")
    assert code == 1
    inputs = [path.read_bytes() for path in (tmp_path / "out" / "corpus").iterdir()]
    target = robot_target(TargetSpec(faults=True))
    assert any(isinstance(item, Fault) for data in inputs for item in target.script(data))
    for crash in [case for case in json.loads(out)["cases"][1:] if case["counts"]]:
        again, _, said = mirotwin(*crash["replay"].split()[1:])
        assert (again, said.startswith("mirotwin: fails as recorded: ")) == (1, True)


def test_a_check_of_ours_judges_each_new_input(mirotwin, engines, tmp_path):
    options = ("--expect", "wheels_within_m_s={limit_m_s=0.01, overshoot_m_s=0.0}", "--minimise", "0.3s")
    code, out, _ = mirotwin("fuzz", "--time", "0.3s", *options, "--out", tmp_path / "out")
    assert code == 1
    assert "wheels_within_m_s: judged " in out
    assert list((tmp_path / "out" / "crashes").glob("wheels_within_m_s-*.stream"))


@pytest.mark.parametrize("error", [RuntimeError("oh"), SystemExit(0)], ids=repr)
def test_a_check_that_raises_ends_the_campaign_with_its_name(mirotwin, engines, tmp_path, monkeypatch, error):
    def raises(*_):
        raise error

    monkeypatch.setattr("mirotwin.verify.checks.course.InsidePitch.found", raises)
    err = mirotwin.ends(2, "fuzz", "--time", "1s", "--expect", "inside_pitch", "--out", tmp_path / "out")
    assert "--expect: " in err
    assert f"check 'inside_pitch' cannot judge: {type(error).__name__}: " in err
    assert "; the campaign has ended; repair the check" in err
    assert engines[0].stopped
    assert not json.loads((tmp_path / "out" / "summary.json").read_text())["complete"]


def test_plain_lines_tell_how_far_it_is_until_ctrl_c_ends_it_with_what_was_found(tmp_path):
    command = [sys.executable, "-c", PROGRAM, "fuzz", "--out", tmp_path / "out", "--time", "60s"]
    process = children.start([*map(str, command)], stdout=-1, stderr=-1, text=True)
    try:
        line = next(line for line in iter(process.stderr.readline, "") if "fuzzing" in line)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert re.match(r"mirotwin: fuzzing miro.ihx: 0:0.*/s, .* edges, no crashes.*, \S+ left$", line)
    assert process.returncode == 130
    assert "mirotwin: interrupted; looking for 5 s at most at what is left" in err
    assert f"written to {tmp_path / 'out'}" in out
    assert not json.loads((tmp_path / "out" / "summary.json").read_text())["complete"]


# ---- what cannot be used ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--time", "soon"], "'soon' is not a time; write 2s, 20ms, 341us or 5min."),
        (["--time", "0s"], "'0s' is no time at all; give more than zero"),
        (["--jobs", "0"], "--jobs"),
        (["--slot", "3"], "--slot 3 does not exist among 3 robots; give 0 to 2."),
        (["--covering", "motion_of"], "no symbol motion_of in the code; did you mean "),
        (["--expect", "no_fualt"], "there is no such check; did you mean no_fault?"),
        (["--expect", "settles_within_s"], "within_s is missing"),
        (["--input", "words"], "--input"),
        (["nowhere.ihx"], "nowhere.ihx: there is no such file"),
        (["--corpus", "nowhere"], "nowhere: --corpus: there is no such folder"),
        (["--covering", "main"], "main runs while the firmware starts, before any input"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(mirotwin, engines, tmp_path, arguments, said):
    err = mirotwin.ends(2, "fuzz", *arguments, "--out", tmp_path / "out")
    assert said in err
    assert err.count("\n") == 1
    assert not engines
    assert not (tmp_path / "out").exists()


def test_a_folder_with_something_in_it_is_refused_and_an_earlier_campaign_is_replaced(
    mirotwin, engines, tmp_path
):
    out = tmp_path / "out"
    arguments = ("fuzz", "--time", "0.5s", "-q", "--out", out)
    assert mirotwin(*arguments)[0] == 0
    code, _, err = mirotwin(*arguments)
    assert (code, "is not empty" in err, "--force" in err) == (2, True, True)
    (out / "crashes").mkdir(exist_ok=True)
    (out / "crashes" / "old.stream").write_text("old")
    assert mirotwin(*arguments, "--force")[0] == 0
    assert not (out / "crashes" / "old.stream").exists()
    (out / "mine.txt").write_text("mine")
    assert "holds what no campaign leaves (mine.txt)" in mirotwin.ends(2, *arguments, "--force")
    assert (out / "mine.txt").read_text() == "mine"


def test_a_corpus_inside_the_folder_that_is_replaced_is_refused(mirotwin, engines, tmp_path):
    out = tmp_path / "out"
    assert mirotwin("fuzz", "--time", "0.5s", "-q", "--out", out)[0] == 0
    err = mirotwin.ends(2, "fuzz", "--out", out, "--force", "--corpus", out / "corpus")
    assert "which the campaign replaces; choose another folder with --out" in err
    other = mirotwin("fuzz", "--time", "0.5s", "-q", "--out", tmp_path / "other", "--corpus", out)
    assert other[0] == 0


@needs_sdcc
def test_firmware_that_comes_up_with_a_fault_is_refused(mirotwin, engines, tmp_path):
    image = built(*MISTAKES["executes A5h"][:3]).path
    err = mirotwin.ends(2, "fuzz", image, "--out", tmp_path / "out")
    assert "the firmware comes up with a fault: firmware executed the undefined opcode A5 at " in err


@needs_sdcc
def test_firmware_that_never_sleeps_is_fuzzed_with_a_word_about_it(mirotwin, engines, tmp_path):
    image = built("main.c", "        sleep = IDL;\n", "        sleep = 0;\n").path
    code, _, err = mirotwin("fuzz", image, "--time", "0.3s", "--out", tmp_path / "out")
    assert "miro.ihx: never sleeps (IDL); each run goes on for 10 ms after its last character" in err
    assert code in (0, 1)


def test_an_image_without_symbols_can_be_fuzzed_and_has_no_functions_to_cover(mirotwin, engines, tmp_path):
    bare = tmp_path / "bare.ihx"
    bare.write_bytes(own_image().path.read_bytes())
    command = ("fuzz", bare, "--time", "0.3s", "--out", tmp_path / "out")
    err = mirotwin.ends(2, *command, "--covering", "main")
    assert "no symbol main in the code; put its .map or .cdb beside it, or give an address as 0x.." in err
    code, out, _ = mirotwin(*command)
    assert code == 0
    assert (tmp_path / "out" / "coverage.info.lst").exists()
    assert out.startswith("bare.ihx: ")


def test_a_campaign_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(ValueError, match="not a folder"):
        CampaignFolder(tmp_path / "file")


def test_a_campaign_in_the_default_place_takes_a_new_folder_beside_the_earlier_ones(tmp_path):
    place = tmp_path / "fuzz-mine"
    assert unused(place) == place
    place.mkdir()
    assert unused(place) == place
    (place / "corpus").mkdir()
    assert unused(place) == tmp_path / "fuzz-mine-2"
    (tmp_path / "fuzz-mine-2" / "corpus").mkdir(parents=True)
    assert unused(place) == tmp_path / "fuzz-mine-3"
