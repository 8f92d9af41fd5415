"""The sample project as a user has it: `python -m tests.project.sample`.

It is begun in one environment, by an installed wheel, and tested in another one, in which its own requirements alone
are installed: as its workflow does. Compiling takes minutes; with `--smoke` the wheel is built without, and gets the
compiled modules of this tree.
"""

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

from tests import children
from tests.project.clean import Clean, pure_wheel
from tests.project.lowest import ROOT, copy_tree

MISTAKE = ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)")
LINE = re.compile(r"^\s*((?:mirotwin replay|mirotwin test|pytest) .*)$", re.M)
"""What a failing test prints to be run again."""
ACTION = ".github/actions/mirotwin/action.yml"
TESTS = ("conform", "scenarios", "pytest")


def begun(folder, wheel):
    """The project, written by Mirotwin from that wheel."""
    user = Clean(folder / "user")
    user.folder.mkdir()
    user.make()
    user.must("pip", "install", "-q", wheel)
    user.must("mirotwin", "init", "mine")
    return user.folder / "mine"


class Sample(Clean):
    """A new environment, and the project that is tested in it."""

    def __init__(self, folder, project):
        super().__init__(folder)
        self.project = project

    def install(self, smoke):
        """As the workflow does, word by word."""
        self.make()
        (step,) = re.findall(r"- run: (pip .*)", (self.project / ACTION).read_text("utf-8"))
        self.must("sh", "-c", step, cwd=self.project)
        if smoke:
            self.copy_engines()

    def again(self, out):
        """The lines in `out` that reproduce a failure, with the exit code that each gives."""
        return [
            (self.run("sh", "-c", line, cwd=self.project)[0], line)
            for line in dict.fromkeys(LINE.findall(out))
        ]


def built(folder, smoke):
    """A wheel of this tree."""
    if smoke:
        copy_tree(folder / "tree", ())
        return pure_wheel(folder / "tree", folder / "dist")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), "."]
    children.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def tried(sample):
    """What is wrong: nothing, if the project passes as it is, and each failure of a wrong firmware is reproduced."""
    found = []
    for test in TESTS:
        begun = time.perf_counter()
        code, out = sample.run("make", "-s", test, cwd=sample.project)
        print(f"make {test}: {time.perf_counter() - begun:.1f} s", flush=True)
        if code:
            found.append(f"make {test} fails:\n{out}")
    source = sample.project / "firmware" / MISTAKE[0]
    text = source.read_text(encoding="utf-8")
    assert text.count(MISTAKE[1]) == 1
    source.write_text(text.replace(*MISTAKE[1:]), encoding="utf-8")
    for test in TESTS:
        code, out = sample.run("make", "-s", test, cwd=sample.project)
        lines = sample.again(out)
        print(
            f"make {test} with a failsafe of 125 ms: exit code {code}, {len(lines)} lines to reproduce",
            flush=True,
        )
        if not code or not lines:
            found.append(
                f"make {test} does not find a failsafe of 125 ms, or says not how to reproduce it:\n{out}"
            )
        found += [f"exit code {code}, not 1: {line}" for code, line in lines if code != 1]
    return found


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="take the compiled modules of this tree")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="mirotwin-sample-") as name:
        folder = Path(name)
        wheel = built(folder, given.smoke)
        sample = Sample(folder, begun(folder, wheel))
        sample.install(given.smoke)
        found = tried(sample)
    for what in found:
        print(what, file=sys.stderr)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
