"""What the tests of ports share: a served session, a world with ports in this process, frames, and replaying."""

import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from selectors import DefaultSelector
from unittest.mock import Mock

from miro_protocol.frames import TeamFrame, encode
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import live_scenario, parse
from miro_sim.world.world import World
from mirotwin.ports.endpoint import PortContext
from mirotwin.ports.radio_port import RadioPort
from mirotwin.ports.session import Pace
from mirotwin.recording import reader
from mirotwin.runs.job import script_of
from tests import children
from tests.mirotwin.program import COMMAND

ROOT = Path(__file__).parents[3]
CLEAN = ("--set", "network.radio.bit_error_rate=0")
"""With it no answer is lost."""
ANSWER_BYTES = 19


def own_image():
    return load_hex(image_path())


def question(seq, speed=200, robots=3):
    """Team velocities that ask robot `seq` modulo `robots`, which answers."""
    return encode(TeamFrame(3, seq, ((speed, speed),) * robots), robots)


def replays(path):
    """AssertionError unless what the hosts of a recording sent gives the same digests; returns how many periods."""
    recording = reader.read(path)
    scenario = parse(recording.source.scenario_text, "recorded")
    world = World(scenario, recording.source.seed, own_image(), script=script_of(recording.periods))
    for period in recording.periods:
        replayed = world.step()
        assert (period.index, period.digest) == (replayed.index, replayed.digest)
    return len(recording.periods)


def sent_bytes(path, network=0):
    """All that went on the air of a network, in the order of time."""
    found = script_of(reader.read(path).periods)
    return b"".join(one.data for one in found if one.network == network)


class Served:
    """A running `mirotwin serve`: its process, and by kind of port where they are."""

    def __init__(self, process):
        self.process = process
        self.ports = {}

    def number(self, kind="tcp"):
        return int(self.ports[kind][0].rpartition(":")[2])

    def stop(self, number=signal.SIGINT):
        self.process.send_signal(number)
        self.wait()

    def wait(self):
        _, self.err = self.process.communicate(timeout=120)
        self.code = self.process.returncode
        assert "Traceback" not in self.err, self.err


@contextmanager
def served(*arguments, **more):
    """A session, ready for clients; ended at the end if it has not."""
    command = [*COMMAND, "serve", *map(str, arguments)]
    process = children.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)
    found = Served(process)
    try:
        for line in process.stdout:
            if line == "serving\n":
                break
            kind, _, where = line.strip().partition(" ")
            found.ports.setdefault(kind, []).append(where)
        else:
            found.wait()
            raise AssertionError(f"serve ended with {found.code}: {found.err}")
        yield found
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


def python(code, *arguments, **more):
    """Runs a program of the user's in another process; it knows nothing of Mirotwin unless `code` imports it."""
    named = {"capture_output": True, "text": True, "timeout": 120, "check": False, **more}
    return children.run([sys.executable, "-c", code, *map(str, arguments)], **named)


class FakePace(Pace):
    """Its wall clock stands wherever a test puts `now`; looking at it takes `per_look` ticks."""

    now = per_look = 0

    def start(self, tick):
        self.now = tick

    def tick(self):
        self.now += self.per_look
        return self.now


NO_SELECTOR = Mock(**{"select.return_value": []})


def soon(port, wanted):
    """What the port receives until `wanted`, in at most 5 s."""
    got, until_s = b"", time.monotonic() + 5
    while not wanted():
        assert time.monotonic() < until_s, port.client
        got += port.receive()
        port.push()
        time.sleep(0.001)
    return got


def connected(port):
    client = socket.create_connection(("127.0.0.1", int(port.where.rpartition(":")[2])), timeout=5)
    soon(port, lambda: port.client)
    return client


class Rig:
    """A world and what is needed to open ports of its radio; `told` is what the user would read."""

    def __init__(self):
        self.world = World(live_scenario("fig6").scenario, 1, own_image())
        self.selector = DefaultSelector()
        self.told = []
        self.context = PortContext(RadioPort(self.world), self.selector, self.told.append)
        self.open = []

    def opened(self, kind, *where):
        port = kind(self.context, *where)
        self.open.append(port)
        return port

    def connected(self, kind):
        """A port of TCP, and a client."""
        port = self.opened(kind, "127.0.0.1", 0)
        client = connected(port)
        self.open.insert(0, client)
        return port, client

    def close(self):
        for one in self.open:
            one.close()
        assert not self.selector.get_map()
        self.selector.close()
