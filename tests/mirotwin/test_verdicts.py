"""One verdict for the same thing, whichever command judges it: the word, the exit code, and what JUnit says."""

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from docs.site import exit_codes
from miro_robot.firmware import image_path
from mirotwin import entry
from mirotwin.shell.verdicts import INTERRUPTED, VERDICTS, judge
from tests.mirotwin.conform.images import FAULTS, HANGS
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.testing.sessions import session
from tests.mirotwin.verify.firmwares import POLLS, SLEEPS, image

ROOT = Path(__file__).parents[2]
EXPECTED = {
    "no_fault = true": "passed",
    "inside_pitch = true": "passed",
    "frames_accepted_min = 99": "failed",
    "moves_only_when_fresh = true": "not judged",
    "failsafe_stop_ms = true": "not judged",
    "acts_at_all = true": "not judged",
}
"""What is expected of the robot's own firmware that hears nothing of use, and the verdict."""
OTHERS = {
    ("frames_accepted_min = 1", "unnamed"): "not observable",
    ("no_fault = true", "faulty"): "fault",
    ("frames_accepted_min = 1", "faulty"): "fault",
    ("moves_only_when_fresh = true", "dead"): "not judged",
}
"""The same of other firmware: without the files that name its counters, with a fault, and one that does nothing."""
GIVEN = {(expected, "own"): verdict for expected, verdict in EXPECTED.items()} | OTHERS


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    """Images by name; None for the robot's own."""
    folder = tmp_path_factory.mktemp("images")
    shutil.copy(image_path(), folder / "unnamed.ihx")
    hex_file(folder / "faulty.ihx", FAULTS)
    hex_file(folder / "dead.ihx", HANGS)
    return {"own": None, **{name: folder / f"{name}.ihx" for name in ("unnamed", "faulty", "dead")}}


def option(image, name="--firmware"):
    return [] if image is None else [name, image]


def stream(path, expected, verdict=""):
    """A case by hand, of characters that are no frame."""
    head = f'#: verdict = "{verdict}"\n' if verdict else ""
    path.write_text(
        f'# mirotwin stream 2\n#: scenario = "silent"\n{head}#: end_tick = 6000000\n#:\n#: [expect]\n'
        f"#: {expected}\n240000 > 31 32 33\n"
    )
    return path


def of_junit(path):
    """pytest and `mirotwin test` write the same words: passed, failure, error, skipped."""
    (case,) = ElementTree.parse(path).iter("testcase")
    return next((one.tag for one in case if one.tag in ("failure", "error", "skipped")), "passed")


@pytest.mark.parametrize(("expected", "name"), GIVEN)
@pytest.mark.parametrize("recorded", [True, False], ids=["case", "stream"])
def test_a_case_has_one_verdict(mirotwin, firmware, tmp_path, expected, name, recorded):
    verdict, check = GIVEN[expected, name], expected.partition(" ")[0]
    path = stream(tmp_path / "a.stream", expected, f"{check}: of old" if recorded else "")
    if not recorded and verdict == "not observable":
        verdict = "passed"  # a stream is judged by all checks that are always on, a case by its own
    code, out, _ = mirotwin(
        "test", path, *option(firmware[name]), "--junit", tmp_path / "j.xml", "--artifacts", tmp_path / "left"
    )
    told = VERDICTS[verdict]
    assert (out.startswith(told.line), code) == (True, told.code)
    assert of_junit(tmp_path / "j.xml") == told.junit
    code, out, err = mirotwin("replay", path, *option(firmware[name]), "-q")
    if recorded and verdict == "passed":
        assert (code, "not reproduced: " in err) == (4, True)
    else:
        assert code == told.code
    if GIVEN[expected, name].startswith("not "):
        assert f"expectation {GIVEN[expected, name]}: {check}: " in out + err


@pytest.mark.parametrize(("expected", "name"), GIVEN)
def test_a_scenario_has_one_verdict(mirotwin, firmware, tmp_path, expected, name):
    """`not observable` changes nothing: the checks that are always on have judged."""
    verdict, check = GIVEN[expected, name], expected.partition(" ")[0]
    told = VERDICTS["passed" if verdict == "not observable" else verdict]
    file, given = tmp_path / "a.scenario.toml", option(firmware[name])
    file.write_text(f'scenario = "silent"\nduration_s = 0.2\n[expect]\n{expected}\n')
    code, out, _ = mirotwin("test", file, *given, "--junit", tmp_path / "j.xml")
    assert (out.startswith(told.line), code, of_junit(tmp_path / "j.xml")) == (True, told.code, told.junit)
    folder = tmp_path / "run"
    code, _, err = mirotwin("run", file, *given, "--out", folder, "-q", "--no-figure")
    assert code == told.code
    assert (f"expectation {verdict}: {check}: " in err) == (
        verdict in ("failed", "not judged", "not observable")
    )
    assert mirotwin("replay", folder / "run.mcap", "-q")[0] == told.code
    done = session(tmp_path, file.name, "--junitxml=p.xml", *option(firmware[name], "--mirotwin-firmware"))
    assert (bool(done.returncode), of_junit(tmp_path / "p.xml")) == (bool(told.code), told.junit)


@pytest.mark.parametrize(("expected", "name"), GIVEN)
def test_a_marker_names_checks_as_a_scenario_does(firmware, tmp_path, expected, name):
    verdict = VERDICTS[GIVEN[expected, name]]
    key, _, value = expected.partition(" = ")
    tests = (
        f"@pytest.mark.mirotwin(expect={{'{key}': {value.capitalize()}}}, boot=False)\n"
        "def test_it(world):\n    world.run_for(ms(100))\n"
    )
    done = session(tmp_path, *option(firmware[name], "--mirotwin-firmware"), tests=tests)
    assert done.returncode == (verdict.junit == "failure")
    assert (f"expectation not judged: {key}: " in done.stdout) == (verdict.line == "NOT JUDGED")


@pytest.mark.parametrize(("expected", "name"), GIVEN)
def test_a_campaign_counts_as_a_run_does(mirotwin, firmware, tmp_path, expected, name):
    verdict = GIVEN[expected, name]
    told = VERDICTS["passed" if verdict == "not observable" else verdict]
    (tmp_path / "s.toml").write_text(f'scenario = "silent"\nduration_s = 0.2\n[expect]\n{expected}\n')
    image = ""
    if firmware[name] is not None:  # a campaign names files of its own folder
        shutil.copy(firmware[name], tmp_path / "image.ihx")
        image = "firmware = 'image.ihx'\n"
    (tmp_path / "c.toml").write_text(f'scenario = "s.toml"\n{image}seeds = "0-1"\n')
    pytest.importorskip("pyarrow")
    code, _, err = mirotwin(
        "campaign", "run", tmp_path / "c.toml", "--out", tmp_path / "c.parquet", "-q", "--jobs", 1
    )
    assert code == told.code, err


BARE = "# mirotwin stream 2\n{head}#: expect.{name} = true\n#: [bare]\n#: bit_ticks = 1152\n#: begin_tick = {begin}\n"
JUMPS = """
MOV TMOD,#20h
MOV TH1,#0FDh
SETB TR1
MOV SCON,#50h
JNB RI,$
CLR RI
LJMP 1800h
"""


@pytest.mark.parametrize("end", ["", "#: end_tick = 4000000\n"], ids=["no end", "end_tick"])
@pytest.mark.parametrize(
    ("program", "name", "data", "verdict"),
    [
        (JUMPS, "no_fault", "01", "fault"),
        (SLEEPS, "no_fault", "61", "passed"),
        (SLEEPS, "never_sleeps", "3f", "failed"),
        (SLEEPS, "never_sleeps", "61", "passed"),
        (POLLS, "never_sleeps", "61", "not judged"),
    ],
)
def test_a_stream_for_a_bare_processor_has_one_verdict(mirotwin, tmp_path, program, name, data, verdict, end):
    """Without `end_tick` it ends 50 ms after its last character, and not with the first bit of that."""
    file = hex_file(tmp_path / "a.ihx", bytes(image(program).code[:256]))
    path = tmp_path / "a.stream"
    path.write_text(BARE.format(head=end, name=name, begin=100_000) + f"3000000 > {data}\n")
    code, out, _ = mirotwin("test", path, "--firmware", file)
    assert (out.startswith(VERDICTS[verdict].line), code) == (True, VERDICTS[verdict].code)
    assert mirotwin("replay", path, "--firmware", file, "-q")[0] == VERDICTS[verdict].code


def test_the_end_of_a_case_is_told_in_the_time_of_its_crystal(mirotwin, tmp_path):
    file = hex_file(tmp_path / "a.ihx", bytes(image(SLEEPS).code[:256]))
    path = tmp_path / "a.stream"
    head = BARE.format(head="#: end_tick = 5529600\n", name="no_fault", begin=100_000)
    path.write_text(head.replace("#: bit_ticks", "#: crystal_hz = 11059200\n#: bit_ticks") + "3000000 > 61\n")
    out = mirotwin.succeeds("test", path, "--firmware", file)
    assert f"{path} (500.000 ms, digest " in out


def test_a_run_that_was_ended_before_a_check_is_not_held_against_it(mirotwin, tmp_path):
    file, folder = tmp_path / "a.scenario.toml", tmp_path / "run"
    file.write_text(
        'scenario = "silent"\nduration_s = 0.3\n[expect]\ntracks_within_cm = { limit_cm = 9.0, from_s = 0.2 }\n'
    )
    said = "expectation not judged: tracks_within_cm: the run was ended before it"
    code, _, err = mirotwin("run", file, "--to", "100ms", "--out", tmp_path / "part", "-q", "--no-figure")
    assert (code, said in err) == (0, True)
    mirotwin.succeeds("run", file, "--out", folder, "-q", "--no-figure")
    code, _, err = mirotwin("replay", folder / "run.mcap", "-q", "--to", "100ms")
    assert (code, said in err) == (0, True)


def test_what_is_looked_into_ends_where_the_case_ends(mirotwin, tmp_path):
    """`silent` goes on for a minute, the case for 250 ms: 500 000 machine cycles, and the rest of a control period."""
    path = stream(tmp_path / "a.stream", "no_fault = true")
    profile = json.loads(mirotwin.succeeds("fw", "profile", path, "--json"))
    assert 500_000 <= profile["cycles"] < 500_000 + 66_734


def test_the_page_of_exit_codes_is_written_from_the_table():
    begin = "<!-- generated by python -m docs.site.exit_codes -->\n"
    page = (ROOT / "docs/exit-codes.md").read_text("utf-8")
    assert page.partition(begin)[2].partition("<!-- end of the generated part -->")[0] == exit_codes.render()


def test_a_program_that_is_still_loading_ends_by_ctrl_c_with_the_same_code():
    assert entry.INTERRUPTED == INTERRUPTED


def test_a_check_that_nobody_named_needs_no_occasion():
    assert judge(["passed"], ["not judged"]) == "passed"
    assert judge([], ["not judged"]) == "not observable"
    assert judge(["not judged"], ["passed"]) == "not judged"


def test_the_worst_of_several_files_decides():
    assert judge(["passed", "not judged", "fault", "failed"]) == "fault"
    assert judge(["not observable", "passed"]) == "passed"
    assert judge(["not observable"]) == "not observable"
    assert judge([]) == "passed"
