"""A robot at a port for long: `python -m tests.mirotwin.desk.long --minutes 30 --times 20`.

Half an hour of a stream goes to a served robot over a pseudo-terminal while all processors are busy; then its firmware
is tried by the rules that answers show, twenty times. Told are the lateness of what was sent, frames that did not
arrive, how far the served robot fell behind the wall clock, what differs from the twin, and the verdicts. The robot is
a process of this machine, which no load must slow down: it gets real-time priority where that is allowed. Exit code 1:
a frame was lost, a rule failed, or an answer differs though frames came to the robot in their rhythm. `--smoke` takes
a minute.
"""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.mirotwin import program
from tests.mirotwin.desk.rig import QUIET, as_hardware, moved_at, stream_text
from tests.mirotwin.ports.rig import sent_bytes, served
from tests.mirotwin.ports.sessions import load

FRAMES_A_MINUTE = 1798
STOP_BYTES = 10 * 23  # three frames with the numbers that follow, seven in steps of 8
LATE_TICKS = 10 * 24_000
QUICK = ("P05", "P07", "P17", "P41", "P50")


def mirotwin(folder, *words):
    done = program.run(*words, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def replayed(folder, robot, minutes):
    """Whether nothing is lost and nothing differs."""
    (folder / "drive.stream").write_text(stream_text(round(FRAMES_A_MINUTE * minutes)))
    link, out = folder / "radio", robot / "session"
    with served("fig6", "--pty", link, "--once", *QUIET, "--out", out, preexec_fn=as_hardware) as session:
        options = ("--port", "radio", "--allow-motion", "--json", "--all", "-q", "--out", "desk")
        code, found, err = mirotwin(folder, "replay", "drive.stream", *options)
        session.wait()
    print(err.strip(), *session.err.strip().splitlines()[-2:], sep="\n", flush=True)
    if code not in (0, 4):
        return False
    live = json.loads((out / "summary.json").read_bytes())["live"]
    lost = len(sent_bytes(folder / "desk" / "run.mcap")) - len(sent_bytes(out / "run.mcap")) + STOP_BYTES
    differences = json.loads(found)["differences"]
    moved = moved_at([one["tick"] for one in differences], folder / "desk" / "run.mcap", out / "run.mcap")
    ours = [one for one, ticks in zip(differences, moved, strict=True) if ticks < LATE_TICKS]
    channels = dict(Counter(one["channel"] for one in differences))
    print(f"{lost} characters lost; {len(differences)} differences: {channels},")
    print(f"all but {len(ours)} of them where frames came to the robot more than 10 ms apart: {ours[:3]}")
    print(
        f"the served robot was behind by at most {live['late_max_ms']:.1f} ms, by 20 ms for {live['late_s']:.1f} s"
    )
    return not lost and not ours


def tried(folder, robot, times, rules):
    """Whether no rule failed."""
    verdicts = Counter()
    link, out = folder / "tried", robot / "trials"
    with served("fig6", "--pty", link, *QUIET, "--out", out, preexec_fn=as_hardware) as session:
        for number in range(times):
            ids = (word for rule in rules for word in ("--rule", rule))
            code, found, err = mirotwin(folder, "conform", "--port", "tried", "--json", "-q", *ids)
            if code not in (0, 1):
                print(err.strip())
                return False
            for case in json.loads(found)["cases"]:
                verdicts[case["verdict"]] += 1
                if case["verdict"] in ("failed", "not judged"):
                    print(f"{number}: {case['rule']} {case['verdict']}: {case['lines'][0]}", flush=True)
        session.stop()
    print(f"{times} times: {dict(verdicts)}")
    return not verdicts["failed"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="of replay")
    parser.add_argument("--times", type=int, default=20, help="conform")
    parser.add_argument("--smoke", action="store_true", help="10 s of replay, five rules once")
    asked = parser.parse_args()
    minutes, times, rules = (1 / 6, 1, QUICK) if asked.smoke else (asked.minutes, asked.times, ())
    memory = "/dev/shm" if os.path.isdir("/dev/shm") else None  # for the robot, which writes to no disk
    with (
        tempfile.TemporaryDirectory() as name,
        tempfile.TemporaryDirectory(dir=memory) as robot,
        load(os.cpu_count() or 1, nice=10),
    ):
        alike = replayed(Path(name), Path(robot), minutes) if minutes else True
        right = tried(Path(name), Path(robot), times, rules) if times else True
    return 0 if alike and right else 1


if __name__ == "__main__":
    sys.exit(main())
