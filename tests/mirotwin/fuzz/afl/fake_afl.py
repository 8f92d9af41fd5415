"""The other end of the fork-server protocol: what AFL++ does with a target process, by pipes and shared memory."""

import ctypes
import os
import signal
import struct
import sys
from pathlib import Path

from mirotwin.fuzz.afl.serve import CASES_VARIABLE, CONTROL_FD, MAP_VARIABLE, STATUS_FD, attach
from tests import children

ROOT = Path(__file__).parents[4]
PRIVATE, CREATE, REMOVE = 0, 0o1000, 0
CASES_BYTES = 4096


class Segment:
    """A segment of shared memory, removed at the end."""

    def __init__(self, size):
        self._library = ctypes.CDLL(None, use_errno=True)
        self.number = self._library.shmget(PRIVATE, ctypes.c_size_t(size), CREATE | 0o600)
        assert self.number >= 0, os.strerror(ctypes.get_errno())
        self.memory = attach(self.number)

    def remove(self):
        self._library.shmctl(self.number, REMOVE, None)


class FakeAfl:
    """Starts the server of `spec` and speaks to it. `without`: a variable that it does not get."""

    def __init__(self, spec, beside="", without=""):
        self.edges, self.cases = Segment(65536), Segment(CASES_BYTES)
        to_server, self.control = os.pipe()
        self.status, from_server = os.pipe()

        def prepare():
            os.dup2(to_server, CONTROL_FD)
            os.dup2(from_server, STATUS_FD)

        variables = {MAP_VARIABLE: str(self.edges.number), CASES_VARIABLE: str(self.cases.number)}
        variables.pop(without, None)
        self.server = children.start(
            [sys.executable, "-m", "mirotwin.fuzz.afl.serve", spec.text(), *([beside] if beside else [])],
            env={**os.environ, **variables},
            cwd=ROOT,
            close_fds=False,  # those two stay open, all others close by themselves
            preexec_fn=prepare,
            stderr=children.subprocess.PIPE,
            text=True,
        )
        os.close(to_server)
        os.close(from_server)

    def hello(self):
        """The first word of the server, answered as AFL++ does."""
        said = os.read(self.status, 4)
        if said:
            os.write(self.control, said)
        return struct.unpack("<I", said)[0] if said else 0

    def run(self, data):
        """Process id and wait status for an input; the edge map is cleared before."""
        self.edges.memory[:] = bytes(len(self.edges.memory))
        self.cases.memory[: 4 + len(data)] = struct.pack("<I", len(data)) + data
        os.write(self.control, bytes(4))
        return struct.unpack("<iI", self._read(8))

    def _read(self, count):
        found = b""
        while len(found) < count:
            piece = os.read(self.status, count - len(found))
            if not piece:
                return bytes(count)
            found += piece
        return found

    def end(self):
        """Ends as AFL++ does; the exit code of the server."""
        os.close(self.control)
        code = self.server.wait(20)
        os.close(self.status)
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.edges.remove()
        self.cases.remove()
        if self.server.poll() is None:
            self.server.send_signal(signal.SIGKILL)
            self.server.wait()
        if self.server.stderr is not None:
            self.server.stderr.close()
