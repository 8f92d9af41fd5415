"""`test --sanitize`, `conform --sanitize` and `pytest --mirotwin-sanitize`: a green run that has a race in it."""

import json
import shutil
from pathlib import Path

import pytest

from tests.mirotwin.testing.sessions import session
from tests.robot.inspect.programs import build

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
