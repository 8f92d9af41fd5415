"""`test --sanitize`, `conform --sanitize` and `pytest --mirotwin-sanitize`: a green run that has a race in it."""

import json
import shlex
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.mirotwin.conform.images import PUSHES
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.testing.sessions import session
from tests.robot.inspect.programs import build
from tests.robot.mcs51.asm import assemble

BLINK = """\
#include <8052.h>
volatile unsigned int turns;
unsigned int began;
void tick(void) __interrupt(1)
{
    TH0 = 0xF8;
    turns++;
}
void main(void)
{
    TMOD = 0x01;
    TH0 = 0xF8;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    for (;;) {
        began = turns;
        while ((unsigned char)turns - (unsigned char)began < 3)
            ;
        P1_0 = !P1_0;
    }
}
"""
EXAMPLES = Path(__file__).parents[3] / "examples/boards"
RACE = "race program.c:17 turns"
BOARD = 'name = "blink"\nchip = "at89c52"\ncrystal_hz = 24_000_000\n'
SCENARIO = """\
name = "blink"
title = "A lamp goes off"
board = "blink.board.toml"
firmware = "program.ihx"
duration_s = 0.05

[[step]]
wait_for = "level"
pin = "P1.0"
level = 0
within_ms = 30
"""
TESTS = """
@pytest.mark.mirotwin(board="blink.board.toml", firmware="program.ihx")
def test_blinks(board):
    board.run_for(ms(20))

def test_nothing():
    pass
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blink")
    build(folder, BLINK)
    (folder / "blink.board.toml").write_text(BOARD)
    (folder / "blink.scenario.toml").write_text(SCENARIO)
    return folder


def test_a_green_scenario_fails_for_its_race(mirotwin, built):
    file = built / "blink.scenario.toml"
    code, out, _ = mirotwin("test", file)
    assert code == 0
    digest = out.split("digest ")[1][:12]
    code, out, _ = mirotwin("test", file, "--sanitize")
    assert code == 1
    assert f"digest {digest}" in out
    assert "may race  program.c:17 reads turns in pieces in main" in out
    assert f"mirotwin debug {file} --at " in out


def test_it_is_in_the_json(mirotwin, built):
    code, out, _ = mirotwin("test", built, "--sanitize", "--json")
    assert code == 1
    assert json.loads(out)["verdict"] == "failed"
    assert "program.c:17 reads turns in pieces" in out


def test_what_is_allowed_passes_and_what_is_stale_is_reported(mirotwin, built, tmp_path):
    allow = tmp_path / "allow.txt"
    allow.write_text(f"{RACE}  # only the low byte counts\nrace program.c:1 gone  # stale\n")
    code, _, err = mirotwin("test", built, "--sanitize", "--allow", allow)
    assert code == 0
    assert "race program.c:1 gone was not found" in err
    assert RACE not in err


def test_an_allow_file_needs_the_sanitizer(mirotwin, built):
    code, _, err = mirotwin("test", built, "--allow", "x")
    assert (code, "--allow needs --sanitize" in err) == (2, True)


def test_a_session_fails_for_a_race_in_a_green_test(built, tmp_path):
    for path in built.iterdir():
        shutil.copy(path, tmp_path)
    done = session(tmp_path, tests=TESTS)
    assert done.returncode == 0
    done = session(tmp_path, "--mirotwin-sanitize")
    assert done.returncode == 1
    assert "may race  program.c:17 reads turns in pieces in main" in done.stdout
    assert "first in blink.scenario.toml::blink" in done.stdout


def test_a_session_has_kinds_and_an_allow_file(built, tmp_path):
    for path in built.iterdir():
        shutil.copy(path, tmp_path)
    (tmp_path / "allow.txt").write_text(f"{RACE}  # a test\nrace program.c:1 gone  # stale\n")
    allow = "--mirotwin-sanitize-allow=allow.txt"
    for workers in ("-p", "no:xdist"), ("-p", "xdist", "-n", "2"):
        done = session(tmp_path, "--mirotwin-sanitize", allow, *workers, tests=TESTS, child=True)
        assert done.returncode == 0
        assert "allow.txt:2: race program.c:1 gone was not found" in done.stdout
        assert f"{RACE} was not found" not in done.stdout
    done = session(tmp_path, "--mirotwin-sanitize", "--mirotwin-sanitize-kind=overlay")
    assert done.returncode == 0
    assert session(tmp_path, "--mirotwin-sanitize", "--mirotwin-sanitize-kind=race").returncode == 1
    for wrong in ("--mirotwin-sanitize-kind=rare", allow):
        needs = ["--mirotwin-sanitize"] if "rare" in wrong else []
        assert session(tmp_path, wrong, *needs).returncode == 4


def test_one_kind_can_be_wanted_in_a_test(mirotwin, built):
    assert mirotwin("test", built, "--sanitize", "--kind", "overlay")[0] == 0
    code, out, _ = mirotwin("test", built, "--sanitize", "--kind", "race")
    assert (code, "--sanitize --kind race\n" in out) == (1, True)
    assert mirotwin("test", built, "--kind", "race")[0] == 2


TIMER_OF_ROBOT_1 = """
    JNB P1.0,$
    MOV TMOD,#11h
    SETB TR0
loop:
    MOV A,TL0
    MOV B,TH0
    MOV R6,#20
far:
    DJNZ R6,far
    SJMP loop
"""
TWO_ROBOTS = """\
scenario = "silent"
duration_s = 0.1

[[network]]
robots = 3

[[network.robot]]
slot = 0
reference = { kind = "line", start_x_cm = 20.0, start_y_cm = 40.0 }

[[network.robot]]
slot = 1
reference = { kind = "line", start_x_cm = 60.0, start_y_cm = 40.0 }
"""


def test_the_debugger_is_led_to_the_robot_that_it_is_of(mirotwin, tmp_path):
    image = hex_file(tmp_path / "robot.ihx", assemble(TIMER_OF_ROBOT_1))
    (tmp_path / "two.scenario.toml").write_text(TWO_ROBOTS)
    _, out, _ = mirotwin("test", tmp_path, "--firmware", image, "--sanitize")
    assert "may timer  0x0008 reads the halves of timer 0 apart" in out
    debug = shlex.split(next(line for line in out.splitlines() if " --at " in line))
    assert debug[-4:-1] == ["--slot", "1", "--at"]
    assert mirotwin(*debug[1:], "-x", "print/x $pc")[0] == 0


def test_conform_puts_findings_into_its_json_and_junit(mirotwin, tmp_path):
    image = hex_file(tmp_path / "robot.ihx", PUSHES)
    junit, folder = tmp_path / "j.xml", tmp_path / "left"
    ask = ("conform", image, "--rule", "P03", "--sanitize")
    code, out, err = mirotwin(*ask, "--json", "--junit", junit, "--artifacts", folder)
    assert code == 3
    document = json.loads(out)
    assert (document["verdict"], document["exit_code"]) == ("fault", 3)
    rule, found = document["cases"]
    assert (rule["rule"], found["rule"], found["verdict"]) == ("P03", "P03", "fault")
    assert found["group"] == "conform.sanitizer"
    assert found["lines"][0].startswith("did stack  0x0000 leaves bytes on the stack")
    assert found["lines"][1] == f"    {found['debug']}"
    assert found["lines"][1] in err
    case = ElementTree.parse(junit).findall(".//testcase")[1]
    assert case.find("failure").get("message") == found["lines"][0]
    code, out, _ = mirotwin(*shlex.split(found["debug"])[1:], "-x", "print/x $pc")
    assert (code, "$pc = 0x00" in out) == (0, True)
    code, out, err = mirotwin(*ask)
    assert code == 3
    assert f"    {found['reproduce'].replace(str(folder), 'failed')}\n" in err
    assert mirotwin(*ask, "--kind", "race")[0] == mirotwin(*ask[:-1])[0]
    (tmp_path / "allow.txt").write_text("stack  # a test\n")
    _, _, err = mirotwin(*ask, "--allow", tmp_path / "allow.txt")
    assert "did stack" not in err


POLL = """\
scenario = "silent"
duration_s = 1.0

[[step]]
pause_ms = 30

[[step]]
send = "poll"
slot = 0

[[step]]
wait_for = "answer"
within_ms = 200
"""


def test_what_a_wait_runs_twice_is_seen_once(mirotwin, tmp_path):
    """The wait for an answer goes back to its last bit, and the robot sends a part of it again."""
    (tmp_path / "poll.scenario.toml").write_text(POLL)
    plain = mirotwin("test", tmp_path / "poll.scenario.toml")
    assert plain[0] == 0
    assert mirotwin("test", tmp_path / "poll.scenario.toml", "--sanitize") == plain


UNREAD = """
    MOV RCAP2H,#0FFh
    MOV RCAP2L,#0B2h
    MOV T2CON,#34h
    MOV SCON,#50h
wait:
    JNB RI,wait
    CLR RI
    SJMP wait
"""


def test_fw_sanitize_plays_the_steps_of_a_robot(mirotwin, tmp_path):
    """What it finds needs the characters that a step sends."""
    image = hex_file(tmp_path / "robot.ihx", assemble(UNREAD))
    scenario = tmp_path / "poll.scenario.toml"
    scenario.write_text(POLL)
    _, in_test, _ = mirotwin("test", scenario, "--firmware", image, "--sanitize")
    code, out, _ = mirotwin("fw", "sanitize", scenario, "--firmware", image)
    found, debug = out.splitlines()
    assert code == 3
    assert found.startswith("did uart  0x000f clears RI, and never reads SBUF")
    assert f"    {found}\n    {debug}\n" in in_test
    assert mirotwin(*shlex.split(debug)[1:], "-x", "print/x $pc")[1].endswith("$pc = 0x0c\n")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", sorted(EXAMPLES.glob("*/*.scenario.toml")), ids=lambda path: path.stem)
def test_tests_of_the_example_boards_are_silent(mirotwin, scenario):
    code, out, _ = mirotwin("test", scenario)
    noted = mirotwin("test", scenario, "--sanitize")
    assert (code, out) == (0, noted[1])
    assert noted[0] == 0


def test_conform_finds_nothing_in_the_robots_firmware(mirotwin):
    plain = mirotwin("conform", "--rule", "P12")
    assert plain[0] == 0
    assert mirotwin("conform", "--rule", "P12", "--sanitize") == plain


@pytest.mark.slow
def test_no_rule_shows_anything_in_the_robots_firmware(mirotwin):
    code, _, err = mirotwin("conform", "--sanitize", "-q")
    assert (code, err) == (0, "")
