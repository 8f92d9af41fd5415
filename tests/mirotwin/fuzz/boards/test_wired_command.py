"""`mirotwin fuzz` of a board with parts on the command line."""

import pytest

from miro_sim.scenario.board_scenario import load_any
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.fuzz.wired import WiredMachine
from mirotwin.shell.firmware_image import image_for
from tests.mirotwin.board_files import ECHO, board_folder

HANGS = ECHO.replace("MOV SBUF,A\nJNB TI,$", "CJNE A,#21h,good\nLJMP 4000h\ngood:\nMOV SBUF,A\nJNB TI,$")
"""The same, but ! jumps to where no program is."""

DEAF = """
again:
JB INT0,again
wait:
JNB INT0,wait
LJMP 4000h
"""
"""Never turns its receiver on; jumps to where no program is when the key is let go."""


def campaign(mirotwin, folder, source, *options):
    common = ("--time", "0.4s", "--minimise", "1s", "--out", str(folder / "out"))
    return mirotwin("fuzz", str(source), *common, *options)


def test_a_board_and_its_image_are_fuzzed_and_the_case_of_a_fault_gives_it_again(
    mirotwin, engines, tmp_path, monkeypatch
):
    monkeypatch.setattr("mirotwin.fuzz.fuzz_command.AFTER_S", 1.0)
    board_folder(tmp_path, program=HANGS)
    (tmp_path / "corpus").mkdir()
    (tmp_path / "corpus" / "first").write_bytes(b"\x09\x02a!b")
    image = str(tmp_path / "lamp.hex")
    board = tmp_path / "lamp.board.toml"
    corpus = ("--corpus", str(tmp_path / "corpus"))
    code, _, err = campaign(mirotwin, tmp_path, board, "--firmware", image, *corpus)
    assert code == 1, err
    assert "inputs begin at tick" in err
    assert "they put key.pressed" in err
    case = next((tmp_path / "out" / "crashes").glob("no_fault-*.stream"))
    assert case.read_text().splitlines()[-1].endswith(" > 21")
    code, _, err = mirotwin("replay", str(case), "--firmware", image)
    assert (code, err.startswith("mirotwin: fails as recorded: no_fault")) == (3, True)
    assert mirotwin("test", str(case), "--firmware", image)[0] == 3
    assert mirotwin("replay", str(case), "--firmware", str(tmp_path / "inverted.hex"))[0] == 0


def test_firmware_without_a_serial_port_is_fuzzed_by_what_its_parts_say(mirotwin, engines, tmp_path):
    board_folder(tmp_path, program=DEAF)
    (tmp_path / "corpus").mkdir()
    (tmp_path / "corpus" / "press").write_bytes(b"\x01\x00\x01\x00\x0a\x40\x01\x00\x00\x00\x0a\x40")
    options = (
        "--firmware",
        str(tmp_path / "lamp.hex"),
        "--boot-ms",
        "20",
        "--corpus",
        str(tmp_path / "corpus"),
    )
    code, _, err = campaign(mirotwin, tmp_path, tmp_path / "lamp.board.toml", *options)
    assert "after 20 ms, its receiver is off; they put key.pressed" in err
    assert code == 1, err


def test_what_a_stream_of_another_board_puts_is_left_out(mirotwin, engines, tmp_path):
    board_folder(tmp_path)
    (tmp_path / "corpus").mkdir()
    (tmp_path / "corpus/other.stream").write_text(
        "# mirotwin stream 3\n1000 * eyes.distance_cm = 60\n400000 > 68 69\n"
    )
    options = ("--firmware", str(tmp_path / "lamp.hex"), "--corpus", str(tmp_path / "corpus"))
    code, _, err = campaign(mirotwin, tmp_path, tmp_path / "lamp.board.toml", *options)
    assert code == 0, err


CONTENDS = """
crystal_hz = 11_059_200
[parts.key]
part = "button"
pins = { pin = "OTHER" }
[parts.driver]
part = "l298"
pins = { ena = "1", in1 = "P2.0", in2 = "P2.1", out1 = "OTHER", out2 = "B" }
[parts.motor]
part = "dc_motor"
pins = { a = "OTHER", b = "B" }
"""


def test_two_drivers_of_one_net_are_a_crash_and_a_board_says_what_drives_rxd(mirotwin, tmp_path):
    board_folder(tmp_path)
    board = tmp_path / "lamp.board.toml"
    board.write_text(CONTENDS)
    text = load_any(str(board), ("duration_s=1",))
    image = image_for(text, str(tmp_path / "lamp.hex"))
    target = BoardTarget(image, machine=WiredMachine(text.scenario, image))
    which = [path for path, _ in target.machine.choices].index("key.pressed")
    press = bytes([1, which, 1, 0])
    assert target.run(b"\x09\x00a") == 0
    assert target.run(b"\x09\x00a" + press + b"\x09\x00b") == 1
    assert "let two outputs of different level drive one net" in target.failure.what
    run = BoardOracle(target, {}).confirm(press, target.failure)
    assert (run.failure.check, run.failure.fault) == ("no_fault", True)
    board.write_text(CONTENDS.replace('pin = "OTHER"', 'pin = "P3.0"'))
    said = mirotwin.ends(2, "fuzz", str(board), "--firmware", str(tmp_path / "lamp.hex"), "--time", "1s")
    assert "something on the board drives P3.0 (RXD)" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("lamp.board.toml",), "no firmware is named; give --firmware IMAGE.hex"),
        (("lamp.scenario.toml", "--bare"), "--bare is not for a board with parts, which"),
        (("lamp.scenario.toml", "--slot", "1"), "--slot is not for a board with parts, which"),
        (("lamp.scenario.toml", "--steps", "4"), "--steps: 4 of 0 steps; give fewer"),
        (("lamp.scenario.toml", "--expect", "nothing"), "there is no such check"),
        (("lamp.scenario.toml", "--set", "put.key.pressd=true"), "did you mean pressed?"),
        (("lamp.hex", "--steps", "4"), "--steps needs a BOARD"),
        (("none.board.toml",), "no such file"),
    ],
)
def test_what_cannot_be_fuzzed_is_refused_in_one_line(mirotwin, engines, tmp_path, arguments, said):
    path = board_folder(tmp_path).parent / arguments[0]
    out = tmp_path / "out"
    assert said in mirotwin.ends(2, "fuzz", str(path), *arguments[1:], "--time", "1s", "--out", str(out))
    assert not out.exists()
