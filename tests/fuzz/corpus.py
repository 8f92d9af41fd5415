"""The kept inputs of each target, and how they are chosen from many: `tests/fuzz/corpus/TARGET/`.

Inputs are chosen by what they reach: the lines of our Python code, one after the other (a line and the one before it in
the same function), and the outcome. The smallest input that reaches something new is kept first.
"""

import hashlib
import sys
import time
from pathlib import Path

FOLDER = Path(__file__).parent / "corpus"
MOST_FILES = 20
MOST_BYTES = 4096
MOST_S = 0.4
"""So long the kept inputs of a target may take together: they are run by each run of the tests."""
ROOT = str(Path(__file__).parents[2])
_OURS = ("/exact/", "/protocol/", "/robot_fw/", "/host/", "/sim/")


def kept(name):
    """Names and contents, in the order of names."""
    return [(path.name, path.read_bytes()) for path in sorted((FOLDER / name).glob("*"))]


def file_name(data):
    return hashlib.sha256(data).hexdigest()[:12]


def reached(run, data):
    """What an input reaches; an input that breaks the promise reaches nothing."""
    found = set()

    def trace(frame, event, argument):
        path = frame.f_code.co_filename
        if event != "call" or not any(part in path for part in _OURS):
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
    return _within(run, found)


def _within(run, inputs):
    """As many of the inputs, from the front, as can be run in `MOST_S`."""
    end_s = time.process_time() + MOST_S
    found = []
    for data in inputs:
        run(data)
        found.append(data)
        if time.process_time() > end_s:
            break
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
