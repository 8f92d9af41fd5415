"""`mirotwin conform`: table, exit codes, files, and what is refused."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mirotwin.conform.rules import ALL, RULES
from mirotwin.shell.firmware_image import load_firmware
from tests.mirotwin.conform.images import BABBLES, FAULTS, HANGS, POKES, PUSHES, READS_BOTH, RUNS_OUT
from tests.mirotwin.conform.mistakes import MISTAKES
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.checks.rig import built_in, needs_sdcc, planted


def program(folder, code):
    return hex_file(folder / "program.ihx", code)


def test_rules_that_are_kept_are_a_table_and_exit_code_0(mirotwin):
    out = mirotwin.succeeds("conform", "--rule", "P29", "--rule", "p02", "--rule", "P29")
    assert [line.split() for line in out.splitlines()] == [
        ["rule", "name", "verdict", "first", "failure"],
        ["P29", "stop", "passed"],
        ["P02", "reset", "together", "passed"],
        ["2", "rules:", "2", "passed,", "0", "failed"],
    ]


@needs_sdcc
def test_a_failure_is_left_as_a_case_whose_replay_says_the_same(mirotwin, tmp_path):
    built_in(tmp_path, *MISTAKES["stops 15 ms late"][:3])
    image = tmp_path / "out" / "miro.ihx"
    for suffix in (".map", ".cdb", ".rst"):
        image.with_suffix(suffix).unlink()
    folder = tmp_path / "cases"
    code, out, err = mirotwin("conform", image, "--rule", "P29", "--rule", "P02", "--artifacts", folder)
    assert (code, err) == (1, "")
    line = next(line for line in out.splitlines() if line.startswith("P29"))
    said = line.split(maxsplit=3)[3]
    assert "found left at 124.92 ms, right at" in said
    assert "wanted both wheels told to stop 108.46 ms to 110.50 ms after the end of" in said
    assert out.splitlines()[-3:] == [
        f"mirotwin replay {folder / 'P29.stream'} --firmware {folder / 'firmware.ihx'}",
        f"mirotwin debug {folder / 'P29.stream'} --firmware {folder / 'firmware.ihx'}",
        f"page: mirotwin report {folder / 'P29.stream'}",
    ]
    assert sorted(path.name for path in folder.iterdir()) == ["P29.stream", "firmware.ihx"]
    image.unlink()
    code, out, err = mirotwin("replay", folder / "P29.stream", "-q")
    assert (code, out) == (1, "")
    assert err.startswith(f"mirotwin: fails as recorded: conforms_to: {said}")
    code, out, _ = mirotwin("replay", folder / "P29.stream", "--firmware", ROBOTS_OWN, "-q")
    assert (code, out.partition(":")[0]) == (0, "cured")
    (folder / "other").write_text("of another tool")
    assert mirotwin("conform", ROBOTS_OWN, "--rule", "P29", "--artifacts", folder)[0] == 0
    assert [path.name for path in folder.iterdir()] == ["other"]


ROBOTS_OWN = Path(__file__).parents[3] / "robot_fw" / "miro_robot" / "firmware" / "miro.ihx"


def test_a_firmware_fault_is_exit_code_3_and_a_case_of_its_own(mirotwin, tmp_path):
    image = program(tmp_path, PUSHES)
    folder = tmp_path / "cases"
    code, out, err = mirotwin("conform", image, "--rule", "P03", "--rule", "P53", "--artifacts", folder)
    assert code == 3
    assert "trial of P03: net0/robot1: firmware ran past the end of its stack" in err
    row = next(line for line in out.splitlines() if line.startswith("P53"))
    assert "wanted no such fault (trial of P03), found firmware ran past the end" in row
    err = mirotwin.ends(3, "replay", folder / "P03-fault.stream", "--firmware", image, "-q")
    assert err.startswith("mirotwin: fails as recorded: no_fault: net0/robot1: tick ")


@pytest.mark.parametrize(
    ("code", "exit_code"),
    [(HANGS, 1), (BABBLES, 1), (FAULTS, 3), (RUNS_OUT, 3), (PUSHES, 3), (POKES, 3), (READS_BOTH, 3)],
)
def test_programs_that_are_no_firmware_end_with_a_verdict(mirotwin, tmp_path, code, exit_code):
    ids = [rule.id for rule in RULES] if exit_code == 3 else ["P01", "P41", "P43", "P51"]
    rules = [option for id in ids for option in ("--rule", id)]
    found, out, _ = mirotwin("conform", program(tmp_path, code), *rules)
    assert found == exit_code
    assert out.splitlines()[-1].startswith(f"{len(ids)} rules: 0 passed, ")


def test_a_program_that_babbles_breaks_the_rule_of_silence_first(mirotwin, tmp_path):
    _, out, _ = mirotwin("conform", program(tmp_path, BABBLES), "--rule", "P43")
    assert "wanted silence: nobody asks, found 33 characters, 55 55 55 55" in out
    assert "55 .. (ticks 157239" in out


def test_json_is_one_document_with_a_case_a_rule(mirotwin, tmp_path):
    image = program(tmp_path, HANGS)
    code, out, _ = mirotwin("conform", image, "--json", "--rule", "P03", "--rule", "P43")
    assert code == 1
    document = json.loads(out)
    cases = document.pop("cases")
    assert document == {
        "format": "mirotwin results",
        "version": 1,
        "command": "conform",
        "verdict": "failed",
        "exit_code": 1,
        "firmware": "program.ihx",
        "firmware_sha256": load_firmware(f"{image}").sha256,
        "seed": 0,
    }
    assert [(one["rule"], one["verdict"], one["counts"], one.get("cause")) for one in cases] == [
        ("P03", "failed", True, None),
        ("P43", "not judged", False, "P03"),
    ]
    assert cases[0]["wanted"] == "the velocities of team frame, seq 1 at the wheels within 10 ms"
    assert cases[0]["reproduce"] == f"mirotwin conform {image} --rule P03"
    assert (cases[0]["slot"], cases[0]["at_ms"] > 40.0, "file" in cases[0]) == (1, True, False)


def test_junit_has_a_case_a_rule_and_the_same_bytes_every_time(mirotwin, tmp_path):
    image = program(tmp_path, HANGS)
    texts = []
    for _ in range(2):
        assert (
            mirotwin("conform", image, "--rule", "P03", "--rule", "P15", "--junit", tmp_path / "j.xml")[0]
            == 1
        )
        texts.append((tmp_path / "j.xml").read_bytes())
    assert texts[0] == texts[1]
    suite = ElementTree.fromstring(texts[0]).find("testsuite")
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("2", "1", "1")
    cases = suite.findall("testcase")
    assert [case.get("name") for case in cases] == ["P03 ready", "P15 slicer noise"]
    failure = cases[0].find("failure")
    assert "wanted the velocities of" in str(failure.get("message"))
    skipped = cases[1].find("skipped")
    assert skipped.get("message") == "not judged: P03 failed, it is not ready 40 ms after power-on"
    names = [one.get("name") for one in suite.findall("properties/property")]
    assert names == ["firmware", "firmware_sha256", "seed"]


def test_a_failure_has_the_c_line_at_which_the_debugger_stands(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mirotwin.succeeds("examples", "firmware")
    options = ("--rule", "P18", "--artifacts", "failed", "--junit", "j.xml", "--json")
    _, out, _ = mirotwin("conform", "late.ihx", *options)
    (case,) = json.loads(out)["cases"]
    (element,) = ElementTree.parse("j.xml").iter("testcase")
    assert (element.get("file"), element.get("line")) == (case["file"], str(case["line"]))
    _, out, _ = mirotwin(*case["debug"].split()[1:], "-x", "where")
    assert f"{case['file']}:{case['line']} in " in next(
        line for line in out.splitlines() if line.startswith("*#0")
    )


@needs_sdcc
def test_a_firmware_fault_has_the_c_line_of_its_instruction_and_the_case_of_its_trial(mirotwin, tmp_path):
    image = planted("pushes for ever").path
    options = ("--rule", "P52", "--rule", "P53", "--artifacts", tmp_path / "failed", "--json")
    code, out, _ = mirotwin("conform", image, *options)
    document = json.loads(out)
    assert (code, document["verdict"]) == (3, "fault")
    fault = document["cases"][1]
    assert (fault["rule"], fault["file"], fault["line"]) == ("P53", "robot_fw/firmware/main.c", 49)
    assert f"{tmp_path / 'failed' / 'P52-fault.stream'}" in fault["replay"]


def test_all_rules_are_listed_and_none_is_tried(mirotwin):
    out = mirotwin.succeeds("conform", "--list")
    for rule in ALL:
        assert rule.id in out
    out = mirotwin.succeeds("conform", "--list", "--json")
    assert [json.loads(line)["rule"] for line in out.splitlines()] == [rule.id for rule in ALL]


REFUSED = {
    ("--rule", "P1"): "there is no rule 'P1'; did you mean P",
    ("--rule", "failsafe"): "there is no rule 'failsafe'; `mirotwin conform --list` shows P01 to",
    ("--explain", "P99"): "there is no rule 'P99'",
    (
        "car.board.toml",
    ): "is no image, and conform knows the rules of the robot's protocol alone; see docs/howto/own-",
    ("none.ihx",): "none.ihx: there is no such file",
    ("--seed", "-1"): "-1 is not in the range",
    ("--junit", "nowhere/j.xml"): "nowhere",
    ("--artifacts", "/dev/null/x"): "/dev/null/x: Not a directory; choose another folder with --artifacts",
    ("--list", "a.ihx"): "IMAGE.ihx does not go with --list.",
    ("--list", "--all"): "--all does not go with --list.",
    ("--list", "--junit", "a.xml"): "--junit does not go with --list.",
    ("--list", "--artifacts", "a"): "--artifacts does not go with --list.",
    ("--list", "--seed", "1"): "--seed does not go with --list.",
    ("--list", "--port", "loop://"): "--port does not go with --list.",
    ("--explain", "P44", "--rule", "P30"): "--rule does not go with --explain.",
    ("--explain", "P44", "--all"): "--all does not go with --explain.",
    ("--explain", "P44", "--json"): "--json does not go with --explain.",
    ("--explain", "P44", "--junit", "a.xml"): "--junit does not go with --explain.",
    ("--explain", "P44", "--artifacts", "a"): "--artifacts does not go with --explain.",
    ("--explain", "P44", "--list"): "--list does not go with --explain.",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_what_cannot_be_meant_is_one_line_and_exit_code_2_and_leaves_nothing(
    mirotwin, arguments, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert REFUSED[arguments] in mirotwin.refuses("conform", *arguments)
    assert not list(tmp_path.iterdir())


def test_a_rule_that_a_scenario_names_and_is_not_there_is_refused(mirotwin):
    err = mirotwin.ends(2, "run", "fig6", "--expect", "conforms_to=P99")
    assert "conforms_to=P99" in err
    assert "there is no rule 'P99'" in err
