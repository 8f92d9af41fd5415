"""What the tests of plugs share: a served session, frames, and whether a recording replays to its own digests."""

import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

from miro_protocol.frames import TeamFrame, encode
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from mirotwin.recording import reader
from mirotwin.rerun.job import script_of
from tests import children

ROOT = Path(__file__).parents[3]
PROGRAM = "from mirotwin.entry import main; main()"
CLEAN = ("network.radio.bit_error_rate=0",)
"""Settings with which no answer is lost."""
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


@dataclass
class Served:
    """A running `mirotwin serve`: its process, and by kind of port where they are."""

    process: subprocess.Popen[str]  # noqa: TID251
    ports: dict[str, list[str]] = field(default_factory=dict)
    code: int | None = None
    err: str = ""

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
    command = [sys.executable, "-c", PROGRAM, "serve", *map(str, arguments)]
    process = children.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)
    found = Served(process)
    assert process.stdout is not None
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


def fake_pace(factor=1.0):
    """A pace whose wall clock stands wherever a test puts `now`; looking at it takes `per_look` ticks."""
    from mirotwin.rerun.pacing import Pace

    class Faked(Pace):
        def __init__(self):
            super().__init__(factor)
            self.now = 0
            self.per_look = 0

        def start(self, tick):
            self.now = tick

        def tick(self):
            self.now += self.per_look
            return self.now

    return Faked()


NO_SELECTOR = SimpleNamespace(
    select=lambda timeout=None: [],
    register=lambda *_: None,
    unregister=lambda *_: None,
    modify=lambda *_: None,
)
