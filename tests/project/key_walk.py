"""Prints the files that a key of a scenario passes from `mirotwin run` to the robot's body: `python -P key_walk.py
CHECKOUT`.

The key is set to a number that occurs nowhere else. Its walk are the functions that hold the number in what they are
given, each function once, and the callers to which they return.
"""

import os
import sys
import tempfile
from pathlib import Path

KEY, MARK = "network.robot.drive.chassis.wheel_radius_m", "0.0234567"
END = "chassis.py"


class Follower:
    """What `sys.setprofile` calls."""

    def __init__(self, root):
        self.root = root
        self.under_way = []
        self.seen = set()
        self.passed = []
        self.looks = False

    def __call__(self, frame, event, _value):
        code = frame.f_code
        own = code.co_filename.startswith(self.root) and "site-packages" not in code.co_filename
        if self.looks or not own or code.co_name[0] == "<" or code.co_name == "__repr__":
            return
        self.looks = True
        if event == "call":
            self._enter(code, frame)
        elif event == "return" and self.under_way and self.under_way.pop():
            self.passed += [one.co_filename for one in self.under_way if one][-1:]
        self.looks = False

    def _enter(self, code, frame):
        it = code not in self.seen and holds(frame)
        self.under_way.append(it and code)
        if it:
            self.seen.add(code)
            self.passed.append(code.co_filename)
            if code.co_filename.endswith(END):
                sys.setprofile(None)
                print("\n".join(self.passed), flush=True)
                os._exit(0)  # the rest of the run is of no interest


def holds(frame):
    """Whether what a function is given holds the number."""
    code = frame.f_code
    count = code.co_argcount + code.co_kwonlyargcount
    count += bool(code.co_flags & 0x04) + bool(code.co_flags & 0x08)  # *args, **kwargs
    return any(MARK in shown(frame.f_locals.get(name)) for name in code.co_varnames[:count])


def shown(value):
    try:
        return repr(value)
    except Exception:  # it is being made
        return ""


if __name__ == "__main__":
    root = Path(sys.argv[1]).resolve()
    sys.meta_path[:] = [one for one in sys.meta_path if "editable" not in getattr(one, "__module__", "")]
    folders = ("", "exact", "protocol", "robot_fw", "host", "sim")
    sys.path[:0] = [str(root / folder) for folder in folders]
    with tempfile.TemporaryDirectory() as out:
        options = ["--no-figure", "--engine", "python", "--set", f"{KEY}={MARK}", "--out", f"{out}/run"]
        sys.argv = ["mirotwin", "run", "fig6", *options]
        from mirotwin.entry import main

        sys.setprofile(Follower(f"{root}"))
        main()
