"""Live sessions under load, each replayed: `python -m tests.mirotwin.ports.sessions --count 50`.

Some run at once, beside processes that keep all processors busy, so worlds are late and bytes arrive at any time. A
client asks robots at random moments, in pieces that may end anywhere, and vanishes in some sessions in the middle of
a frame. Then the recording has to give the same digest in every control period when what the hosts sent is sent
again.
"""

import argparse
import json
import os
import random
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from tests import children
from tests.mirotwin.ports.rig import question, replays, sent_bytes, served

FRAMES = 25
BUSY = "while True: pass"


@contextmanager
def load(processes, nice=0):
    """So many processes that do nothing but compute."""
    command = ["nice", "-n", f"{nice}", sys.executable, "-c", BUSY]
    busy = [children.start(command, stdout=subprocess.DEVNULL) for _ in range(processes)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def client(number, draw):
    """Sends frames and pieces of them, reads what comes, and goes; returns what it sent, and whether it vanished."""
    sent = b""
    with socket.create_connection(("127.0.0.1", number), timeout=60) as port:
        for seq in range(FRAMES):
            frame = question(seq, draw.randrange(-400, 400))
            cut = draw.choice((0, 0, 0, draw.randrange(1, len(frame))))
            for piece in filter(None, (frame[:cut], frame[cut:])):
                port.sendall(piece)
                sent += piece
                time.sleep(draw.choice((0.0, 0.002, 0.033)))
            port.setblocking(False)
            with suppress(BlockingIOError):
                port.recv(4096)
            port.setblocking(True)
        vanishes = draw.random() < 0.3
        if vanishes:
            port.sendall(frame[:9])
            sent += frame[:9]
            port.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    return sent, vanishes


def session(seed, folder):
    """One session; returns its control periods and by how much it was late, in ms. AssertionError unless it replays."""
    draw = random.Random(seed)
    settings = ("--set", f"network.radio.latency_s={draw.choice((0, 0.002, 0.005))}")
    out = folder / f"{seed}"
    with served("fig6", "--seed", seed, "--tcp", 0, "--once", *settings, "--out", out) as process:
        sent, vanished = client(process.number(), draw)
        process.wait()
    assert process.code == 0, process.err
    heard = sent_bytes(out / "run.mcap")
    if vanished:  # what the kernel still held is gone with the connection
        assert sent.startswith(heard)
    else:
        assert sent == heard
    late_ms = json.loads((out / "summary.json").read_bytes())["live"]["late_max_ms"]
    return replays(out / "run.mcap"), late_ms


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--together", type=int, default=5, help="sessions at once")
    parser.add_argument("--load", type=int, default=os.cpu_count() or 1, help="busy processes beside them")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="sessions-"))
    with load(options.load), ThreadPoolExecutor(options.together) as pool:
        found = list(pool.map(lambda seed: session(seed, folder), range(options.count)))
    shutil.rmtree(folder)
    late = sorted(late_ms for _, late_ms in found)
    print(
        f"{len(found)} sessions, {sum(periods for periods, _ in found)} control periods: all digests equal;"
        f" late by at most {late[len(late) // 2]:.0f} ms (median), {late[-1]:.0f} ms (worst)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
