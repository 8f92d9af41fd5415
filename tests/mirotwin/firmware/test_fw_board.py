"""`fw` commands with a board around the image: `--board`, or the board file as the subject."""

import json

import pytest

from tests.mirotwin.boards import CRYSTAL_HZ, files_of_board
from tests.mirotwin.firmware.test_fw_vcd import characters


@pytest.fixture
def board(tmp_path, monkeypatch):
    files_of_board(tmp_path)
    (tmp_path / "in").write_bytes(b"Hello")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_an_image_runs_on_a_board_and_its_parts_are_in_the_dump(mirotwin, board):
    options = ("--board", "lamp.board.toml", "--stdin", "in", "--max-cycles", 20_000, "--dump", "dump.json")
    code, said, _ = mirotwin("fw", "run", "lamp.hex", *options)
    assert (code, said) == (42, "Hello")
    parts = json.loads((board / "dump.json").read_text())["parts"]
    assert parts == {"key.pressed": False, "key.closed": False, "lamp.on": 0, "lamp.flashes": 0}


@pytest.mark.parametrize(
    "subject", [("lamp.hex", "--board", "lamp.board.toml"), ("lamp.board.toml", "--firmware", "lamp.hex")]
)
def test_a_board_is_a_subject_and_sigrok_reads_its_waveform(mirotwin, board, subject):
    mirotwin.ends(0, "fw", "vcd", *subject, "--stdin", "in", "--to", "20ms", "--out", "lamp.vcd")
    vcd = (board / "lamp.vcd").read_text()
    nets = vcd.split("$scope module nets $end")[1].split("$upscope")[0]
    assert [line.split()[4] for line in nets.splitlines() if "$var" in line] == ["KEY", "P1_0"]
    assert f"ticks of {CRYSTAL_HZ} Hz" in vcd
    for wire in ("rxd", "txd"):
        assert bytes(byte for _, byte in characters(board / "lamp.vcd", wire)) == b"Hello"


def test_times_are_those_of_the_crystal_of_the_board(mirotwin, board):
    window = ("--from", "1ms", "--to", "1.1ms")
    said = mirotwin.succeeds("fw", "trace", "lamp.board.toml", "--firmware", "lamp.hex", *window)
    ticks = [int(line.split()[0]) for line in said.splitlines()[1:]]
    assert CRYSTAL_HZ // 1000 <= ticks[0] < ticks[-1] < CRYSTAL_HZ * 11 // 10_000


def test_the_scenario_of_a_board_is_a_subject_with_what_it_puts(mirotwin, board):
    lines = (
        'board = "lamp.board.toml"\nfirmware = "lamp.hex"\nduration_s = 0.2\nput = { key.pressed = true }\n'
    )
    (board / "lamp.scenario.toml").write_text(lines)
    assert "lamp.on is true" in mirotwin.succeeds("debug", "lamp.scenario.toml", "-x", "until lamp.on")
    assert "machine cycles" in mirotwin.succeeds("fw", "profile", "lamp.scenario.toml")
    said = mirotwin.refuses("fw", "trace", "lamp.scenario.toml", "--slot", 2)
    assert said == "lamp.scenario.toml: is a board, --slot does not apply to it; leave it out"


STEPS = """
[[step]]
pause_ms = 20
[[step]]
send = "text"
text = "hi"
[[step]]
put = { key.pressed = false }
"""


def test_steps_of_a_board_are_done_first_so_that_its_run_can_be_looked_into_and_gone_back_in(mirotwin, board):
    lines = (
        'board = "lamp.board.toml"\nfirmware = "lamp.hex"\nduration_s = 0.2\nput = { key.pressed = true }\n'
    )
    (board / "lamp.scenario.toml").write_text(lines + STEPS)
    mirotwin.ends(0, "fw", "vcd", "lamp.scenario.toml", "--out", "lamp.vcd")
    for wire in ("rxd", "txd"):
        assert bytes(byte for _, byte in characters(board / "lamp.vcd", wire)) == b"hi"
    said = mirotwin.succeeds(
        *(
            "debug",
            "lamp.scenario.toml",
            "-x",
            "until key.pressed == 0",
            "-x",
            "goto 1ms",
            "-x",
            "print key.pressed",
        )
    )
    assert "key.pressed == 0 is true" in said
    assert said.strip().endswith("key.pressed = 1")
    (board / "lamp.scenario.toml").write_text(
        lines + STEPS.replace("pause_ms = 20", 'wait_for = "text"\ntext = 1')
    )
    assert "step 1" in mirotwin.refuses("debug", "lamp.scenario.toml", "-x", "quit")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fw", "run", "lamp.hex", "--board", "lamp.board.toml", "--crystal", 12_000_000), "is a board, --crystal"),
        (("fw", "run", "lamp.hex", "--board", "lamp.board.toml", "--pins", "in"), "put a button or a strap there"),
        (("fw", "run", "lamp.hex", "--board", "lmp.board.toml"), "lmp.board.toml: no such file"),
        (("fw", "trace", "lamp.board.toml"), "no program for it is named; give --firmware IMAGE.hex"),
        (("fw", "run", "lamp.hex", "--part", "no.py:Lamp"), "no.py"),
        (("fw", "profile", "lamp.hex", "--board", "lamp.board.toml"), "how long to look is missing; give --to TIME"),
    ],
)  # fmt: skip
def test_what_a_board_cannot_have_is_one_line_and_exit_code_2(mirotwin, board, arguments, said):
    assert said in mirotwin.refuses(*arguments)
