"""`mirotwin serve` of a board: a terminal program talks to it, lines on stdin act on its parts, and rates must fit."""

import os
import subprocess
import time

import pytest
import serial

from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board import BoardScenario
from mirotwin.ports.put_lines import PutLines
from mirotwin.ports.wire_port import WirePort
from mirotwin.recording import reader
from mirotwin.runs.spec import RunSpec
from tests.mirotwin.boards import CRYSTAL_HZ, IMAGE, files_of_board, world_of
from tests.mirotwin.ports.rig import NO_SELECTOR, served

MS = CRYSTAL_HZ // 1000


# The wire


def port_at(**spec):
    """The port of a board that echoes at 9600 baud, 10 ms after power-on."""
    world = RunSpec(
        scenario=BoardScenario(board=BoardSpec(crystal_hz=CRYSTAL_HZ, **spec)), image=IMAGE
    ).world()
    port = WirePort(world)
    world.run_to(10 * MS)
    return port


@pytest.mark.parametrize("baud", [0, 9600, 9500])
def test_what_is_sent_at_a_rate_that_the_receiver_takes_is_echoed(baud):
    port = port_at()
    assert port.takes(baud or 9600)
    assert (port.deaf_to(baud), port.mute_at(baud)) == ("", "")
    port.send(b"Hello", baud=baud)
    assert port.remark_on_sending(baud) == ""
    port.world.run_to(30 * MS)
    assert port.received() == b"Hello"
    assert (port.waiting, port.mute_at(9600)) == (0, "")


def test_a_port_of_another_rate_is_told_what_does_not_fit():
    port = port_at()
    assert port.deaf_to(19_200) == "sends at 19200 baud, and the board receives at 9600: nothing is passed on"
    assert port.deaf_to(0) == ""
    port.send(b"x", baud=9600)
    assert (
        port.deaf_to(19_200)
        == "sends at 19200 baud, and the wire has 9600 in this session: nothing is passed on"
    )
    assert not port.takes(19_200)
    assert port.deaf_to(2_000_000).endswith("the wire has 9600 in this session: nothing is passed on")
    port.world.run_to(30 * MS)
    assert port.mute_at(19_200) == "receives at 19200 baud, and the board sends at 9600: nothing is passed on"


def test_a_rate_that_the_crystal_does_not_allow_is_refused():
    port = port_at()
    assert not port.takes(921_600)
    assert "which the crystal does not allow" in port.deaf_to(921_600)


def test_a_receiver_of_another_rate_than_the_board_file_says_gets_what_comes_of_it():
    port = port_at(baud=4800)
    assert port.baud == 4800
    port.send(b"Hello")
    said = "sends at 4800 baud, and the board receives at 9600: it receives wrong characters"
    assert port.remark_on_sending(0) == said
    port.world.run_to(60 * MS)
    assert b"Hello" not in port.received()


def test_what_comes_before_the_receiver_is_on_waits_at_the_port():
    port = WirePort(world_of())
    assert port.room == 0
    port.world.run_to(MS)
    assert port.room > 0


# Lines for parts


class Lines(PutLines):
    """Those that a test writes into `pipe`; `shown` and `told` are what the user reads."""

    def __init__(self):
        self.shown, self.told = [], []
        reading, self.pipe = os.pipe()
        self.board_world = world_of()
        super().__init__(self.board_world, reading, NO_SELECTOR, self.shown.append, self.told.append)

    def after(self, text):
        os.write(self.pipe, text)
        self.exchange(self.board_world.tick)
        self.board_world.run_to(self.board_world.tick + MS)
        return self.shown[-1:] + self.told[-1:]


def test_lines_put_and_show_values_of_parts_also_where_they_come_in_pieces():
    lines = Lines()
    assert lines.after(b"lamp.on\n") == ["lamp.on = 0"]
    lines.after(b"key.pres")
    lines.after(b"sed = true\n\n")
    assert lines.after(b"lamp.on\r\n") == ["lamp.on = 1"]
    lines.after(b"?\n")
    assert lines.shown[-2:] == ["lamp.flashes = 1", "put key.pressed"]
    os.close(lines.pipe)
    lines.exchange(0)
    lines.exchange(0)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (b"key.presed = 1\n", "did you mean pressed?"),
        (b"kee.pressed = 1\n", "did you mean key?"),
        (b"key.pressed = 7\n", "key.pressed = 7"),
        (b"key.pressed = \n", "is no number, text or boolean"),
        (b"hello\n", "'hello' is not PART.KEY"),
        (b"\xff\xfe\n", "is not PART.KEY"),
    ],
)
def test_a_line_that_cannot_be_done_is_said_and_the_session_goes_on(line, said):
    lines = Lines()
    assert said in lines.after(line)[-1]
    assert lines.after(b"lamp.on\n")[0] == "lamp.on = 0"


# Sessions


def test_a_terminal_program_talks_to_a_board_while_its_parts_are_put(mirotwin, tmp_path):
    files_of_board(tmp_path)
    scenario = tmp_path / "lamp.scenario.toml"
    scenario.write_text('board = "lamp.board.toml"\nfirmware = "lamp.hex"\nduration_s = 1\n')
    out = tmp_path / "out"
    ports = ("--pty", tmp_path / "lamp", "--tcp", 0, "--rfc2217", 0)
    with served(scenario, *ports, "--out", out, stdin=subprocess.PIPE) as session:
        session.process.stdin.write("key.pressed = true\n")
        session.process.stdin.flush()
        for where in (f"{tmp_path / 'lamp'}", session.ports["tcp"][0], session.ports["rfc2217"][0]):
            with serial.serial_for_url(where, baudrate=9600, timeout=5) as port:
                port.write(b"Hello")
                assert port.read(5) == b"Hello"
        with pytest.raises(ValueError, match="rejected"):
            serial.serial_for_url(session.ports["rfc2217"][0], baudrate=19_200)
        session.stop()
    assert session.code == 130
    assert mirotwin("replay", out / "case.part.stream", "--firmware", tmp_path / "lamp.hex")[0] == 0
    code, said, _ = mirotwin("replay", out / "run.part.mcap")
    assert code == 0
    assert "the board does the same as recorded in all" in said
    events = ("-x", "until lamp.on", "-x", "until heard byte=0x6f", "-x", "print lamp.on")
    assert "lamp.on = 1" in mirotwin("debug", out / "run.part.mcap", *events)[1]
    recording = reader.read(out / "run.part.mcap")
    puts = [action.text for period in recording.periods for action in period.actions]
    assert puts == ["key.pressed = true"]
    assert recording.periods[-1].values[0].values["lamp.on"] == 1


def test_a_board_file_is_served_with_an_image_and_a_wrong_rate_is_one_line(tmp_path):
    board, image = files_of_board(tmp_path)
    link = tmp_path / "lamp"
    with served(
        board, "--firmware", image, "--pty", link, "--out", tmp_path / "out", stdin=subprocess.DEVNULL
    ) as session:
        for baud, echo in ((4800, b""), (9600, b"abc")):
            with serial.serial_for_url(f"{link}", baudrate=baud, timeout=5 if echo else 0.3) as port:
                port.write(b"abc")
                assert port.read(3) == echo
            time.sleep(0.05)
        session.stop()
    lines = [line for line in session.err.splitlines() if "baud" in line]
    assert len(lines) == 1
    assert lines[0].endswith(
        "a program sends at 4800 baud, and the board receives at 9600: nothing is passed on"
    )


def test_a_board_without_a_program_is_refused_in_one_line(mirotwin, tmp_path):
    board, _ = files_of_board(tmp_path)
    assert "no firmware is named; give --firmware IMAGE.hex" in mirotwin.refuses("serve", board)
