"""Programs that know nothing of Mirotwin: miniterm, socat and one that uses pyserial, on every plug."""

import json
import os
import shutil
import sys
import time
from pathlib import Path

import pytest
import serial

from tests import children
from tests.mirotwin.ports.rig import ANSWER_BYTES, CLEAN, ROOT, python, question, replays, sent_bytes, served
from tests.mirotwin.terminal import terminal

A_PROGRAM = """
import sys, serial
port = serial.serial_for_url(sys.argv[1], 9600, timeout=2)
for seq in range(0, 12, 3):
    port.write(bytes.fromhex(sys.argv[2 + seq // 3]))
    answer = port.read(19)
    print(len(answer), answer[:6].hex())
port.close()
"""
"""Somebody's program: pyserial and nothing else."""
ANSWERED = "19 55555555ff2d\n" * 4


@pytest.fixture
def site(tmp_path):
    """pyserial with our handler beside its own, as an installation lays them out."""
    folder = tmp_path / "site"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(serial.__file__).parent, folder / "serial", ignore=ignored)
    handler = ROOT / "sim/plugs/serial/urlhandler/protocol_miro.py"
    shutil.copy(handler, folder / "serial/urlhandler/protocol_miro.py")
    return folder


def with_site(site):
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)])}


def option_of(kind, folder):
    return ("--pty", folder / "radio") if kind == "pty" else (f"--{kind}", 0)


def questions():
    return [question(seq).hex() for seq in range(0, 12, 3)]


def test_a_program_that_knows_pyserial_talks_to_a_robot_in_its_own_process(site):
    url = "miro://fig6?set=network.radio.bit_error_rate=0"
    done = python(A_PROGRAM, url, *questions(), env=with_site(site))
    assert (done.returncode, done.stdout, done.stderr) == (0, ANSWERED, "")


def test_importing_pyserial_loads_nothing_of_ours(site):
    code = "import serial, sys; print([name for name in sys.modules if name.startswith('miro') or 'protocol_' in name])"
    assert python(code, env=with_site(site)).stdout == "[]\n"


@pytest.mark.parametrize("kind", ["pty", "tcp", "rfc2217"])
def test_the_same_program_talks_to_a_served_robot(kind, tmp_path):
    option = option_of(kind, tmp_path)
    with served("fig6", *option, *CLEAN, "--once", "--pace", 2, "--out", tmp_path / "out") as session:
        done = python(A_PROGRAM, session.ports[kind][0], *questions())
        assert (done.returncode, done.stdout, done.stderr) == (0, ANSWERED, "")
        session.wait()
    assert session.code == 0
    assert sent_bytes(tmp_path / "out/run.mcap").hex() == "".join(questions())
    assert replays(tmp_path / "out/run.mcap") > 3
    (plug,) = json.loads((tmp_path / "out/summary.json").read_bytes())["live"]["plugs"]
    del plug["name"]
    assert plug == {"clients": 1, "refused": 0, "bytes_in": 92, "bytes_out": 76, "dropped": 0}


@pytest.mark.parametrize("kind", ["miro", "pty", "tcp", "rfc2217"])
def test_miniterm_sends_what_is_typed_and_shows_what_the_robot_answers(kind, site, tmp_path):
    def use(url):
        command = [sys.executable, "-m", "serial.tools.miniterm", "--encoding", "hexlify", url]
        with terminal(*command, env=with_site(site), start_new_session=True) as miniterm:
            miniterm.until("Help:")
            time.sleep(0.3)  # it makes the terminal its own after that line
            miniterm.type(question(0).hex(" ").upper() + " ")
            miniterm.until("55 55 55 55 FF 2D D4 ")
            miniterm.type("\x1d")
        assert miniterm.process.returncode == 0

    if kind == "miro":
        use("miro://fig6?realtime=1&set=network.radio.bit_error_rate=0")
        return
    option = option_of(kind, tmp_path)
    with served("fig6", *option, *CLEAN, "--once", "--out", tmp_path / "out") as session:
        use(session.ports[kind][0])
        session.wait()
    assert session.code == 0
    assert sent_bytes(tmp_path / "out/run.mcap") == question(0)
    assert replays(tmp_path / "out/run.mcap") > 3


@pytest.mark.skipif(shutil.which("socat") is None, reason="needs socat")
@pytest.mark.parametrize("kind", ["pty", "tcp"])
def test_socat_talks_to_a_robot(kind, tmp_path):
    option = option_of(kind, tmp_path)
    with served("fig6", *option, *CLEAN, "--once", "--out", tmp_path / "out") as session:
        where = f"TCP:127.0.0.1:{session.number()}" if kind == "tcp" else f"{tmp_path / 'radio'},raw,echo=0"
        command = ["socat", "-t", "0.4", "-", where]
        done = children.run(command, input=question(0), capture_output=True, timeout=60, check=False)
        session.wait()
    assert (done.returncode, len(done.stdout), session.code) == (0, ANSWER_BYTES, 0)
    assert replays(tmp_path / "out/run.mcap") > 3


def test_two_programs_on_two_ports_both_send_and_both_hear(tmp_path):
    ports = ("--tcp", 0, "--pty", tmp_path / "radio")
    with served("fig6", *ports, *CLEAN, "--once", "--out", tmp_path / "out") as session:
        one = serial.serial_for_url(session.ports["tcp"][0], timeout=2)
        other = serial.serial_for_url(str(tmp_path / "radio"), timeout=2)
        time.sleep(0.1)
        one.write(question(0))
        heard = one.read(ANSWER_BYTES), other.read(ANSWER_BYTES)
        other.write(question(3))
        heard += one.read(ANSWER_BYTES), other.read(ANSWER_BYTES)
        one.close()
        other.close()
        session.wait()
    assert [len(one) for one in heard] == [ANSWER_BYTES] * 4
    assert (heard[0], heard[2]) == (heard[1], heard[3])
    assert sent_bytes(tmp_path / "out/run.mcap") == question(0) + question(3)


def test_a_port_of_each_network(tmp_path):
    scenario = ROOT / "examples/two_teams.toml"
    settings = [word for index in (0, 1) for word in ("--set", f"network.{index}.radio.bit_error_rate=0")]
    ports = ("--tcp", 0, "--tcp", "0@1")
    with served(scenario, *ports, *settings, "--once", "--out", tmp_path / "out") as session:
        one, other = (serial.serial_for_url(url, timeout=5) for url in session.ports["tcp"])
        one.timeout = 0.2
        other.write(question(0))
        assert (len(other.read(ANSWER_BYTES)), one.read(ANSWER_BYTES)) == (ANSWER_BYTES, b"")
        one.close()
        other.close()
        session.wait()
    assert sent_bytes(tmp_path / "out/run.mcap", network=1) == question(0)
    assert replays(tmp_path / "out/run.mcap") > 3
