"""The pytest fixtures of a board: `board` and `serial`, what they say where they fail, and scenario files as tests."""

import re

import pytest

from miro_protocol import stream
from tests.mirotwin.testing.sessions import session
from tests.mirotwin.verify.boards.panel import DEAF, project
from tests.mutants.sdcc import needs_sdcc

pytestmark = needs_sdcc
MARK = 'pytestmark = pytest.mark.mirotwin(board="panel.board.toml", firmware="panel.ihx")\n'
WORKS = """
def test_it_answers(serial, board):
    serial.expect("ready\\r\\n", within_ms=50)
    assert serial.write(b"?") == 1
    match = serial.expect(pattern=r"count (\\d+)", within_ms=30)
    assert match[1] == b"7"
    board.run_for(ms(5))
    assert serial.read() == b"\\r\\n"
    serial.write("s?", gap_ms=20)
    assert serial.expect(b"7", within_ms=50).start() == 6
    assert serial.read() == b""

def test_it_has_a_key(board, serial):
    board.run_for(ms(20))
    assert board.pin("P3.2") == board.pin("key.pin") == 1
    board.press("key", for_ms=30)
    pressed = board.wait_for("value", of="key.closed", equals=True, within_ms=1)
    assert pressed.measured == 1
    serial.expect("k1", within_ms=10)
    board.wait_for(conditions.Edge(pin="key.pin", level=1), within_ms=40)
    board.run_for(ms(1))
    board.put("key.pressed", True)
    assert board.value("key.pressed") is True and board.pin("key.pin") == 0
    serial.expect("k2", within_ms=10)
    board.hold("value", 20, of="key.pressed", equals=True)
    board.never("text", 20, text="k3")

def test_it_blinks(board):
    pulse = board.wait_for("pulse", pin="BLINK", level=0, within_ms=200)
    assert 51_000 < pulse.measured < 53_000
    board.reset()
    board.power_off()
    board.power_on()
    board.wait_until_up()

@pytest.mark.mirotwin(expect={"pwm_at_least_hz": {"P2.0": 90}}, seed=3)
def test_its_pwm(board, world):
    board.run_for(ms(200))
    assert world.seed == 3
"""
FAILS = {
    'serial.expect("count", within_ms=50)': (
        r'no text with text = "count", sent was \'ready\\r\\n\', from tick 0 \(0.000 ms\) to tick 552960 \(50.000 ms\)'
    ),
    'board.wait_for("frequency", pin="P2.0", at_least_hz=200, within_ms=60)': (
        "no frequency with .*, found P2.0: . periods, the last 95.* Hz at"
    ),
    'board.wait_for("value", of="lamp.on", equals=7, within_ms=60)': "equals = 7.0 within 60 ms, found lamp.on = [01]",
    'board.hold("level", 300, pin="BLINK", level=1)': "level with .* for 300 ms: broken, from tick 0",
    'board.never("edge", 300, pin="BLINK")': "no edge with .* for 300 ms: broken",
    'board.wait_for("vale", of="lamp.on", equals=7)': "board: 'vale' is no event of a board; did you mean value",
    'board.wait_for("pulse", pin="P9.1", within_ms=1)': "pin: 'P9.1' is no pin, net or part's pin",
    'board.wait_for("pulse", pin="P1.1", width=1)': "pulse: width: unknown key",
    'board.wait_for("edge", pin="P1.1", within=ms(5))': r"within 5 ms, found P1.1: no edge, from tick 0 \(0",
    'board.put("key.presed", True)': "nothing can be put at 'presed' of part 'key' .button.; did you mean pressed",
    'board.press("lamp")': "lamp.pressed: nothing can be put",
    'board.value("key")': "'key' is not PART.KEY",
}
CASES = ("serial.expect", "frequency", "hold", "never", "within=ms")


def test_what_the_fixtures_do(tmp_path):
    project(tmp_path).unlink()
    done = session(tmp_path, "-q", tests=MARK + WORKS)
    assert done.returncode == 0, done.stdout
    assert "4 passed" in done.stdout


def test_what_fails_is_said_with_its_story_and_leaves_a_case(tmp_path):
    project(tmp_path).unlink()
    tests = "".join(f"\ndef test_{number}(board, serial):\n    {line}\n" for number, line in enumerate(FAILS))
    done = session(tmp_path, "--mirotwin-artifacts", "left", tests=MARK + tests)
    assert f"{len(FAILS)} failed" in done.stdout
    for line, message in FAILS.items():
        assert re.search(message, done.stdout), (line, done.stdout)
    assert "INTERNALERROR" not in done.stdout
    assert "scenario panel, seed 0, tick 552960 (50.000 ms)" in done.stdout
    assert re.search(r"\d\.\d+ ms PC: heard 72 65 61 64 79 0D 0A", done.stdout)
    cases = list((tmp_path / "left").rglob("case.stream"))
    assert len(cases) == len([line for line in FAILS if any(word in line for word in CASES)]) + 1
    for case in cases:
        assert stream.read(case).header.end_tick < 11_059_200, "where the test ended, not after a day"


def test_a_board_and_robots_are_told_apart(tmp_path):
    project(tmp_path).unlink()
    tests = MARK + "\ndef test_link(link):\n    pass\n\ndef test_robot(robot):\n    pass\n"
    done = session(tmp_path, "-q", tests=tests)
    assert "the test is of a board, which has no radio: use the fixtures board and serial" in done.stdout
    done = session(tmp_path, "-q", tests="def test_board(board):\n    pass\n")
    assert 'mark it @pytest.mark.mirotwin(board="NAME.board.toml"' in done.stdout


@pytest.mark.parametrize(
    ("mark", "message"),
    [
        ('board="panel.board.toml"', "firmware"),
        ('board="fig", firmware="panel.ihx"', "board='fig' is no board; name a file .board.toml, or one of"),
        ('board="no.board.toml", firmware="panel.ihx"', "no such"),
        ('board="panel.board.toml", scenario="fig6"', "has both board and scenario"),
        ("board=3", "board=3; give the path of a board file"),
    ],
)
def test_a_marker_that_cannot_be_meant_is_one_line(mark, message, tmp_path):
    project(tmp_path).unlink()
    done = session(tmp_path, "-q", tests=f"@pytest.mark.mirotwin({mark})\ndef test_it(board):\n    pass\n")
    assert done.returncode == 1
    assert message in done.stdout


def test_a_scenario_file_of_a_board_is_a_test(tmp_path):
    answers = '{ wait_for = "text", text = "ready\\r\\n" }, { send = "text", text = "?" },'
    project(tmp_path, f'{answers} {{ wait_for = "text", text = "count", within_ms = 20 }}', name="works")
    assert "1 passed" in session(tmp_path, "-q").stdout
    project(
        tmp_path, f'{answers} {{ wait_for = "text", text = "count", within_ms = 20 }}', "", DEAF, name="works"
    )
    done = session(tmp_path, "-q")
    assert "step failed: step 3: wait_for text" in done.stdout
    assert "found nothing was sent" in done.stdout


FLOOR = """
from miro_robot.parts.keys import STRONG, PartKeys, Pin
from miro_robot.parts.part import Part


class Floor(PartKeys, frozen=True, kw_only=True, tag="floor"):
    PINS = (Pin("out", STRONG),)
    PUTS = {"dark": bool}
    READS = {"dark": "whether it is"}

    def make(self, place):
        return FloorPart(self, place)


class FloorPart(Part):
    STATE = {"dark": "i"}

    def __init__(self, keys, place):
        super().__init__(keys, place)
        self.dark = 0
"""
OWN_PART = """
@pytest.mark.mirotwin(board="floor.board.toml", firmware="panel.ihx")
def test_it_is_light(board):
    board.put("floor.dark", True)
    assert not board.value("floor.dark")
"""


def test_a_part_of_ones_own_is_named_by_an_option_and_again_in_the_line_that_repeats_the_test(tmp_path):
    project(tmp_path).unlink()
    (tmp_path / "floor.py").write_text(FLOOR)
    (tmp_path / "floor.board.toml").write_text(
        'crystal_hz = 12_000_000\n[parts.floor]\npart = "floor"\npins = { out = "P1.7" }\n'
    )
    done = session(tmp_path, tests=OWN_PART, child=True)
    assert "'floor' is not one of the choices" in done.stdout
    done = session(tmp_path, "--mirotwin-part=floor.py:Floor", child=True)
    assert "--mirotwin-seed 0 --mirotwin-part floor.py:Floor" in done.stdout
    done = session(tmp_path, "--mirotwin-part=floor.py:Flor", child=True)
    assert (
        "--mirotwin-part: there is no class 'Flor' derived from PartKeys; did you mean Floor?" in done.stderr
    )
