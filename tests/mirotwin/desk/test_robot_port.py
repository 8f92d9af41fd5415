"""Ports that vanish, block, deliver garbage or are in use, and what may be sent to a robot that can hurt."""

import errno
import os
import re
import signal
import socket
import subprocess
import termios
import threading
import tty
from contextlib import suppress
from queue import Queue
from unittest.mock import Mock

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Reset
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from miro_sim.world.conditions import CONDITIONS, Answer, Heard, Sent, Text
from miro_sim.world.machine import NotObservable
from mirotwin import Telemetry
from mirotwin.desk import robot_port
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import PortError, RobotPort
from mirotwin.runs.spec import silent_scenario
from mirotwin.testing.link import Link
from tests import children
from tests.mirotwin.desk.rig import ROBOT, stream_text
from tests.mirotwin.ports.rig import sent_bytes, served
from tests.mirotwin.program import COMMAND

MS = 24_000
SCENARIO = silent_scenario(())
DRIVE = encode(TeamFrame(0, 20, ((300, 300),) * 3), 3)


class Pty:
    """A pseudo-terminal: the test has its master side, where a robot would be."""

    def __init__(self):
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self.slave = slave

    def read(self):
        os.set_blocking(self.master, False)
        found = b""
        with suppress(OSError):
            while data := os.read(self.master, 4096):
                found += data
        return found

    def close(self):
        for one in (self.master, self.slave):
            with suppress(OSError):
                os.close(one)


@pytest.fixture
def pty():
    found = Pty()
    yield found
    found.close()


def robots_at(url, motion=True, note=print):
    return RobotPort(DeskOptions(port=str(url), allow_motion=motion), SCENARIO, note=note)


def stops(data):
    """Whether what was sent ends with three frames that tell all robots to stand."""
    found = [event.message(3) for event in Decoder(3).feed(data) if isinstance(event, Received)]
    return [frame.velocities for frame in found[-3:]] == [((0, 0),) * 3] * 3


def test_a_port_that_is_closed_has_told_its_robots_to_stop(pty):
    with robots_at(pty.path) as port:
        port.inject(DRIVE)
        assert pty.read() == DRIVE
    assert stops(DRIVE + pty.read())


def broken_off(path, do, error, motion=True):
    """A talk that ends by an error; the error's line."""
    with pytest.raises(error) as caught, robots_at(path, motion) as port:
        do(port)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, SystemExit])
def test_whatever_ends_a_talk_the_robots_are_told_to_stop_first(pty, error):
    def do(port):
        port.inject(DRIVE)
        raise error

    broken_off(pty.path, do, error)
    assert stops(pty.read())


def test_what_is_not_allowed_is_not_sent(pty):
    said = broken_off(pty.path, lambda port: port.inject(DRIVE), BadInput, False)
    assert "--allow-motion" in said
    sent = pty.read()
    assert stops(sent)
    assert DRIVE not in sent


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="needs Linux")
def test_only_a_port_of_the_wall_clock_asks_for_priority_and_gives_it_back(pty):
    before = os.sched_getscheduler(0)
    with robots_at(pty.path) as port:
        assert (os.sched_getscheduler(0) == os.SCHED_FIFO) == port.prompt
    assert os.sched_getscheduler(0) == before
    with robots_at(ROBOT):
        assert os.sched_getscheduler(0) == before


def test_characters_come_with_the_time_at_which_they_were_there(pty):
    with robots_at(pty.path) as port:
        os.write(pty.master, b"abc")
        port.run_for(20 * MS)
        before = port.tick
    assert [one.data for one in port.wire] == [b"abc"]
    assert port.wire[0].end_tick <= before


def test_a_link_waits_for_an_answer_at_a_port():
    with robots_at(ROBOT) as port:
        port.greet()
        link = Link(port)
        link.poll(slot=0)
        assert link.expect(Telemetry, within=80 * MS).accepted == 1


def test_a_frame_over_tcp_does_not_wait_until_the_one_before_is_acknowledged():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        url = f"socket://127.0.0.1:{listening.getsockname()[1]}"
        with robots_at(url) as port, socket.socket(fileno=os.dup(port._serial.fileno())) as same:
            assert same.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_port_that_vanishes_is_told_in_one_line(pty):
    def do(port):
        port.inject(DRIVE)
        pty.close()
        port.run_for(500 * MS)

    said = broken_off(pty.path, do, PortError)
    assert re.match(f"{pty.path}: [0-9.]+ s: the port is lost: ", said)


def test_a_port_that_comes_back_gets_the_stop_frames(pty, tmp_path):
    other, link = Pty(), tmp_path / "radio"
    link.symlink_to(pty.path)

    def do(port):
        port.inject(DRIVE)
        link.unlink()
        link.symlink_to(other.path)
        pty.close()
        port.run_for(500 * MS)

    broken_off(link, do, PortError)
    assert stops(other.read())
    other.close()


def test_a_port_that_takes_nothing_more_is_told_and_its_buffer_is_emptied_for_the_stop_frames(pty):
    def do(port):
        for _ in range(100):
            port.inject(DRIVE * 40)

    said = broken_off(pty.path, do, PortError)
    assert "it takes no characters for 1 s; look at its flow control" in said
    assert stops(pty.read())


@pytest.mark.parametrize("scheme", ["", "spy://"])
def test_a_port_of_another_program_is_not_opened(pty, scheme):
    with robots_at(pty.path), pytest.raises(PortError, match="another program has it open; end that"):
        robots_at(f"{scheme}{pty.path}")


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.EACCES, "no permission to open it; join the group"),
        (errno.EBUSY, "another program has it open"),
    ],
)
def test_a_port_that_the_system_refuses_is_told_with_a_remedy(monkeypatch, number, said):
    def refuse(*given, **named):
        raise serial.SerialException(number, f"could not open port: {os.strerror(number)}")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(PortError, match=f"^/dev/ttyUSB9: {said}"):
        robots_at("/dev/ttyUSB9")


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("/dev/nothing", "there is no such port"),
        ("socket://127.0.0.1:1", "cannot be opened"),
        ("nonsense://x", "cannot be opened"),
        ("socket://127.0.0.1", "names no port; write socket://HOST:PORT, such as socket://127.0.0.1:7000"),
        ("socket://127.0.0.1:abc", "names no port; write socket://HOST:PORT"),
        ("socket://127.0.0.1:99999", "names no port; write socket://HOST:PORT"),
        ("RFC2217://127.0.0.1?logging=debug", "names no port; write rfc2217://HOST:PORT"),
        ("miro://nothing", "cannot be opened"),
    ],
)
def test_a_port_that_is_none_is_told_in_one_line(url, said):
    with pytest.raises(PortError, match=said) as caught:
        robots_at(url)
    assert "\n" not in str(caught.value)


def answering(pty, answer):
    """A thread that answers what comes until the terminal is gone."""

    def run():
        with suppress(OSError):
            while data := os.read(pty.master, 4096):
                os.write(pty.master, answer(data))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


def answer_ahead(data, steps):
    """Of the robot that is asked, with the number of a question that comes so many steps later."""
    asked = [event.seq for event in Decoder(3).feed(data) if isinstance(event, Received)]
    return b"".join(encode(TelemetryFrame((seq + steps) % 64, seq % 3), 3) for seq in asked)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda data: data, "the port echoes what is sent; turn the echo"),
        (lambda data: bytes(7), "[0-9]+ characters come that are no answer, 00 00 .*9600 baud"),
        (lambda data: b"", "nothing comes; is it switched on"),
        (lambda data: encode(TelemetryFrame(40, 1), 3), "but others answer; is it a network of another"),
        (lambda data: answer_ahead(data, 3), "but others answer; is it a network of another"),
    ],
    ids=["echo", "garbage", "silence", "answers without a question", "answers to later questions"],
)
def test_what_is_no_robot_is_told_by_what_it_does(pty, answer, said):
    answering(pty, answer)
    told = broken_off(pty.path, RobotPort.greet, BadInput, False)
    assert re.search(said, told)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_the_robot_and_leaves_what_was_recorded(tmp_path, number, code):
    (tmp_path / "drive.stream").write_text(stream_text(2000))
    with served("fig6", "--tcp", 0, "--out", tmp_path / "session", "--once") as session:
        url = f"socket://127.0.0.1:{session.number()}"
        command = [*COMMAND, "replay", "drive.stream", "--port", url, "--allow-motion"]
        process = children.start(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        for line in process.stderr:
            if "all times are" in line:
                break
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=1.0)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
        assert process.returncode == code, err
        session.wait()
    assert stops(sent_bytes(tmp_path / "session" / "run.mcap"))
    assert (tmp_path / "runs/drive-port/run.part.mcap").exists()


# ---- ports that are hostile, or go at the worst moment -------------------------------------------------------


@pytest.mark.parametrize("call", ["reset_output_buffer", "write", "close"])
def test_a_port_that_vanishes_with_ctrl_c_is_opened_again_for_the_stop_frames(pty, monkeypatch, call):
    """The terminal's own error is no OSError."""
    broken = [termios.error(errno.EIO, "Input/output error")]

    def do(port):
        port.inject(DRIVE)
        was = getattr(port._serial, call)

        def fails_once(*given):
            if broken:
                raise broken.pop()
            return was(*given)

        monkeypatch.setattr(port._serial, call, fails_once)
        raise KeyboardInterrupt

    broken_off(pty.path, do, KeyboardInterrupt)
    assert stops(pty.read())


@pytest.mark.parametrize("scheme", ["", "rfc2217://"])
def test_stop_frames_do_not_depend_on_what_is_taken_back_before_them(pty, monkeypatch, scheme):
    """`rfc2217://` waits for a confirmation, which is late behind a flood of characters."""

    def refuse():
        assert not scheme, "it would wait"
        raise serial.SerialException("timeout while waiting for option 'purge'")

    with robots_at(pty.path) as port:
        port.inject(DRIVE)
        port.url = f"{scheme}{pty.path}"
        monkeypatch.setattr(port._serial, "reset_output_buffer", refuse)
        monkeypatch.setattr(robot_port, "_opened", Mock(side_effect=PortError("", "", "gone")))
    assert stops(pty.read())


def test_what_a_thread_of_the_port_has_read_is_bounded(pty):
    with robots_at(pty.path) as port:
        unread = port._serial._read_buffer = Queue()
        for _ in range(70_000):
            unread.put(b"\x55")
        port.run_for(MS)
        assert (unread.qsize(), port.dropped) == (0, 70_000)


def test_a_port_that_refuses_to_be_set_up_is_told_in_one_line(pty, monkeypatch):
    def refuse(*given, **named):
        raise termios.error(errno.EIO, "Input/output error")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(PortError, match="cannot be opened: "):
        robots_at(pty.path)


def test_a_blocked_port_takes_nothing_more_but_stop_frames(pty):
    """What was sent last may have ended anywhere, so nothing is known of a window over it and what comes next."""

    def do(port):
        with suppress(PortError):
            for _ in range(100):
                port.inject(DRIVE * 40)
        pty.read()
        port.inject(DRIVE)

    assert "it takes no characters" in broken_off(pty.path, do, PortError)
    assert stops(pty.read())


@pytest.mark.parametrize("many", [1, 5000])
def test_characters_that_come_faster_than_the_line_carries_them_are_left_out(pty, many):
    answer = encode(TelemetryFrame(40, 1), 3)
    notes = []
    with robots_at(pty.path, note=notes.append) as port:
        for _ in range(many):
            port._take(answer)
        kept = sum(len(sent.data) for sent in port.wire)
        assert kept + port.dropped + port._decoder.pending == many * len(answer)
        assert port._end_tick - port._now < 80 * 24_000_000
    assert ("characters are left out, which came faster than 9600 baud carries" in str(notes)) == (many > 1)


def test_what_is_inside_a_robot_is_refused_with_the_reason():
    inside = [kind for kind in CONDITIONS.values() if kind not in (Answer, Heard, Sent, Text)]
    needed = {"pin": "txd", "address": 0, "left_m_s": 0.0, "level": 0, "of": "eyes.distance_cm", "above": 0.0}
    with robots_at(ROBOT) as port:
        for kind in inside:
            fields = {key: value for key, value in needed.items() if key in kind.__struct_fields__}
            with pytest.raises(NotObservable, match="not observable on a port: it is inside the robot"):
                port.run_until(kind(**fields), within=0)
        with pytest.raises(
            NotObservable, match="Reset: not observable on a port: only a twin has such a switch"
        ):
            port.do(Reset(port.earliest_action_tick, 0, 0, 1))
        with pytest.raises(NotObservable, match="no serial port sends a bad stop bit"):
            port.inject(b"U", bad_stop=(0,))


def test_a_robot_that_talks_all_the_time_for_an_hour_is_heard_whole(pty, monkeypatch):
    now = 0
    monkeypatch.setattr(RobotPort, "_now", property(lambda port: now))
    with robots_at(pty.path) as port:
        for now in range(0, 3600 * 24_000_000, 24_000_000):  # noqa: B007  # the port reads it
            port._take(bytes(970))  # a second of a line that is 1 % fast
        assert not port.dropped


class Periods:
    """A recorder that keeps what it is given."""

    def __init__(self):
        self.periods = []

    def write(self, period):
        self.periods.append(period)

    def flush_if_due(self):
        pass


TICKS = st.integers(0, 40 * 800_800)


@given(st.lists(TICKS, max_size=30), st.lists(TICKS, max_size=4))
def test_each_transmission_is_recorded_in_its_control_period(ticks, stops):
    port = RobotPort.__new__(RobotPort)
    port.recorder, port._recorded = Periods(), 0
    port.wire = [Transmission(tick, "<", bytes([1 + tick % 250])) for tick in ticks]
    for stop in (*sorted(stops), 50 * 800_800):
        port._record(stop)
    assert not port.wire
    assert [period.index for period in port.recorder.periods] == list(range(50))
    for period in port.recorder.periods:
        inside = sorted(tick for tick in ticks if period.tick <= tick < period.tick + 800_800)
        assert [sent.tick for sent in period.wire] == inside


@pytest.mark.slow
def test_ctrl_c_ends_a_talk_with_a_peer_that_floods_answers(tmp_path, pty):
    (tmp_path / "drive.stream").write_text(stream_text(2000))
    over, known = threading.Event(), threading.Event()

    def flood():
        """Answers each question, and once the robots are known without a pause."""
        os.set_blocking(pty.master, False)
        decoder, seq = Decoder(3), 0
        while not over.is_set():
            asked = []
            with suppress(OSError):
                events = decoder.feed(os.read(pty.master, 4096))
                asked = [event.seq for event in events if isinstance(event, Received)]
            seq = asked[-1] if asked else seq
            answers = [seq + k for k in range(3)] * 20 if known.is_set() else asked
            with suppress(OSError):
                os.write(pty.master, b"".join(encode(TelemetryFrame(n % 64, n % 64 % 3), 3) for n in answers))

    thread = threading.Thread(target=flood, daemon=True)
    thread.start()
    command = [*COMMAND, "replay", "drive.stream", "--port", pty.path, "--allow-motion", "-q"]
    process = children.start(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    try:
        for line in process.stderr:
            if "all times are" in line:
                known.set()
                break
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=5.0)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20)
    finally:
        over.set()  # the number of a closed terminal soon is that of another file
        thread.join()
        process.kill()
    assert process.returncode == 130, err
    assert "characters are left out, which came faster" in err
    assert (tmp_path / "runs/drive-port/run.part.mcap").exists()
