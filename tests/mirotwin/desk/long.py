"""A robot at a port for long: `python -m tests.mirotwin.desk.long --minutes 30 --times 20`.

Half an hour of a stream goes to a served robot over a pseudo-terminal while all processors are busy; then its firmware
is tried by the rules that answers show, twenty times. Told are the lateness of what was sent, what differs from the
twin, and the verdicts. Exit code 1: a difference that is no lateness, or a rule that failed. `--smoke` takes a minute.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests import children
from tests.mirotwin.desk.rig import stream_text
from tests.mirotwin.ports.rig import PROGRAM, served
from tests.mirotwin.ports.sessions import load

SETTINGS = ("--set", "network.radio.bit_error_rate=0", "--set", 'camera={kind="gaussian"}')
FRAMES_A_MINUTE = 1798
QUICK = ("P05", "P07", "P17", "P41", "P50")


def mirotwin(folder: Path, *words: str) -> tuple[int, str, str]:
    command = [sys.executable, "-c", PROGRAM, *words]
    done = children.run(command, cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def replayed(folder: Path, url: str, minutes: float) -> bool:
    """Whether nothing but times differs."""
    (folder / "drive.stream").write_text(stream_text(round(FRAMES_A_MINUTE * minutes)))
    code, out, err = mirotwin(
        folder, "replay", "drive.stream", "--port", url, "--allow-motion", "--json", "--all", "-q"
    )
    print(err.strip(), flush=True)
    if code not in (0, 4):
        return False
    found = json.loads(out)["differences"]
    late = [one for one in found if "late" in str(one["robot"])]
    print(f"{len(late)} answers late; {dict(Counter(one['channel'] for one in found if one not in late))}")
    return len(late) == len(found)


def tried(folder: Path, url: str, times: int, rules: tuple[str, ...]) -> bool:
    """Whether no rule failed."""
    verdicts: Counter[str] = Counter()
    for _ in range(times):
        ids = (word for rule in rules for word in ("--rule", rule))
        code, out, err = mirotwin(folder, "conform", "--port", url, "--json", "-q", *ids)
        if code not in (0, 1):
            print(err.strip())
            return False
        for line in map(json.loads, out.splitlines()):
            verdicts[line["verdict"]] += 1
            if line["verdict"] in ("failed", "not judged"):
                print(f"{line['rule']} {line['verdict']}: {line['text']}", flush=True)
    print(f"{times} times: {dict(verdicts)}")
    return not verdicts["failed"]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="of replay")
    parser.add_argument("--times", type=int, default=20, help="conform")
    parser.add_argument("--smoke", action="store_true", help="10 s of replay, five rules once")
    asked = parser.parse_args()
    minutes, times, rules = (1 / 6, 1, QUICK) if asked.smoke else (asked.minutes, asked.times, ())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with served("fig6", "--pty", folder / "radio", *SETTINGS, "--out", folder / "session") as session:
            with load(os.cpu_count() or 1):
                alike = replayed(folder, "radio", minutes) if minutes else True
                right = tried(folder, "radio", times, rules) if times else True
            session.stop()
            print(session.err.strip().splitlines()[-2:])
    return 0 if alike and right else 1


if __name__ == "__main__":
    sys.exit(main())
