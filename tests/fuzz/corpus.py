"""The kept inputs of each target, and how they are chosen from many: `tests/fuzz/corpus/TARGET/`.

Inputs are chosen by what they reach: the lines of our Python code, one after the other (a line and the one before it in
the same function), and the outcome. The smallest input that reaches something new is kept first.
"""

import hashlib
import sys
import time
from pathlib import Path

FOLDER = Path(__file__).parent / "corpus"
MOST_FILES = 24
MOST_BYTES = 4096
MOST_S = 0.4
"""So long the kept inputs of a target may take together: they are run by each run of the tests."""
ROOT = Path(__file__).parents[2]
_OURS = tuple(f"{ROOT / part}/" for part in ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin"))


def kept(name):
    """In the order of their names."""
    return [path.read_bytes() for path in sorted((FOLDER / name).glob("*"))]


def file_name(data):
    return hashlib.sha256(data).hexdigest()[:12]


def reached(run, data):
    """What an input reaches; an input that breaks the promise reaches nothing."""
    found = set()

    def trace(frame, event, argument):
        path = frame.f_code.co_filename
        if event != "call" or not path.startswith(_OURS):
            return None
        last = 0

        def line(frame, event, argument):
            nonlocal last
            if event == "line":
                found.add((path, last, frame.f_lineno))
                last = frame.f_lineno
            return line

        return line

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        outcome = run(data)
    except Exception:
        return set()
    finally:
        sys.settrace(before)
    return {*found, (outcome, 0, 0)}


def chosen(run, inputs, most_bytes=MOST_BYTES):
    """At most `MOST_FILES` of the inputs up to `most_bytes`: each time the smallest of those that add most."""
    small = sorted({data for data in inputs if len(data) <= most_bytes}, key=lambda data: (len(data), data))
    run(b"")  # what is read and kept once must not count for the first input
    candidates = [(data, reached(run, data)) for data in small]
    covered = set()
    found = []
    while len(found) < MOST_FILES:
        data, features = max(candidates, key=lambda one: len(one[1] - covered), default=(b"", set()))
        if not features - covered:
            break
        covered |= features
        found.append(data)
    end_s = time.process_time() + MOST_S
    for count, data in enumerate(found, 1):
        run(data)
        if time.process_time() > end_s:
            return found[:count]
    return found


def keep(name, inputs):
    """Makes these the kept inputs."""
    folder = FOLDER / name
    folder.mkdir(parents=True, exist_ok=True)
    wanted = {file_name(data): data for data in inputs}
    for path in folder.glob("*"):
        if path.name not in wanted:
            path.unlink()
    for file, data in wanted.items():
        (folder / file).write_bytes(data)
