"""A program on a terminal of its own, as somebody would use it."""

import os
import pty
import select
import termios
import time
from contextlib import contextmanager

from tests import children

PATIENCE_S = 60


class Terminal:
    """The far end of the terminal: the keyboard, and what is shown."""

    def __init__(self, master, process):
        self.master = master
        self.process = process
        self.shown = b""

    def type(self, keys):
        os.write(self.master, keys.encode())

    def until(self, text):
        """Reads on until `text` was shown since the last call."""
        deadline = time.monotonic() + PATIENCE_S
        while text.encode() not in self.shown:
            assert time.monotonic() < deadline, self.shown
            if select.select([self.master], [], [], 0.1)[0]:
                self.shown += os.read(self.master, 1024)
            else:
                assert self.process.poll() is None, self.shown
        self.shown = self.shown.partition(text.encode())[2]


@contextmanager
def terminal(*command, **more):
    """Starts a program in a terminal, which it has to leave as it found it."""
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    process = children.start(list(map(str, command)), stdin=slave, stdout=slave, stderr=slave, **more)
    try:
        yield Terminal(master, process)
        process.wait(PATIENCE_S)
        assert termios.tcgetattr(slave) == before
    finally:
        process.kill()
        process.communicate()
        os.close(master)
        os.close(slave)
