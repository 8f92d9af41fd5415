"""Other people's programs between PC and robot, and adapters that keep characters: socat, ser2net, RFC 2217, FTDI.

The robot is another process, `mirotwin serve` in real time. How late its answers come depends on what else the machine
does, and is told; nothing else may differ, unless frames came to that process at other times than they were sent.
"""

import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import pytest

from tests import children
from tests.mirotwin import program
from tests.mirotwin.desk.rig import QUIET, as_hardware, moved_at, stream_text
from tests.mirotwin.ports.rig import served

FRAMES = 20
MOVED_TICKS = 2 * 24_000
"""A robot's process that is not held up gets frames within 0.5 ms of their rhythm."""
BRIDGE = """
import os, socket, sys, threading, serial, serial.rfc2217
port = serial.serial_for_url(sys.argv[1], timeout=0.002)
socket.socket(fileno=os.dup(port.fileno())).setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
listening = socket.create_server(("127.0.0.1", 0))
print(listening.getsockname()[1], flush=True)
client, _ = listening.accept()
class Client:
    def write(self, data):
        client.sendall(data)
manager = serial.rfc2217.PortManager(port, Client())
def up():
    while True:
        data = port.read(256)
        if data:
            client.sendall(b"".join(manager.escape(data)))
threading.Thread(target=up, daemon=True).start()
while data := client.recv(4096):
    port.write(b"".join(manager.filter(data)))
"""
"""pyserial's own RFC 2217 server."""


@contextmanager
def running(*command, **more):
    process = children.start(command, **more)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(timeout=30)


def waited(there):
    """The first true answer, in at most 20 s."""
    until_s = time.monotonic() + 20
    while not (found := there()):
        assert time.monotonic() < until_s
        time.sleep(0.02)
    return found


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as found:
        return found.getsockname()[1]


@contextmanager
def directly(session, folder):
    yield f"socket://127.0.0.1:{session.number()}"


@contextmanager
def socat(session, folder):
    link = folder / "adapter"
    with running("socat", f"PTY,link={link},raw,echo=0", f"TCP:127.0.0.1:{session.number()},nodelay"):
        waited(link.exists)
        yield str(link)


@contextmanager
def ser2net(session, folder, accepter="tcp", scheme="socket"):
    number = free_port()
    (folder / "ser2net.yaml").write_text(
        f"connection: &robot\n  accepter: {accepter},127.0.0.1,{number}\n"
        f"  connector: serialdev,{session.ports['pty'][0]},9600n81,local\n"
    )
    command = (shutil.which("ser2net", path="/usr/sbin:/usr/bin"), "-n", "-c", str(folder / "ser2net.yaml"))
    with running(*command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):

        def listens():
            with suppress(OSError), socket.create_connection(("127.0.0.1", number), timeout=1):
                return True
            return False

        waited(listens)
        time.sleep(0.5)  # until the look above has let go of the port
        yield f"{scheme}://127.0.0.1:{number}"


def ser2net_by_rfc2217(session, folder):
    return ser2net(session, folder, "telnet(rfc2217),tcp", "rfc2217")


needs_ser2net = pytest.mark.skipif(
    not shutil.which("ser2net", path="/usr/sbin:/usr/bin"), reason="needs ser2net"
)


@contextmanager
def rfc2217_server(session, folder):
    url = f"socket://127.0.0.1:{session.number()}"
    with running(sys.executable, "-c", BRIDGE, url, stdout=subprocess.PIPE, text=True) as process:
        yield f"rfc2217://127.0.0.1:{int(process.stdout.readline())}"


def adapter(keeps_s):
    """One that hands characters on when it has 62 of them or its timer is over, as FTDI's do."""

    @contextmanager
    def between(session, folder):
        with socket.create_server(("127.0.0.1", 0)) as listening:
            thread = threading.Thread(target=carry, args=(listening, session.number(), keeps_s), daemon=True)
            thread.start()
            yield f"socket://127.0.0.1:{listening.getsockname()[1]}"

    return between


def carry(listening, number, keeps_s):
    client, _ = listening.accept()
    robot = socket.create_connection(("127.0.0.1", number))
    robot.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def up():
        with suppress(OSError):
            while data := robot.recv(62):
                time.sleep(keeps_s)
                client.sendall(data)

    threading.Thread(target=up, daemon=True).start()
    with suppress(OSError):
        while data := client.recv(4096):
            robot.sendall(data)
    robot.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "between",
    [
        directly,
        pytest.param(socat, marks=pytest.mark.skipif(not shutil.which("socat"), reason="needs socat")),
        pytest.param(ser2net, marks=needs_ser2net),
        pytest.param(ser2net_by_rfc2217, marks=needs_ser2net),
        rfc2217_server,
        *(pytest.param(adapter(ms / 1000), id=f"{ms} ms") for ms in (1, 4, 16)),
    ],
)
def test_nothing_differs_but_times(tmp_path, between):
    (tmp_path / "drive.stream").write_text(stream_text(FRAMES))
    ports = ("--tcp", 0, "--pty", tmp_path / "pty")
    with served("fig6", *ports, *QUIET, "--out", tmp_path / "session", preexec_fn=as_hardware) as session:
        with between(session, tmp_path) as url:
            options = ("--allow-motion", "--json", "--all", "--out", "desk")
            done = program.run("replay", "drive.stream", "--port", url, *options, cwd=tmp_path)
        session.stop()
    assert done.returncode in (0, 4), done.stderr
    assert f"{FRAMES} transmissions sent, 99 % less than" in done.stderr
    found = [one for one in json.loads(done.stdout)["differences"] if "late" not in str(one["robot"])]
    recordings = tmp_path / "desk" / "run.mcap", tmp_path / "session" / "run.part.mcap"  # it was interrupted
    moved = moved_at([one["tick"] for one in found], *recordings)
    assert [one for one, ticks in zip(found, moved, strict=True) if ticks < MOVED_TICKS] == [], done.stderr
