"""Kills runs at random moments and looks at what is left: `python -m tests.mirotwin.shell.killed --times 200`.

A run writes the time at which each control period was computed into memory that it shares with this process (by a
callback put in here, the program knows nothing of it). SIGKILL comes at a random moment after its first control
period. Then the recording has to be readable, what it lacks has to be at most half a second of wall time, its digests
have to be those of the other rounds, and nothing else may be in the folder.
"""

import argparse
import mmap
import os
import random
import signal
import struct
import sys
import tempfile
import time
from pathlib import Path

from mirotwin.commands import main
from mirotwin.recording import reader as recording_reader
from mirotwin.runs import runner
from tests import children

LONGEST_LOSS_S = 0.5
LATEST_KILL_S = 2.0
PERIODS = 18_000  # 600 s
TEXT = """name = "long"
duration_s = 600.0
[[network]]
[[network.robot]]
slot = 0
reference = { kind = "line", drive_s = 5.0 }
"""
_TIME = struct.Struct("<d")


class Times:
    """When each control period was computed, in memory that the processes share."""

    def __init__(self):
        self.memory = mmap.mmap(-1, _TIME.size * PERIODS)

    def put(self, index):
        _TIME.pack_into(self.memory, _TIME.size * index, time.monotonic())

    def get(self):
        times = [time_s for (time_s,) in _TIME.iter_unpack(self.memory[:])]
        return times[: times.index(0.0)] if 0.0 in times else times


def run_publishing(times, scenario, out):
    """The command, with a callback that tells `times` of each period as soon as there is one."""
    run = runner.run

    def published(world, recorder, full, keep, move=None):
        def note(period):
            times.put(period.index)
            return keep(period)

        run(world, recorder, full, note, move)

    runner.run = published
    main(["run", str(scenario), "--out", str(out), "--quiet"])


def killed_run(scenario, out, delay_s):
    """Starts a run, kills it `delay_s` after its first control period, returns when its periods were computed."""
    times = Times()
    process = children.fork()
    if process == 0:
        try:
            run_publishing(times, scenario, out)
        finally:
            os._exit(1)  # it ended before it was killed
    while not times.get():
        assert os.waitpid(process, os.WNOHANG) == (0, 0), "the run ended before its first control period"
        time.sleep(0.01)
    time.sleep(delay_s)
    os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    assert os.WIFSIGNALED(status), "the run ended by itself; make it longer"
    return times.get()


def check(out, times, digests):
    """Periods that are missing, and for how long they had been there, in s. AssertionError for a bad rest."""
    left = sorted(path.name for path in out.parent.iterdir()), sorted(path.name for path in out.iterdir())
    assert left == (["long.toml", "out"], ["run.part.mcap"]), left
    recording = recording_reader.read(out / "run.part.mcap")
    assert "broken off" in recording.broken_off
    for period in recording.periods:
        assert digests.setdefault(period.index, period.digest) == period.digest
    there, computed = len(recording.periods), len(times)
    loss_s = times[-1] - times[there] if there < computed else 0.0
    assert loss_s <= LONGEST_LOSS_S, f"{loss_s} s of {computed} periods are missing"
    return max(computed - there, 0), loss_s


def rounds(times, seed):
    """Raises AssertionError for the first round that goes wrong."""
    draw = random.Random(seed)
    digests = {}
    losses = []
    for count in range(times):
        delay_s = draw.uniform(0.0, LATEST_KILL_S)
        with tempfile.TemporaryDirectory() as name:
            scenario, out = Path(name) / "long.toml", Path(name) / "out"
            scenario.write_text(TEXT)
            missing, loss_s = check(out, killed_run(scenario, out, delay_s), digests)
        losses.append(loss_s)
        print(
            f"{count}: killed after {delay_s:.3f} s, {missing} control periods missing ({loss_s:.3f} s)",
            flush=True,
        )
    print(f"{times} runs killed, {times} recordings readable; most missing: {max(losses):.3f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    try:
        rounds(given.times, given.seed)
    except AssertionError as error:
        sys.exit(f"failed: {error}")
